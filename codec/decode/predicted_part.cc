// SPDX-License-Identifier: BSD-3-Clause
#include "decode/predicted_part.h"

namespace isoreel {

Status endOf(const RangeGet& coder, const char* what) {
  if (coder.finished()) return {};
  return {ErrorCode::kBadData, std::string(what) + ": " +
                                   (coder.overrun() ? "end too early" : "not used to their end") +
                                   " (spec codec 6.2)"};
}

Status PredictedPart::open(ByteSpan section, std::uint32_t depth, Profile profile) {
  ByteReader in(section);
  if (profile == Profile::kMain) {
    ISOREEL_TRY(readSized(in, static_cast<MotionHeader&>(header_)));
  } else {
    ISOREEL_TRY(readSized(in, header_));
  }
  vectors_ = section.subspan(in.position());
  block_level_ = isoreel::blockLevel(depth, header_.block_log2);
  return {};
}

Status PredictedPart::decodeMotion(std::span<const Cell> blocks, PacketModels& models, Profile profile) {
  const bool main = profile == Profile::kMain;
  motion_.build(blocks, header_.block_log2, header_.vector_step);
  RangeGet coder(vectors_);
  ISOREEL_TRY(motion_.code(coder, models.motion, main ? &models.blocks : nullptr));
  if (main) models.blocks = motion_;
  return endOf(coder, "motion vectors");
}

Status PredictedPart::decodeVertices(ByteSpan bytes, std::span<const Cell> cells, const CellIndex& index,
                                     const ReferenceField& field, const ResidualSteps& steps,
                                     PacketModels& models,
                                     std::vector<std::array<std::int32_t, 3>>& vertices) {
  motion_.assign(cells);
  MovedPlanes planes(field, motion_, cells);
  RangeGet coder(bytes);
  NoChoice none;
  codePredictedVertices(coder, models.vertices, models.predicted, header_, cells, index, steps, planes, none,
                        vertices);
  return endOf(coder, "vertices");
}

std::vector<MotionBlock> PredictedPart::blocks(std::span<const Cell> cells,
                                               const ReferenceField& field) const {
  const std::int32_t side = std::int32_t{1} << motion_.blockLog2();
  MovedPlanes planes(field, motion_, cells);
  std::vector<MotionBlock> result;
  result.reserve(motion_.blocks().size());
  for (const Block& block : motion_.blocks()) {
    MotionBlock out;
    out.cell = {block.x * side, block.y * side, block.z * side};
    out.side = side;
    out.first = block.first;
    out.vertices = block.count;
    out.moves = block.moves;
    for (std::uint32_t i = block.first; i < block.first + block.count; ++i) out.predicted += planes(i).known;
    if (block.moves) out.vector = motion_.motionOf(block);
    result.push_back(out);
  }
  return result;
}

}  // namespace isoreel
