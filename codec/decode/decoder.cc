// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/codec/configuration.h>
#include <isoreel/codec/decoder.h>

#include <algorithm>

#include "decode/height_slices.h"
#include "decode/predicted_part.h"
#include "inter/reference.h"
#include "intra/sign_tree.h"
#include "lattice/dual_mesh.h"
#include "lattice/sheets.h"
#include "syntax/slices.h"

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
  /// The highest level that has a section in front of the motion section.
  std::uint32_t lastLevelBeforeMotion() const {
    std::uint32_t last = 0;
    for (const Section& s : header_.sections) {
      if (s.kind == static_cast<std::uint32_t>(SectionKind::kMotion)) break;
      if (s.kind == static_cast<std::uint32_t>(SectionKind::kSigns) ||
          s.kind == static_cast<std::uint32_t>(SectionKind::kLeaves))
        last = std::max(last, s.level);
    }
    return last;
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
Surface surfaceFromSigns(std::vector<Cell> cells, const Grid& grid, std::uint32_t shift, bool sheets) {
  std::erase_if(cells, [](const Cell& cell) { return !isActive(cell); });
  CellIndex index;
  index.build(cells);
  if (sheets) cells = splitSheets(std::move(cells), index);
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
  surface.quads = dualQuads(cells, index);
  return surface;
}

/// What the surface that surfaceFromSigns() makes of a level's cells takes, with a copy of these.
std::uint64_t coarseBytes(std::size_t cells) {
  // Each of four sheets at most has a vertex, and each edge of a cell one quad.
  constexpr std::size_t kCellBytes =
      2 * sizeof(Cell) + 4 * (sizeof(Cell) + sizeof(GridPosition)) + 3 * sizeof(Quad);
  return cells * kCellBytes + CellIndex::bytesFor(cells);
}

/// What the full surface takes until it is decoded, with all that is made on the way.
std::uint64_t fullBytes(const PacketHeader& header, std::size_t bricks, const Configuration& configuration) {
  const std::uint64_t cells = roomFor(header.vertices);
  std::uint64_t sum = cells * (2 * sizeof(Cell) + sizeof(GridPosition)) + header.faces * sizeof(Quad) +
                      CellIndex::bytesFor(bricks);
  if (configuration.profile == Profile::kMain) {
    sum += HeightFrame::bytesFor(cells, bricks, sliceCount(header.vertices, configuration.slices));
  } else if (header.type == PacketType::kPredicted) {
    sum += CodedNeighbours::bytesFor(cells);
  }
  if ((configuration.tools & kToolPrediction) != 0) sum += cells * sizeof(ReferencePlane);
  return sum;
}

Status counts(const char* what, std::size_t found, std::uint32_t stated) {
  return {ErrorCode::kBadData, "packet: " + std::to_string(found) + " " + what + ", where its header says " +
                                   std::to_string(stated) + " (spec codec 3.1)"};
}

/// The vertices of an I packet's full surface, in their cells (spec codec 5.2).
Status decodeIntraVertices(ByteSpan bytes, const std::vector<Cell>& cells, const ResidualSteps& steps,
                           VertexModels& models, std::vector<std::array<std::int32_t, 3>>& vertices) {
  RangeGet coder(bytes);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    vertices[i] =
        reconstruct(kLocalFrames[cells[i].corners], codeVertex(coder, models, cells[i].corners, {}), steps);
  }
  return endOf(coder, "vertices");
}

/// The streams of a slice; threads write beside each other in these.
struct alignas(64) SliceStreams {
  RangeGet signs, leaves;
};

/// From the sections of a level. The deepest one has no leaf bits, in no slices.
Result<std::vector<SliceStreams>> sliceStreams(ByteSpan signs, ByteSpan leaves, std::size_t count,
                                               bool deepest) {
  ISOREEL_ASSIGN(const std::vector<ByteSpan> sign_streams, readSlices(signs, count));
  ISOREEL_ASSIGN(std::vector<ByteSpan> leaf_streams, readSlices(leaves, deepest ? 1 : count));
  leaf_streams.resize(count);
  std::vector<SliceStreams> streams;
  for (std::size_t n = 0; n < count; ++n)
    streams.push_back({RangeGet(sign_streams[n]), RangeGet(leaf_streams[n])});
  return streams;
}

}  // namespace

struct Decoder::State {
  ParallelFor parallel;
  PacketModels models;
  HeightFrame heights;
  CellIndex index;
  SignTreeMemory tree_memory;
  std::vector<Cell> cells;     // of the vertices of the surface decoded last
  std::uint32_t room_for = 0;  // vertices: what of the above is kept only for its room was so large once
  // What a P packet goes on from: the packet decoded last, when it was decoded whole.
  std::optional<Configuration> configuration;
  std::uint64_t last = 0;
  Reference reference;

  /// OK when `needed` bytes more than what a P packet goes on from can be had within `most`. Frees what is
  /// kept only for its room when that is in the way.
  Status makeRoom(std::uint64_t needed, std::uint64_t most) {
    const std::uint64_t all = needed + reference.bytes() + models.blocks.bytes();
    if (all > most) {
      return {ErrorCode::kLimit, "packet: takes " + std::to_string(all) +
                                     " bytes of memory to decode, above the limit of " +
                                     std::to_string(most)};
    }
    if (keptBytes() > most - all) dropKept();
    return {};
  }
  /// The same for the distance field of the reference, which is built.
  Status makeField(std::uint64_t most) {
    if (keptBytes() <= most && reference.buildField(most - keptBytes(), parallel)) return {};
    dropKept();
    if (reference.buildField(most, parallel)) return {};
    return {ErrorCode::kLimit,
            "packet: the distance field of the surface before it takes more memory than "
            "the limit of " +
                std::to_string(most) + " bytes"};
  }
  /// Frees what is kept only for its room when surfaces have become much smaller.
  void keepFor(std::uint32_t vertices) {
    if (vertices < room_for / 3 * 2) dropKept();
    room_for = std::max(room_for, vertices);
  }
  Result<Surface> decode(ByteSpan packet, const DecodeOptions& options);
  std::uint64_t keptBytes() const {
    return heights.bytes() + index.bytes() + tree_memory.bytes() + bytesOf(cells);
  }
  void dropKept() {
    heights = {};
    index = {};
    tree_memory = {};
    cells = std::vector<Cell>();
    room_for = 0;
  }

  /// The configuration that the packet is decoded with. OK for a P packet only right after its reference.
  Status begin(const PacketHeader& header) {
    if (header.type == PacketType::kIntra) {
      configuration.reset();
      ISOREEL_ASSIGN(configuration, readConfiguration(header.configuration));
      models.reset();
      models.mixSigns((configuration->tools & kToolMixedSigns) != 0);
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

Decoder::Decoder() : Decoder(serialFor) {}
Decoder::Decoder(ParallelFor parallel) : state_(std::make_unique<State>()) {
  state_->parallel = std::move(parallel);
}
Decoder::Decoder(const Decoder& other) : Decoder() { *this = other; }
Decoder& Decoder::operator=(const Decoder& other) {
  if (this == &other) return *this;
  if (!state_) state_ = std::make_unique<State>();
  state_->parallel = other.state_->parallel;
  state_->models = other.state_->models;
  state_->configuration = other.state_->configuration;
  state_->last = other.state_->last;
  state_->reference = other.state_->reference;
  state_->cells.clear();  // these and the index are made anew by each packet
  return *this;
}
Decoder::Decoder(Decoder&&) noexcept = default;
Decoder& Decoder::operator=(Decoder&&) noexcept = default;
Decoder::~Decoder() = default;

const std::vector<Cell>& Decoder::cells() const { return state_->cells; }
std::uint64_t Decoder::bytes(std::uint64_t vertices) const {
  return sizeof(State) + state_->models.bytes() + sizeof(ReferencePlane) * vertices;
}
std::uint64_t Decoder::bytes() const { return bytes(0) + state_->reference.bytes(); }

Result<Surface> Decoder::decode(ByteSpan packet, const DecodeOptions& options) {
  if (options.motion != nullptr) options.motion->clear();
  try {
    return state_->decode(packet, options);
  } catch (const std::bad_alloc&) {
    state_->configuration.reset();
    return {ErrorCode::kLimit, "packet: takes more memory to decode than there is"};
  }
}

Result<Surface> Decoder::State::decode(ByteSpan packet, const DecodeOptions& options) {
  cells.clear();
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
  ISOREEL_TRY(begin(header));
  const Configuration with = *configuration;
  configuration.reset();  // until this packet is decoded whole, nothing can go on from it

  keepFor(header.vertices);
  const Grid& grid = with.grid;
  tree_memory.cells = std::move(cells);
  SignTree<RangeGet, UnknownTruth> tree(grid, {}, header.vertices, with.slices, std::move(tree_memory));
  const std::uint32_t depth = tree.depth();
  const std::uint32_t wanted = std::min(options.level.value_or(depth), depth);
  // Where P packets may follow, the rest is decoded too: they go on from it.
  const bool sheets = (with.tools & kToolSheets) != 0;
  const bool goes_on = (with.tools & kToolPrediction) != 0 && !options.allow_prefix;
  const bool predicted = header.type == PacketType::kPredicted;
  const ReferenceField& field = reference.field();
  PredictedPart part;
  std::optional<ByteSpan> motion_bytes = ByteSpan{};
  if (predicted) {
    motion_bytes = payload.section(SectionKind::kMotion, 0);
    if (motion_bytes) {
      ISOREEL_TRY(part.open(*motion_bytes, depth, with.profile));
      ISOREEL_TRY(makeField(options.max_bytes));
    }
  }
  // Finer levels need the motion; they stand behind it.
  const std::uint32_t most = motion_bytes ? depth : payload.lastLevelBeforeMotion();
  std::optional<Surface> coarse;
  std::size_t slices = 1;  // at once
  // Whether there is room for so much more.
  const auto room = [&](std::uint64_t bytes) {
    bytes += models.bytesOfMore(slices);
    if (coarse) bytes += bytesOf(coarse->vertices) + bytesOf(coarse->quads);
    return makeRoom(tree.bytes() + PredictedPart::bytesFor(part.motion().blocks().size()) + bytes,
                    options.max_bytes);
  };
  for (std::uint32_t level = 0; level <= (goes_on ? depth : wanted); ++level) {
    if (level == 0 || !tree.cells().empty()) {
      const auto sign_bytes = payload.section(SectionKind::kSigns, level),
                 leaf_bytes = payload.section(SectionKind::kLeaves, level);
      if (!sign_bytes || !leaf_bytes || level > most) {
        if (level == 0)
          return {ErrorCode::kTruncated, "packet: cut before its first level is whole (spec codec 3.2)"};
        ISOREEL_TRY(room(coarseBytes(tree.cells().size())));
        return surfaceFromSigns(tree.takeCells(), grid, depth - level + 1, sheets);
      }
      slices = level == 0 ? 1 : tree.sliceCount();
      if (level > 0) ISOREEL_TRY(room(tree.bytesOfNextLevel()));
      ISOREEL_ASSIGN(std::vector<SliceStreams> streams,
                     sliceStreams(*sign_bytes, *leaf_bytes, slices, level == depth));
      models.haveSlices(slices);
      if (level == 0) {
        ISOREEL_TRY(tree.codeRoot(streams[0].signs, streams[0].leaves));
      } else if (predicted && motion_bytes && level > part.blockLevel()) {
        const auto of = [&](std::size_t n) {
          SliceModels& own = models.slices[n];
          return SignStreams{streams[n].signs, streams[n].leaves, own.signs,
                             MovedSigns(field, part.motion(), own.moved_signs, depth - level)};
        };
        ISOREEL_TRY(tree.codeLevel(level, of, parallel));
      } else {
        const auto of = [&](std::size_t n) {
          return SignStreams{streams[n].signs, streams[n].leaves, models.slices[n].signs, NothingMoved{}};
        };
        ISOREEL_TRY(tree.codeLevel(level, of, parallel));
      }
      for (const SliceStreams& slice : streams) {
        if (!slice.signs.finished()) return leftOver("corner signs", level);
        if (!slice.leaves.finished()) return leftOver("leaf bits", level);
      }
      if (level == wanted && level < depth) {
        ISOREEL_TRY(room(coarseBytes(tree.cells().size())));
        coarse = surfaceFromSigns(tree.cells(), grid, depth - level, sheets);
      }
    }
    if (predicted && motion_bytes && level == part.blockLevel()) {
      ISOREEL_TRY(room(PredictedPart::bytesFor(tree.cells().size())));
      ISOREEL_TRY(part.decodeMotion(tree.cells(), models, with.profile));
    }
  }
  if (coarse && !goes_on) return *std::move(coarse);
  const auto vertex_bytes = payload.section(SectionKind::kVertices, 0);
  if (!motion_bytes || !vertex_bytes) {
    ISOREEL_TRY(room(coarseBytes(tree.cells().size())));
    return surfaceFromSigns(tree.takeCells(), grid, 0, sheets);
  }
  // Deepest cells are active; they have a vertex each, or one for each of their sheets.
  const auto differs = [&](std::size_t vertices) { return counts("vertices", vertices, header.vertices); };
  const std::size_t found = tree.cells().size();
  if (sheets ? found > header.vertices : found != header.vertices) return differs(found);
  if (header.faces > 3 * found) return counts("quads", quadCount(tree.cells()), header.faces);
  slices = sliceCount(header.vertices, with.slices);
  const std::size_t bricks = tree.bricks();
  std::vector<Cell> active = tree.takeCells();
  tree_memory = tree.takeMemory();
  ISOREEL_TRY(room(fullBytes(header, bricks, with) + bytesOf(active)));
  index.build(active, bricks);
  if (sheets) active = splitSheets(std::move(active), index, header.vertices);
  if (active.size() != header.vertices) return differs(active.size());
  const ResidualSteps steps{static_cast<std::int32_t>(header.step),
                            static_cast<std::int32_t>(header.tangential_step)};
  Surface surface;
  surface.grid = grid;
  surface.vertices.resize(active.size());
  HeightSlices height_slices(active, steps.normal, with.tools, heights, models);
  if (with.profile == Profile::kMain) {
    heights.build(active, index, grid, with.slices, parallel);
    if (predicted) part.moveHeights(active, field, heights, parallel);
    ISOREEL_TRY(height_slices.open(*vertex_bytes));
  }
  Status vertices;
  parallel(slices + 1, [&](std::size_t task) {  // beside the vertices, what connects them
    if (task == slices) {
      surface.quads = dualQuads(active, index, std::size_t{header.faces} + 1);
    } else if (with.profile == Profile::kMain) {
      height_slices.decode(task, surface.vertices);
    } else if (predicted) {
      vertices = part.decodeVertices(*vertex_bytes, active, index, field, steps, models, surface.vertices);
    } else {
      vertices = decodeIntraVertices(*vertex_bytes, active, steps, models.vertices, surface.vertices);
    }
  });
  ISOREEL_TRY(vertices);
  ISOREEL_TRY(height_slices.status());
  if (predicted && options.motion != nullptr) *options.motion = part.blocks(active, field);
  toGridPositions(active, surface.vertices);
  if (surface.quads.size() != header.faces) return counts("quads", quadCount(active), header.faces);
  const bool leads_on = (with.tools & kToolPrediction) != 0;
  std::uint64_t hash = 0;
  parallel(leads_on ? 2 : 1, [&](std::size_t task) {
    if (task == 0) {
      hash = surfaceHash(surface);
    } else {
      reference.setPlanes(surface, active, parallel);
    }
  });
  if (hash != header.surface_hash)
    return {ErrorCode::kBadData, "packet: the decoded surface does not match its hash (spec codec 7)"};
  if (leads_on) {
    last = header.number;
    configuration = with;
  }
  cells = std::move(active);
  return coarse ? *std::move(coarse) : std::move(surface);
}

}  // namespace isoreel
