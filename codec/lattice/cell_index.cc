// SPDX-License-Identifier: BSD-3-Clause
#include "lattice/cell_index.h"

#include <algorithm>

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

// The bricks of `count` cells or bricks, at most `most`, and an empty one.
template <class Cells>
void CellIndex::group(const Cells& cells, std::size_t count, std::vector<Brick>& bricks,
                      std::vector<BrickHalo::Own>& owns, std::size_t most) {
  clearFor(bricks, most + 1);
  clearFor(owns, most + 1);
  for (std::size_t i = 0; i < count;) {
    Brick brick;
    brick.first = static_cast<std::uint32_t>(i);
    brick.x = cells[i].x >> 2;
    brick.y = cells[i].y >> 2;
    brick.z = cells[i].z >> 2;
    BrickHalo::Own& own = owns.emplace_back(BrickHalo::kEmpty);
    own.first = brick.first;
    for (std::int16_t rank = 0; i < count; ++i, ++rank) {
      const std::int32_t x = cells[i].x - 4 * brick.x, y = cells[i].y - 4 * brick.y,
                         z = cells[i].z - 4 * brick.z;
      if (static_cast<std::uint32_t>(x | y | z) > 3) break;
      const auto row = static_cast<std::size_t>(x + 4 * y + 16 * z);
      brick.rows |= std::uint64_t{1} << row;
      own.ranks[row] = own.ranks[row] < 0 ? rank : own.ranks[row];  // the first of several
    }
    brick.mask = inMortonOrder(brick.rows);
    brick.count = static_cast<std::uint32_t>(i) - brick.first;
    brick.repeats = brick.count > countBits(brick.rows);
    bricks.push_back(brick);
  }
  bricks.emplace_back();
  owns.push_back(BrickHalo::kEmpty);
}

void CellIndex::build(std::span<const Cell> cells, std::size_t bricks) {
  group(cells, cells.size(), bricks_, owns_, bricks);
  const std::size_t blocks = groupCount(bricks_, bricks_.size() - 1);
  group(bricks_, bricks_.size() - 1, blocks_, block_owns_, blocks);
  repeats_ = false;
  map_.clear(blocks);
  for (std::size_t i = 0; i + 1 < blocks_.size(); ++i)
    map_.findOrAdd(blocks_[i].x, blocks_[i].y, blocks_[i].z);
  setSize(around_, bricks_.size() - 1);
  connect();
}

void CellIndex::repeat(std::span<const Cell> cells) {
  group(cells, cells.size(), bricks_, owns_, bricks_.size() - 1);  // the same bricks, in the same order
  repeats_ = true;
}

// Finds the bricks around each, block by block.
void CellIndex::connect() {
  const auto none = static_cast<std::uint32_t>(around_.size());
  std::array<std::uint32_t, BrickHalo::kSlots> numbers;
  BrickHalo halo;
  for (std::uint32_t number = 0; number + 1 < blocks_.size(); ++number) {
    const Brick& block = blocks_[number];
    Around blocks;
    for (std::uint32_t n = 0; n < blocks.size(); ++n) {
      const auto d = static_cast<std::int32_t>(n);
      const std::uint32_t found =
          n == 13 ? number : map_.find(block.x + d % 3 - 1, block.y + d / 3 % 3 - 1, block.z + d / 9 - 1);
      blocks[n] = found == kNone ? static_cast<std::uint32_t>(blocks_.size() - 1) : found;
    }
    halo.gather(block_owns_.data(), blocks);
    for (std::size_t slot = 0; slot < numbers.size(); ++slot) numbers[slot] = std::min(halo[slot], none);
    for (std::uint32_t i = block.first; i < block.first + block.count; ++i) {
      const std::uint32_t* from =
          &numbers[BrickHalo::slot(bricks_[i].x & 3, bricks_[i].y & 3, bricks_[i].z & 3) -
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
