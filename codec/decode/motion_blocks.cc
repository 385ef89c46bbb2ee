// SPDX-License-Identifier: BSD-3-Clause
#include "decode/motion_blocks.h"

namespace isoreel {

std::vector<MotionBlock> motionBlocks(const MotionField& motion, const PredictionHeader& header,
                                      std::span<const SurfacePrediction> predictions) {
  const std::int32_t side = std::int32_t{1} << header.block_log2;
  const auto step = static_cast<std::int32_t>(header.vector_step);
  std::vector<MotionBlock> result;
  result.reserve(motion.blocks().size());
  for (const Block& block : motion.blocks()) {
    MotionBlock out;
    out.cell = {block.x * side, block.y * side, block.z * side};
    out.side = side;
    out.first = block.first;
    out.vertices = block.count;
    out.moves = block.moves;
    for (const SurfacePrediction& prediction : predictions.subspan(block.first, block.count))
      out.predicted += prediction.offset != SurfacePrediction::kNone;
    for (std::size_t k = 0; k < 3 && block.moves; ++k) out.vector[k] = block.vector[k] * step;
    result.push_back(out);
  }
  return result;
}

}  // namespace isoreel
