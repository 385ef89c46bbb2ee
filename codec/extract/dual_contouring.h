// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/codec/encoder.h>

#include <span>

#include "lattice/cell_index.h"

namespace isoreel {

/// The vertex of each active cell by dual contouring (Ju, Losasso, Schaefer, Warren 2002): positions 0 to
/// 16384 from the cell's corner 0. Crossings by linear interpolation along edges; half-way where a sample is
/// not finite.
std::vector<GridPosition> placeVertices(const Volume& volume, double isovalue, std::span<const Cell> cells,
                                        VertexPlacement placement, const ParallelFor& parallel);

}  // namespace isoreel
