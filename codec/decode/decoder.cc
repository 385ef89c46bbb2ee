// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/codec/configuration.h>
#include <isoreel/codec/decoder.h>

#include <algorithm>

#include "inter/vertex_stream.h"
#include "intra/height_stream.h"
#include "intra/sign_tree.h"
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

/// The surface of one octree level from its signs alone: coarser cells are larger, and what lies outside the
/// grid is moved to its border.
Surface surfaceFromSigns(std::vector<Cell> cells, const Grid& grid, std::uint32_t shift) {
  std::erase_if(cells, [](const Cell& cell) { return !isActive(cell); });
  Surface surface;
  surface.grid = grid;
  surface.vertices.resize(cells.size());
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const LocalFrame& frame = kLocalFrames[cells[i].corners];
    const std::array<std::int64_t, 3> base{cells[i].x, cells[i].y, cells[i].z};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int64_t position = (base[axis] * kCell + frame.vertex[axis]) << shift;
      surface.vertices[i][axis] = static_cast<std::int32_t>(
          std::min<std::int64_t>(position, std::int64_t{grid.nodes[axis] - 1} * kCell));
    }
  }
  CellIndex index;
  index.build(cells);
  surface.quads = dualQuads(cells, index);
  return surface;
}

Status counts(const char* what, std::size_t found, std::uint32_t stated) {
  return {ErrorCode::kBadData, "packet: " + std::to_string(found) + " " + what + ", where its header says " +
                                   std::to_string(stated) + " (spec codec 3.1)"};
}

Status endOf(const RangeGet& coder, const char* what) {
  if (coder.finished()) return {};
  return {ErrorCode::kBadData, std::string(what) + ": " +
                                   (coder.overrun() ? "end too early" : "not used to their end") +
                                   " (spec codec 6.2)"};
}

GridPosition inGrid(const Cell& cell, const std::array<std::int32_t, 3>& in_cell) {
  return {cell.x * kCell + in_cell[0], cell.y * kCell + in_cell[1], cell.z * kCell + in_cell[2]};
}

/// The vertices of an I packet's full surface (spec codec 5.2).
Status decodeIntraVertices(ByteSpan bytes, const std::vector<Cell>& cells, const ResidualSteps& steps,
                           VertexModels& models, Surface& surface) {
  RangeGet coder(bytes);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    surface.vertices[i] = inGrid(
        cells[i],
        reconstruct(kLocalFrames[cells[i].corners], codeVertex(coder, models, cells[i].corners, {}), steps));
  }
  return endOf(coder, "vertices");
}

/// The vertices of an I packet of profile main (spec codec 11).
Status decodeHeights(ByteSpan bytes, const std::vector<Cell>& cells, const CellIndex& index,
                     std::int32_t step, std::uint32_t tools, HeightModels& models, HeightFrame& frame,
                     Surface& surface) {
  HeightHeader header;
  ByteReader in(bytes);
  if (!cells.empty()) ISOREEL_TRY(readSized(in, header));
  RangeGet coder(bytes.subspan(in.position()));
  frame.build(cells, index, surface.grid);
  models.reset();
  codeHeights(coder, models, header, cells, frame, step, tools,
              [](std::uint32_t, std::int32_t, const HeightContext&) { return 0; });
  for (std::size_t i = 0; i < cells.size(); ++i)
    surface.vertices[i] = inGrid(cells[i], atHeight(frame.predicted, i, frame.heights[i]));
  return endOf(coder, "vertices");
}

/// The vertices of a P packet's full surface (spec codec 8).
Status decodePredictedVertices(ByteSpan motion_bytes, ByteSpan vertex_bytes, const std::vector<Cell>& cells,
                               const CellIndex& index, const Reference& reference, const ResidualSteps& steps,
                               PacketModels& models, Surface& surface) {
  ByteReader in(motion_bytes);
  PredictionHeader header;
  ISOREEL_TRY(readSized(in, header));
  MotionField motion;
  motion.build(cells, header.block_log2, header.vector_step);
  RangeGet vectors(motion_bytes.subspan(in.position()));
  ISOREEL_TRY(motion.code(vectors, models.motion));
  ISOREEL_TRY(endOf(vectors, "motion vectors"));

  RangeGet coder(vertex_bytes);
  std::vector<Residual> residuals(cells.size());
  codeTangents(coder, models.vertices, cells, residuals);
  if (coder.overrun()) return endOf(coder, "vertices");
  const auto predictions = predictVertices(reference, motion, cells, residuals, steps);
  codeNormals(
      coder, models, header, cells, index, residuals, predictions, steps,
      [](std::uint32_t, std::int32_t) { return 0; }, surface.vertices);
  toGridPositions(cells, surface.vertices);
  return endOf(coder, "vertices");
}

}  // namespace

struct Decoder::State {
  PacketModels models;
  HeightModels height_models;
  HeightFrame heights;
  CellIndex index;
  // What a P packet goes on from: the packet decoded last, when it was decoded whole.
  std::optional<Configuration> configuration;
  std::uint64_t last = 0;
  Reference reference;

  /// The configuration that the packet is decoded with. OK for a P packet only right after its reference.
  Status begin(const PacketHeader& header) {
    if (header.type == PacketType::kIntra) {
      configuration.reset();
      ISOREEL_ASSIGN(configuration, readConfiguration(header.configuration));
      models.reset();
      models.signs.mixed = (configuration->tools & kToolMixedSigns) != 0;
      return {};
    }
    const std::uint64_t wanted = header.number - header.references[0];
    if (!configuration || last != wanted) {
      return {ErrorCode::kNotFound, "packet: predicted from frame " + std::to_string(wanted) +
                                        ", which was not decoded right before it (spec codec 8)"};
    }
    return {};
  }
};

Decoder::Decoder() : state_(std::make_unique<State>()) {}
Decoder::Decoder(Decoder&&) noexcept = default;
Decoder& Decoder::operator=(Decoder&&) noexcept = default;
Decoder::~Decoder() = default;

Result<Surface> Decoder::decode(ByteSpan packet, const DecodeOptions& options) {
  ISOREEL_ASSIGN(const Payload payload, Payload::open(packet, options));
  const PacketHeader& header = payload.header();
  if (header.vertices > options.max_vertices) {
    return {ErrorCode::kLimit, "packet: " + std::to_string(header.vertices) +
                                   " vertices, above the limit of " + std::to_string(options.max_vertices)};
  }
  // Each vertex takes three decisions of 1/177 of a bit at least, or one of 1/63 (spec codec 6.1).
  if (header.vertices / 512 > payload.wholeSize()) {
    return {ErrorCode::kBadData, "packet: " + std::to_string(header.vertices) +
                                     " vertices cannot come from " + std::to_string(payload.wholeSize()) +
                                     " bytes (spec codec 6.1)"};
  }
  State& state = *state_;
  ISOREEL_TRY(state.begin(header));
  const Configuration configuration = *state.configuration;
  state.configuration.reset();  // until this packet is decoded whole, nothing can go on from it

  const Grid& grid = configuration.grid;
  SignTree<RangeGet, UnknownTruth> tree(grid, {}, header.vertices, state.models.signs);
  const std::uint32_t depth = tree.depth();
  const std::uint32_t wanted = std::min(options.level.value_or(depth), depth);
  // Where P packets may follow, the rest is decoded too: they go on from it.
  const bool goes_on = (configuration.tools & kToolPrediction) != 0 && !options.allow_prefix;
  std::optional<Surface> coarse;
  for (std::uint32_t level = 0; level <= (goes_on ? depth : wanted); ++level) {
    const auto sign_bytes = payload.section(SectionKind::kSigns, level),
               leaf_bytes = payload.section(SectionKind::kLeaves, level);
    if (!sign_bytes || !leaf_bytes) {
      if (level == 0)
        return {ErrorCode::kTruncated, "packet: cut before its first level is whole (spec codec 3.2)"};
      return surfaceFromSigns(tree.takeCells(), grid, depth - level + 1);
    }
    RangeGet signs(*sign_bytes), leaves(*leaf_bytes);
    ISOREEL_TRY(level == 0 ? tree.codeRoot(signs, leaves) : tree.codeLevel(level, signs, leaves));
    if (!signs.finished()) return leftOver("corner signs", level);
    if (!leaves.finished()) return leftOver("leaf bits", level);
    if (tree.cells().empty()) break;
    if (level == wanted && level < depth) coarse = surfaceFromSigns(tree.cells(), grid, depth - level);
  }
  if (coarse && !goes_on) return *std::move(coarse);
  const auto motion_bytes = payload.section(SectionKind::kMotion, 0),
             vertex_bytes = payload.section(SectionKind::kVertices, 0);
  if (!motion_bytes || !vertex_bytes) return surfaceFromSigns(tree.takeCells(), grid, 0);

  const std::vector<Cell> cells = tree.takeCells();  // of the deepest level: all active
  if (cells.size() != header.vertices) return counts("active cells", cells.size(), header.vertices);
  state.index.build(cells);
  const ResidualSteps steps{static_cast<std::int32_t>(header.step),
                            static_cast<std::int32_t>(header.tangential_step)};
  Surface surface;
  surface.grid = grid;
  surface.vertices.resize(cells.size());
  if (configuration.profile == Profile::kMain) {
    ISOREEL_TRY(decodeHeights(*vertex_bytes, cells, state.index, steps.normal, configuration.tools,
                              state.height_models, state.heights, surface));
  } else if (header.type == PacketType::kIntra) {
    ISOREEL_TRY(decodeIntraVertices(*vertex_bytes, cells, steps, state.models.vertices, surface));
  } else {
    ISOREEL_TRY(decodePredictedVertices(*motion_bytes, *vertex_bytes, cells, state.index, state.reference,
                                        steps, state.models, surface));
  }
  surface.quads = dualQuads(cells, state.index);
  if (surface.quads.size() != header.faces) return counts("quads", surface.quads.size(), header.faces);
  if (surfaceHash(surface) != header.surface_hash) {
    return {ErrorCode::kBadData, "packet: the decoded surface does not match its hash (spec codec 7)"};
  }
  if ((configuration.tools & kToolPrediction) != 0) {
    state.reference.build(surface, cells, state.index);
    state.last = header.number;
    state.configuration = configuration;
  }
  return coarse ? *std::move(coarse) : std::move(surface);
}

}  // namespace isoreel
