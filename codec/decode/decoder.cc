// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/codec/decoder.h>

#include <algorithm>

#include "intra/sign_tree.h"
#include "intra/vertex_coder.h"
#include "lattice/dual_mesh.h"

namespace isoreel {
namespace {

/// A packet taken apart: its sections by kind and level.
class Payload {
 public:
  static Result<Payload> open(ByteSpan packet, const DecodeOptions& options) {
    Payload result;
    std::size_t offset = 0;
    ISOREEL_ASSIGN(result.header_, readPacketHeader(packet, &offset));
    ByteSpan rest = packet.subspan(offset);
    std::uint64_t length = 0;
    for (const Section& s : result.header_.sections) length += s.bytes;
    if (rest.size() > length) {
      return {ErrorCode::kBadData, "packet: " + std::to_string(rest.size() - length) +
                                       " bytes behind its last section (spec codec 3.2)"};
    }
    if (rest.size() < length && !options.allow_prefix) {
      return {ErrorCode::kTruncated,
              "packet: cut short by " + std::to_string(length - rest.size()) + " bytes (spec codec 3.2)"};
    }
    if (rest.size() == length && crc32c(rest) != result.header_.payload_crc) {
      return {ErrorCode::kBadData, "packet: its payload CRC does not match (spec codec 3.2)"};
    }
    result.payload_ = rest;
    result.whole_size_ = offset + length;
    return result;
  }

  const PacketHeader& header() const { return header_; }
  /// Size of the packet when nothing is cut off.
  std::uint64_t wholeSize() const { return whole_size_; }
  /// The section's bytes; empty when the packet has none of the kind and level; nothing when it was cut off.
  std::optional<ByteSpan> section(SectionKind kind, std::uint32_t level) const {
    std::size_t start = 0;
    for (const Section& s : header_.sections) {
      if (s.kind == static_cast<std::uint32_t>(kind) && s.level == level) {
        if (start > payload_.size() || s.bytes > payload_.size() - start) return std::nullopt;
        return payload_.subspan(start, s.bytes);
      }
      start += s.bytes;
    }
    return ByteSpan{};
  }

 private:
  PacketHeader header_;
  ByteSpan payload_;
  std::uint64_t whole_size_ = 0;
};

Status leftOver(const char* what, std::uint32_t level) {
  return {ErrorCode::kBadData, std::string(what) + " of level " + std::to_string(level) +
                                   ": not used to their end (spec codec 6.2)"};
}

/// Where the signs alone put the vertices of a level's active cells: coarser cells are larger, and what lies
/// outside the grid is moved to its border.
std::vector<GridPosition> verticesFromSigns(const std::vector<Cell>& cells, const Grid& grid,
                                            std::uint32_t shift) {
  std::vector<GridPosition> result(cells.size());
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const LocalFrame& frame = kLocalFrames[cells[i].corners];
    const std::array<std::int64_t, 3> base{cells[i].x, cells[i].y, cells[i].z};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int64_t position = (base[axis] * kCell + frame.vertex[axis]) << shift;
      result[i][axis] = static_cast<std::int32_t>(
          std::min<std::int64_t>(position, std::int64_t{grid.nodes[axis] - 1} * kCell));
    }
  }
  return result;
}

Status counts(const char* what, std::size_t found, std::uint32_t stated) {
  return {ErrorCode::kBadData, "packet: " + std::to_string(found) + " " + what + ", where its header says " +
                                   std::to_string(stated) + " (spec codec 3.1)"};
}

/// The vertices of the full surface (spec codec 5.2).
Status decodeVertices(const PacketHeader& header, ByteSpan bytes, const std::vector<Cell>& cells,
                      VertexModels& models, Surface& surface) {
  if (cells.size() != header.vertices) return counts("active cells", cells.size(), header.vertices);
  const ResidualSteps steps{static_cast<std::int32_t>(header.step),
                            static_cast<std::int32_t>(header.tangential_step)};
  RangeGet coder(bytes);
  models.reset();
  surface.vertices.resize(cells.size());
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const auto in_cell =
        reconstruct(kLocalFrames[cells[i].corners], codeVertex(coder, models, cells[i].corners, {}), steps);
    surface.vertices[i] = {cells[i].x * kCell + in_cell[0], cells[i].y * kCell + in_cell[1],
                           cells[i].z * kCell + in_cell[2]};
  }
  if (!coder.finished()) {
    return {ErrorCode::kBadData, std::string("vertices: ") +
                                     (coder.overrun() ? "end too early" : "not used to their end") +
                                     " (spec codec 6.2)"};
  }
  return {};
}

}  // namespace

struct Decoder::State {
  VertexModels vertex_models;
  CellIndex index;
};

Decoder::Decoder() : state_(std::make_unique<State>()) {}
Decoder::Decoder(Decoder&&) noexcept = default;
Decoder& Decoder::operator=(Decoder&&) noexcept = default;
Decoder::~Decoder() = default;

Result<Surface> Decoder::decode(ByteSpan packet, const DecodeOptions& options) {
  ISOREEL_ASSIGN(const Payload payload, Payload::open(packet, options));
  const PacketHeader& header = payload.header();
  if (header.type != PacketType::kIntra)
    return {ErrorCode::kUnsupported, "packet type P is reserved in version 1 (spec codec 3.1)"};
  if (header.vertices > options.max_vertices) {
    return {ErrorCode::kLimit, "packet: " + std::to_string(header.vertices) +
                                   " vertices, above the limit of " + std::to_string(options.max_vertices)};
  }
  // Each vertex takes at least three decisions, and none is cheaper than 1/177 of a bit (spec codec 6.1).
  if (header.vertices / 512 > payload.wholeSize()) {
    return {ErrorCode::kBadData, "packet: " + std::to_string(header.vertices) +
                                     " vertices cannot come from " + std::to_string(payload.wholeSize()) +
                                     " bytes (spec codec 6.1)"};
  }
  ISOREEL_ASSIGN(const Configuration configuration, readConfiguration(header.configuration));

  Surface surface;
  surface.grid = configuration.grid;
  SignTree<RangeGet, UnknownTruth> tree(surface.grid, {}, header.vertices);
  const std::uint32_t depth = tree.depth();
  const std::uint32_t wanted = std::min(options.level.value_or(depth), depth);
  std::uint32_t level = 0;  // the level that the tree is at
  for (std::uint32_t next = 0; next <= wanted; ++next) {
    const auto sign_bytes = payload.section(SectionKind::kSigns, next),
               leaf_bytes = payload.section(SectionKind::kLeaves, next);
    if (!sign_bytes || !leaf_bytes) {
      if (next == 0)
        return {ErrorCode::kTruncated, "packet: cut before its first level is whole (spec codec 3.2)"};
      break;
    }
    level = next;
    RangeGet signs(*sign_bytes), leaves(*leaf_bytes);
    ISOREEL_TRY(level == 0 ? tree.codeRoot(signs, leaves) : tree.codeLevel(level, signs, leaves));
    if (!signs.finished()) return leftOver("corner signs", level);
    if (!leaves.finished()) return leftOver("leaf bits", level);
    if (tree.cells().empty()) break;
  }
  const bool whole = level == depth || tree.cells().empty();
  std::vector<Cell> cells = tree.takeCells();
  std::erase_if(cells, [](const Cell& cell) { return !isActive(cell); });

  const auto vertex_bytes = payload.section(SectionKind::kVertices, 0);
  const bool full = whole && wanted == depth && vertex_bytes.has_value();
  if (full) {
    ISOREEL_TRY(decodeVertices(header, *vertex_bytes, cells, state_->vertex_models, surface));
  } else {
    surface.vertices = verticesFromSigns(cells, surface.grid, depth - level);
  }
  state_->index.build(cells);
  surface.quads = dualQuads(cells, state_->index);
  if (full) {
    if (surface.quads.size() != header.faces) return counts("quads", surface.quads.size(), header.faces);
    if (surfaceHash(surface) != header.surface_hash) {
      return {ErrorCode::kBadData, "packet: the decoded surface does not match its hash (spec codec 7)"};
    }
  }
  return surface;
}

}  // namespace isoreel
