// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/inspect/attribute.h>

#include "src/canvas.h"

namespace isoreel::inspect {

/// A bar with its range and label below, on the paper from (0, 0) to (width, height).
void paintColourBar(Canvas& canvas, const ColourScale& scale, double width, double height);

}  // namespace isoreel::inspect
