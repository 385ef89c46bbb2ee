// SPDX-License-Identifier: BSD-3-Clause
#include "wild.h"

#include <gtest/gtest.h>

#include "extract/dual_contouring.h"
#include "lattice/dual_mesh.h"
#include "packets.h"

namespace isoreel::made {
namespace {

/// What the encoder's stages make of a volume.
struct Extracted {
  SignBitmap bitmap;
  std::vector<Cell> cells;
  CellIndex index;
  std::vector<std::array<std::int32_t, 3>> vertices;

  explicit Extracted(const Made& made)
      : bitmap(*SignBitmap::make(made.volume, made.isovalue, made.inside, NonFinite::kRefuse, serialFor)),
        cells(bitmap.activeCells(serialFor)),
        vertices(placeVertices(made.volume, made.isovalue, cells, VertexPlacement::kQef, serialFor)) {
    index.build(cells);
  }
  FrameInput input(const Grid& grid, const ResidualSteps& steps) const {
    return {grid, bitmap, cells, index, vertices, steps};
  }
};

/// Leaves only the sections of signs.
void keepSigns(CodedFrame& coded) {
  std::size_t bytes = 0, count = 0;
  for (const Section& s : coded.sections) {
    if (s.kind > static_cast<std::uint32_t>(SectionKind::kLeaves)) break;
    bytes += s.bytes;
    ++count;
  }
  coded.sections.resize(count);
  coded.payload.resize(bytes);
}

}  // namespace

PredictionHeader wildHeader(Random& random, std::uint32_t block_log2, std::uint32_t vector_step) {
  PredictionHeader header;
  header.block_log2 = block_log2;
  header.vector_step = vector_step;
  for (auto& weights : header.weights) {
    for (auto& w : weights) w = static_cast<std::uint8_t>(random() % 129);
  }
  for (auto& level : header.levels) level = static_cast<std::uint8_t>(1 + random() % 255);
  return header;
}

Bytes wildHeights(const Made& made, std::uint32_t step, std::int32_t largest, std::uint32_t seed) {
  Random random(seed);
  const auto within = [&](std::int32_t limit) {
    return static_cast<std::int32_t>(random() % (2 * static_cast<std::uint32_t>(limit) + 1)) - limit;
  };
  Extracted extracted(made);
  const Bytes packet = encodedMain(made, step).data;
  Parts parts = taken(packet);
  parts.header.step = step;
  HeightHeader header;
  for (auto& colour : header.weights) {
    for (auto& w : colour) w = within(HeightHeader::kMaxWeight);
  }
  HeightFrame frame;
  frame.build(extracted.cells, extracted.index, made.volume.grid);
  HeightModels models;
  Bytes section;
  EXPECT_TRUE(writeSized(section, header).ok());
  RangePut coder(section);
  codeHeights(coder, models, header, extracted.cells, frame, static_cast<std::int32_t>(step), kToolsOfMain,
              [&](std::uint32_t, std::int32_t, const HeightContext&) {
                return within(random() % 2 == 0 ? 2 : largest);
              });
  coder.finish();
  parts.sections.back() = section;
  Surface surface;
  surface.grid = made.volume.grid;
  for (std::size_t i = 0; i < extracted.cells.size(); ++i)
    surface.vertices.push_back(atHeight(frame.predicted, i, frame.heights[i]));
  toGridPositions(extracted.cells, surface.vertices);
  surface.quads = dualQuads(extracted.cells, extracted.index);
  parts.header.surface_hash = surfaceHash(surface);
  return joined(parts);
}

Bytes WildSequence::intra(const Made& made, std::uint32_t step) {
  Extracted frame(made);
  PacketHeader header;
  header.step = header.tangential_step = step;
  Configuration configuration = settings(made, step).configuration;
  configuration.tools = kToolPrediction;
  header.configuration = *writeConfiguration(configuration);
  const auto signed_step = static_cast<std::int32_t>(step);
  return packet(made, frame.cells, frame.index, header,
                *codeIntra(frame.input(made.volume.grid, {signed_step, signed_step})));
}

Bytes WildSequence::predicted(const Made& made, const Wild& wild) {
  Extracted frame(made);
  PacketHeader header;
  header.type = PacketType::kPredicted;
  header.references = {1};
  header.step = wild.step;
  header.tangential_step = wild.tangential_step;
  const ResidualSteps steps{static_cast<std::int32_t>(wild.step),
                            static_cast<std::int32_t>(wild.tangential_step)};
  // The signs, and the models as the signs leave them, are the encoder's.
  CodedFrame coded = *codePredicted(frame.input(made.volume.grid, steps), reference_, {}, models_);
  keepSigns(coded);
  const SignTreeModels signs = coded.models.signs;
  coded.models = models_;
  coded.models.signs = signs;

  MotionField motion;
  motion.build(frame.cells, wild.header.block_log2, wild.header.vector_step);
  for (Block& block : motion.blocks()) {
    block.moves = random_() % wild.still != 0;
    if (!block.moves) continue;
    for (std::int32_t& v : block.vector)
      v = within(wild.farthest / static_cast<std::int32_t>(wild.header.vector_step));
  }
  Bytes head;
  EXPECT_TRUE(writeSized(head, wild.header).ok());
  addSection(coded, SectionKind::kMotion, head,
             [&](RangePut& coder) { EXPECT_TRUE(motion.code(coder, coded.models.motion).ok()); });

  std::vector<Residual> residuals(frame.cells.size());
  for (Residual& residual : residuals) residual = {0, within(wild.largest), within(wild.largest)};
  const auto predictions = predictVertices(reference_, motion, frame.cells, residuals, steps);
  for (const SurfacePrediction& p : predictions)
    confidences_[p.confidence] += p.offset != SurfacePrediction::kNone;
  coded.decoded.resize(frame.cells.size());
  addSection(coded, SectionKind::kVertices, {}, [&](RangePut& coder) {
    codeTangents(coder, coded.models.vertices, frame.cells, residuals);
    codeNormals(
        coder, coded.models, wild.header, frame.cells, frame.index, residuals, predictions, steps,
        [&](std::uint32_t, std::int32_t) { return within(wild.largest); }, coded.decoded);
  });
  return packet(made, frame.cells, frame.index, header, std::move(coded));
}

Bytes WildSequence::packet(const Made& made, std::span<const Cell> cells, CellIndex& index,
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
  reference_.build(surface, cells, index);
  models_ = std::move(coded.models);
  auto result = writePacket(std::move(header), coded.payload);
  EXPECT_TRUE(result.ok()) << result.status().message();
  return *std::move(result);
}

}  // namespace isoreel::made
