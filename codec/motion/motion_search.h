// SPDX-License-Identifier: BSD-3-Clause
// Block motion (paper, sections 4.1 and 4.2 and appendix A). Encoder only; floating point.
#pragma once

#include <isoreel/base/parallel.h>
#include <isoreel/codec/encoder.h>

#include "inter/motion_field.h"
#include "inter/reference.h"

namespace isoreel {

/// Finds a vector for every block of `motion`: coarse search over the distance field, registration against
/// the reference's own field, then the choice between that, the neighbours' vector
/// and standing still by what each leaves and costs. `points`: the current vertices in cells, block by block
/// in the order of the field's cells. `before`: in profile main, the blocks of the packet before, else null.
void searchMotion(const Reference& reference, std::span<const std::array<float, 3>> points,
                  const MotionSettings& settings, std::uint32_t vector_step, const MotionField* before,
                  MotionField& motion, const ParallelFor& parallel = serialFor);

}  // namespace isoreel
