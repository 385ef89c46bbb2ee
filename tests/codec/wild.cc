// SPDX-License-Identifier: BSD-3-Clause
#include "wild.h"

#include <gtest/gtest.h>

#include "encode/height_coder.h"
#include "extract/dual_contouring.h"
#include "extract/octree.h"
#include "intra/sign_tree.h"
#include "lattice/dual_mesh.h"
#include "lattice/sheets.h"
#include "packets.h"

namespace isoreel::made {
namespace {

// Those of profile main that a wild packet has.
constexpr std::uint32_t kTools = kToolsOfMain & ~kToolSlices;

/// What the encoder's stages make of a volume.
struct Extracted {
  SignBitmap bitmap;
  std::vector<Cell> active;
  CellIndex index;
  std::vector<Cell> cells;  // of the vertices: the active ones, in profile main their sheets
  std::vector<std::array<std::int32_t, 3>> vertices;

  Extracted(const Made& made, bool main)
      : bitmap(*SignBitmap::make(made.volume, made.isovalue, made.inside, NonFinite::kRefuse, serialFor)),
        active(bitmap.activeCells(serialFor)) {
    index.build(active);
    cells = main ? splitSheets(active, index) : active;
    vertices = placeVertices(made.volume, made.isovalue, cells, VertexPlacement::kQef, serialFor);
  }
  FrameInput input(const Grid& grid, const ResidualSteps& steps) const {
    return {grid, bitmap, active, cells, index, vertices, steps};
  }
};

/// The octree of signs, written level by level as the encoder does.
class Signs {
 public:
  Signs(const Extracted& frame, const Grid& grid, CodedFrame& coded)
      : octree_(frame.active, octreeDepth(grid)),
        tree_(grid, OctreeTruth(frame.bitmap, octree_), frame.active.size()),
        coded_(coded) {}

  const std::vector<Cell>& cells() const { return tree_.cells(); }
  template <class MovedOf>
  void write(std::uint32_t level, const MovedOf& movedOf) {
    if (level > 0 && tree_.cells().empty()) return;
    Bytes leaf_bytes;
    RangePut leaves(leaf_bytes);
    addSection(coded_, SectionKind::kSigns, level, {}, [&](RangePut& signs) {
      SliceModels& models = coded_.models.slices[0];
      const auto streams = [&](std::size_t) {
        return SignStreams{signs, leaves, models.signs, movedOf(models)};
      };
      EXPECT_TRUE((level == 0 ? tree_.codeRoot(signs, leaves) : tree_.codeLevel(level, streams)).ok());
    });
    leaves.finish();
    addSection(coded_, SectionKind::kLeaves, level, leaf_bytes, [](RangePut&) {});
  }

 private:
  SparseOctree octree_;
  SignTree<RangePut, OctreeTruth> tree_;
  CodedFrame& coded_;
};

}  // namespace

PredictionHeader wildHeader(Random& random, std::uint32_t block_log2, std::uint32_t vector_step) {
  PredictionHeader header;
  header.block_log2 = block_log2;
  header.vector_step = vector_step;
  for (auto& weights : header.weights) {
    for (auto* w : {&weights.tangential, &weights.normal, &weights.error, &weights.height})
      *w = static_cast<std::uint8_t>(random() % 129);
  }
  for (auto& level : header.levels) level = static_cast<std::uint8_t>(1 + random() % 255);
  return header;
}

Bytes wildHeights(const Made& made, std::uint32_t step, std::int32_t largest, std::uint32_t seed) {
  Random random(seed);
  const auto within = [&](std::int32_t limit) {
    return static_cast<std::int32_t>(random() % (2 * static_cast<std::uint32_t>(limit) + 1)) - limit;
  };
  Extracted extracted(made, true);
  const Bytes packet = encodedMain(made, step).data;
  Parts parts = taken(packet);
  parts.header.step = step;
  HeightWeights weights;
  for (auto& colour : weights.plain) {
    for (auto& w : colour) w = within(HeightWeights::kMax);
  }
  HeightFrame frame;
  frame.build(extracted.cells, extracted.index, made.volume.grid);
  HeightModels models;
  Bytes section;
  RangePut coder(section);
  models.codeWeights(coder, weights, false);
  codeHeights(coder, models, models.weights, frame.around.runs, extracted.cells, frame,
              static_cast<std::int32_t>(step), kTools,
              [&](std::uint32_t, std::int32_t, const HeightContext&) {
                return within(random() % 2 == 0 ? 2 : largest);
              });
  coder.finish();
  parts.sections.back() = section;
  Surface surface;
  surface.grid = made.volume.grid;
  for (std::size_t i = 0; i < extracted.cells.size(); ++i)
    surface.vertices.push_back(
        atHeight(frame.predicted.points[i], frame.predicted.normals[i], frame.heights[i]));
  toGridPositions(extracted.cells, surface.vertices);
  surface.quads = dualQuads(extracted.cells, extracted.index);
  parts.header.surface_hash = surfaceHash(surface);
  return joined(parts);
}

Bytes WildSequence::intra(const Made& made, std::uint32_t step) {
  Extracted frame(made, main_);
  PacketHeader header;
  header.step = header.tangential_step = step;
  Configuration configuration = settings(made, step).configuration;
  configuration.tools = kToolPrediction;
  if (main_) {
    configuration.profile = Profile::kMain;
    configuration.tools = kTools;
  }
  header.configuration = *writeConfiguration(configuration);
  const auto signed_step = static_cast<std::int32_t>(step);
  const FrameInput input = frame.input(made.volume.grid, {signed_step, signed_step});
  HeightFrame heights;
  return packet(
      made, frame.cells, frame.index, header,
      main_ ? *HeightCoder(input, nullptr, kTools, {}, serialFor, heights).codeIntra() : *codeIntra(input));
}

Bytes WildSequence::predicted(const Made& made, const Wild& wild) {
  Extracted frame(made, main_);
  PacketHeader header;
  header.type = PacketType::kPredicted;
  header.references = {1};
  header.step = wild.step;
  header.tangential_step = wild.tangential_step;
  const ResidualSteps steps{static_cast<std::int32_t>(wild.step),
                            static_cast<std::int32_t>(wild.tangential_step)};
  CodedFrame coded;
  coded.models = models_;
  const std::uint32_t depth = octreeDepth(made.volume.grid),
                      block_level = blockLevel(depth, wild.header.block_log2);
  Signs signs(frame, made.volume.grid, coded);
  for (std::uint32_t level = 0; level <= block_level; ++level)
    signs.write(level, [](SliceModels&) { return NothingMoved{}; });

  MotionField motion;
  motion.build(signs.cells(), wild.header.block_log2, wild.header.vector_step);
  motion.assign(frame.cells);
  for (Block& block : motion.blocks()) {
    block.moves = random_() % wild.still != 0;
    if (!block.moves) continue;
    for (std::int32_t& v : block.vector)
      v = within(wild.farthest / static_cast<std::int32_t>(wild.header.vector_step));
  }
  Bytes head;
  EXPECT_TRUE((main_ ? writeSized(head, static_cast<const MotionHeader&>(wild.header))
                     : writeSized(head, wild.header))
                  .ok());
  addSection(coded, SectionKind::kMotion, 0, head, [&](RangePut& coder) {
    EXPECT_TRUE(motion.code(coder, coded.models.motion, main_ ? &coded.models.blocks : nullptr).ok());
  });
  if (main_) coded.models.blocks = motion;

  for (std::uint32_t level = block_level + 1; level <= depth; ++level) {
    signs.write(level, [&](SliceModels& models) {
      return MovedSigns(reference_.field(), motion, models.moved_signs, depth - level);
    });
  }

  if (main_) {
    heights(made, frame.cells, frame.index, motion, wild, coded);
    return packet(made, frame.cells, frame.index, header, std::move(coded));
  }
  MovedPlanes moved_planes(reference_.field(), motion, frame.cells);
  const auto planes = [&](std::uint32_t i) {
    const MovedPlane plane = moved_planes(i);
    confidences_[plane.confidence] += plane.known;
    return plane;
  };
  struct Choice {
    WildSequence& sequence;
    std::int32_t largest;
    std::int32_t residual(std::uint32_t, std::size_t, std::int32_t) { return sequence.within(largest); }
  } choice{*this, wild.largest};
  coded.decoded.resize(frame.cells.size());
  addSection(coded, SectionKind::kVertices, 0, {}, [&](RangePut& coder) {
    codePredictedVertices(coder, coded.models.vertices, coded.models.predicted, wild.header, frame.cells,
                          frame.index, steps, planes, choice, coded.decoded);
  });
  return packet(made, frame.cells, frame.index, header, std::move(coded));
}

HeightWeights WildSequence::weights() {
  HeightWeights result;
  for (std::size_t colour = 0; colour < 2; ++colour) {
    for (auto& w : result.plain[colour]) w = within(HeightWeights::kMax);
    for (auto& kind : result.moved[colour]) {
      for (auto& w : kind) w = within(HeightWeights::kMax);
    }
  }
  return result;
}

void WildSequence::heights(const Made& made, std::span<const Cell> cells, const CellIndex& index,
                           const MotionField& motion, const Wild& wild, CodedFrame& coded) {
  HeightFrame frame;
  frame.build(cells, index, made.volume.grid);
  moveHeights(reference_.field(), motion, cells, frame);
  for (const MovedHeight& height : frame.moved) {
    if (height.confidence != MovedHeight::kNone) ++confidences_[height.confidence];
  }
  addSection(coded, SectionKind::kVertices, 0, {}, [&](RangePut& coder) {
    HeightModels& models = coded.models.slices[0].heights;
    models.codeWeights(coder, weights(), true);
    codeHeights(coder, models, models.weights, frame.around.runs, cells, frame,
                static_cast<std::int32_t>(wild.step), kTools,
                [&](std::uint32_t, std::int32_t, const HeightContext&) { return within(wild.largest); });
  });
  for (std::size_t i = 0; i < cells.size(); ++i)
    coded.decoded.push_back(
        atHeight(frame.predicted.points[i], frame.predicted.normals[i], frame.heights[i]));
}

Bytes WildSequence::packet(const Made& made, std::span<const Cell> cells, const CellIndex& index,
                           PacketHeader header, CodedFrame coded) {
  Surface surface;
  surface.grid = made.volume.grid;
  toGridPositions(cells, coded.decoded);
  surface.vertices = std::move(coded.decoded);
  surface.quads = dualQuads(cells, index);
  header.number = number_++;
  header.isovalue = made.isovalue;
  header.vertices = static_cast<std::uint32_t>(surface.vertices.size());
  header.faces = static_cast<std::uint32_t>(surface.quads.size());
  header.surface_hash = surfaceHash(surface);
  header.sections = coded.sections;
  reference_.build(surface, cells);
  models_ = std::move(coded.models);
  auto result = writePacket(std::move(header), coded.payload);
  EXPECT_TRUE(result.ok()) << result.status().message();
  return *std::move(result);
}

}  // namespace isoreel::made
