// SPDX-License-Identifier: BSD-3-Clause
#include "inter/vertex_stream.h"

namespace isoreel {

std::vector<SurfacePrediction> predictVertices(const Reference& reference, const MotionField& motion,
                                               std::span<const Cell> cells,
                                               const std::vector<Residual>& residuals,
                                               const ResidualSteps& steps) {
  std::vector<SurfacePrediction> predictions(cells.size());
  Neighbours neighbours(reference.index());
  for (const Block& block : motion.blocks()) {
    if (!block.moves) continue;
    const MotionField::Interpolation vectors(motion, block);
    for (std::uint32_t i = block.first; i < block.first + block.count; ++i) {
      const auto in_cell = reconstruct(kLocalFrames[cells[i].corners], tangentOffsets(residuals[i], steps));
      predictions[i] = predictFromSurface(reference, neighbours, cells[i], in_cell, vectors.at(cells[i]));
    }
  }
  return predictions;
}

}  // namespace isoreel
