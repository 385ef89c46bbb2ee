// SPDX-License-Identifier: BSD-3-Clause
#include "lattice/cell_index.h"

namespace isoreel {

void CellIndex::build(std::span<const Cell> cells) {
  map_.clear();
  bricks_.clear();
  for (std::uint32_t i = 0; i < cells.size(); ++i) {
    const Cell& cell = cells[i];
    const std::int32_t x = cell.x >> 2, y = cell.y >> 2, z = cell.z >> 2;
    if (bricks_.empty() || bricks_.back().x != x || bricks_.back().y != y || bricks_.back().z != z) {
      map_.findOrAdd(x, y, z);
      bricks_.push_back({0, 0, i, 0, x, y, z});
    }
    Brick& brick = bricks_.back();
    brick.mask |= bit(cell.x, cell.y, cell.z);
    brick.rows |= std::uint64_t{1} << ((cell.x & 3) | (cell.y & 3) << 2 | (cell.z & 3) << 4);
    ++brick.count;
  }
}

}  // namespace isoreel
