// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include "src/view.h"

namespace isoreel::inspect {

/// Whether the viewer sees a place in the stage, if what lies nearer to it than `slack` does not count.
using Sees = std::function<bool(const Vec3d& place, double slack)>;

/// For each block of which a part is seen: an arrow from there to where it goes, fainter where the surface
/// hides it, a dot where it stands still, or an I block's visible patch; then the legend. Without blocks the
/// caption alone.
void drawMotion(const Surface& surface, const MotionOverlay& overlay, const View& view, const Sees& sees,
                Image& image);

}  // namespace isoreel::inspect
