// SPDX-License-Identifier: BSD-3-Clause
#include "lattice/cell_index.h"

namespace isoreel {

std::size_t CellIndex::brickCount(std::span<const Cell> cells) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const Cell &cell = cells[i], &before = cells[i == 0 ? 0 : i - 1];
    count += i == 0 || ((cell.x ^ before.x) | (cell.y ^ before.y) | (cell.z ^ before.z)) >> 2 != 0;
  }
  return count;
}

void CellIndex::build(std::span<const Cell> cells, std::size_t bricks) {
  map_.clear(bricks);
  clearFor(bricks_, bricks);
  for (std::uint32_t i = 0; i < cells.size();) {
    const std::int32_t x = cells[i].x >> 2, y = cells[i].y >> 2, z = cells[i].z >> 2;
    Brick brick{0, 0, i, 0, x, y, z};
    for (; i < cells.size(); ++i) {
      const Cell& cell = cells[i];
      if (((cell.x >> 2 ^ x) | (cell.y >> 2 ^ y) | (cell.z >> 2 ^ z)) != 0) break;
      brick.mask |= bit(cell.x, cell.y, cell.z);
      brick.rows |= std::uint64_t{1} << ((cell.x & 3) | (cell.y & 3) << 2 | (cell.z & 3) << 4);
    }
    brick.count = i - brick.first;
    map_.findOrAdd(x, y, z);
    bricks_.push_back(brick);
  }
}

}  // namespace isoreel
