// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "inter/prediction.h"

namespace isoreel {

/// Fills the weights and the levels of `header` from what the frame is: weights by least squares over the
/// vertices of each confidence, levels as the centroids of their quantiser cells (Lloyd's condition; paper,
/// section 4.4). `vertices`: the extractor's, in their cells; `wanted`: their components along the axes of
/// their local frames. All in 1/16384 of a cell.
void fitPrediction(std::span<const Cell> cells, const CellIndex& index, const std::vector<MovedPlane>& planes,
                   std::span<const std::array<std::int32_t, 3>> vertices,
                   std::span<const std::array<double, 3>> wanted, std::int32_t step,
                   PredictionHeader& header);

}  // namespace isoreel
