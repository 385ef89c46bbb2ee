// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/codec/motion_block.h>

#include "inter/prediction.h"

namespace isoreel {

/// The blocks of a decoded P frame, in their order; `predictions` are those of its vertices.
std::vector<MotionBlock> motionBlocks(const MotionField& motion, const PredictionHeader& header,
                                      std::span<const SurfacePrediction> predictions);

}  // namespace isoreel
