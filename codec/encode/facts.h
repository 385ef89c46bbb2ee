// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/base/packet.h>
#include <isoreel/codec/surface.h>

#include <span>

#include "lattice/cell_index.h"

namespace isoreel {

/// Fills counts, box, area, components, Euler characteristic and hash of a frame header from its decoded
/// surface (spec container 4.1). `cells` are those of the vertices, or their sheets; `inside_cells` as
/// SignBitmap::insideCells().
void measureSurface(const Surface& surface, std::span<const Cell> cells, double inside_cells,
                    FrameHeader& header);

}  // namespace isoreel
