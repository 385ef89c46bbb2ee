// SPDX-License-Identifier: BSD-3-Clause
#include "lattice/cell_index.h"

#include <bit>

#include "lattice/brick_halo.h"

namespace isoreel {
namespace {

// Bits by x + 4y + 16z to bits by Morton code: of a bit's number, x1 y0 y1 z0 become y0 z0 x1 y1, by three
// exchanges of two of them.
constexpr std::uint64_t inMortonOrder(std::uint64_t rows) {
  const auto exchange = [&](int up, std::uint64_t which) {
    const std::uint64_t change = (rows >> up ^ rows) & which;
    rows ^= change | change << up;
  };
  exchange(2, 0x0C0C0C0C0C0C0C0C);
  exchange(12, 0x0000F0F00000F0F0);
  exchange(8, 0x0000FF000000FF00);
  return rows;
}

}  // namespace

// The bricks of `count` cells or bricks.
template <class Cells>
void CellIndex::group(const Cells& cells, std::size_t count, std::vector<Brick>& bricks) {
  bricks.clear();
  for (std::size_t i = 0; i < count;) {
    Brick brick;
    brick.first = static_cast<std::uint32_t>(i);
    brick.x = cells[i].x >> 2;
    brick.y = cells[i].y >> 2;
    brick.z = cells[i].z >> 2;
    for (; i < count; ++i) {
      const std::int32_t x = cells[i].x - 4 * brick.x, y = cells[i].y - 4 * brick.y,
                         z = cells[i].z - 4 * brick.z;
      if (static_cast<std::uint32_t>(x | y | z) > 3) break;
      brick.rows |= std::uint64_t{1} << (x + 4 * y + 16 * z);
    }
    brick.mask = inMortonOrder(brick.rows);
    brick.count = static_cast<std::uint32_t>(i) - brick.first;
    bricks.push_back(brick);
  }
}

void CellIndex::build(std::span<const Cell> cells) {
  group(cells, cells.size(), bricks_);
  group(bricks_, bricks_.size(), blocks_);
  map_.clear();
  for (const Brick& block : blocks_) map_.findOrAdd(block.x, block.y, block.z);
  around_.resize(bricks_.size());
  bricks_.emplace_back();
  connect();
}

void CellIndex::connect() {
  std::array<std::uint32_t, BrickHalo::kSlots> numbers;
  for (const Brick& block : blocks_) {
    numbers.fill(static_cast<std::uint32_t>(around_.size()));
    for (std::int32_t n = 0; n < 27; ++n) {
      const std::int32_t dx = n % 3 - 1, dy = n / 3 % 3 - 1, dz = n / 9 - 1;
      const std::uint32_t found = n == 13 ? static_cast<std::uint32_t>(&block - blocks_.data())
                                          : map_.find(block.x + dx, block.y + dy, block.z + dz);
      if (found == kNone) continue;
      const Brick& other = blocks_[found];
      for (std::uint32_t i = other.first; i < other.first + other.count; ++i) {
        const std::int32_t x = bricks_[i].x - 4 * block.x, y = bricks_[i].y - 4 * block.y,
                           z = bricks_[i].z - 4 * block.z;
        if (x >= -1 && x <= 4 && y >= -1 && y <= 4 && z >= -1 && z <= 4) numbers[BrickHalo::slot(x, y, z)] = i;
      }
    }
    for (std::uint32_t i = block.first; i < block.first + block.count; ++i) {
      const std::uint32_t* from = &numbers[BrickHalo::slot(bricks_[i].x & 3, bricks_[i].y & 3, bricks_[i].z & 3) -
                                           BrickHalo::slot(0, 0, 0)];
      std::uint32_t* to = around_[i].data();
      for (std::size_t z = 0; z < 3; ++z) {
        for (std::size_t y = 0; y < 3; ++y) {
          for (std::size_t x = 0; x < 3; ++x) *to++ = from[x + 6 * y + 36 * z];
        }
      }
    }
  }
}

}  // namespace isoreel
