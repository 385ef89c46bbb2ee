// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/codec/surface.h>

#include <span>

#include "lattice/cell_index.h"

namespace isoreel {

/// How many quads dualQuads() makes.
std::size_t quadCount(std::span<const Cell> cells);

/// The quads of the dual mesh (spec codec 5.3), one for each sign-changing edge that has its four cells, in
/// the order of the cells whose corner 0 they start from, then of the axes x, y, z. Corners are places in
/// `cells`, counter-clockwise seen from outside. `cells` are the active cells of one level in Morton order,
/// or their sheets (5.5), and `index` is theirs. Takes room for `most` quads, and gives at most so many.
std::vector<Quad> dualQuads(std::span<const Cell> cells, const CellIndex& index, std::size_t most);
inline std::vector<Quad> dualQuads(std::span<const Cell> cells, const CellIndex& index) {
  return dualQuads(cells, index, quadCount(cells));
}

/// Turns positions inside cells (from their corner 0) into positions in the grid, in place.
inline void toGridPositions(std::span<const Cell> cells, std::span<GridPosition> positions) {
  for (std::size_t i = 0; i < cells.size(); ++i) {
    positions[i][0] += cells[i].x * kCell;
    positions[i][1] += cells[i].y * kCell;
    positions[i][2] += cells[i].z * kCell;
  }
}

}  // namespace isoreel
