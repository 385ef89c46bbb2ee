// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "intra/height_stream.h"

namespace isoreel {

/// The weights with which the prediction of frame.heights, as they stand, errs least: least squares, in which
/// large errors count for less. (Weights fitted to quantised neighbours were no better.) Those of `before`
/// stay where a change would cost more than it saves. `step`: in cells. Looks at one
/// vertex of `every`.
HeightWeights fitHeights(const HeightFrame& frame, std::uint32_t tools, double step, std::size_t every,
                         const HeightWeights& before, const ParallelFor& parallel);

}  // namespace isoreel
