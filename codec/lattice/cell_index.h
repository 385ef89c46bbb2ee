// SPDX-License-Identifier: BSD-3-Clause
// The cells of one octree level, and the way from a cell's coordinates to its place in their order.
#pragma once

#include <isoreel/codec/cell.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "lattice/bits.h"
#include "lattice/brick_halo.h"
#include "lattice/brick_map.h"
#include "lattice/morton.h"
#include "lattice/set_size.h"

namespace isoreel {

inline bool isActive(const Cell& cell) { return cell.corners != 0 && cell.corners != 0xFF; }
inline bool sameCell(const Cell& a, const Cell& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

/// Finds cells by coordinates, in a list that is in Morton order: the cells of an aligned 4×4×4 brick are
/// neighbours in the list, so a bit mask and one number a brick are enough. The same goes for bricks among
/// themselves. A cell may be in the list up to four times, one after the other.
class CellIndex {
 public:
  struct Brick {
    std::uint64_t mask = 0;            // bit: Morton code of the cell inside the brick
    std::uint64_t rows = 0;            // the same with bit x + 4y + 16z
    std::uint32_t first = 0;           // place of the brick's first cell
    std::uint32_t count = 0;           // of them, with those that are there again
    std::int32_t x = 0, y = 0, z = 0;  // cell coordinates / 4
    bool repeats = false;              // some of them are there several times
  };
  static constexpr std::uint32_t kNone = BrickMap::kNone;
  /// Numbers of the bricks around a brick, by dx + 1 + 3 (dy + 1) + 9 (dz + 1), itself in the middle.
  using Around = std::array<std::uint32_t, 27>;

  /// `cells` in Morton order; not kept. Takes room for `bricks`, at least as many as they are in.
  void build(std::span<const Cell> cells, std::size_t bricks);
  void build(std::span<const Cell> cells) { build(cells, groupCount(cells, cells.size())); }
  /// The most memory of an index of so many bricks: each may be the only one of its block.
  static std::uint64_t bytesFor(std::size_t bricks) {
    return 2 * (bricks + 1) * (sizeof(Brick) + sizeof(BrickHalo::Own)) + roomFor(bricks) * sizeof(Around) +
           BrickMap::bytesFor(bricks);
  }
  /// From the list that it is of to one with the same cells, some of them several times.
  void repeat(std::span<const Cell> cells);
  /// Place of the cell in the list, the first if it has several, or kNone. Coordinates from -1 to 65536.
  std::uint32_t find(std::int32_t x, std::int32_t y, std::int32_t z) const {
    const std::uint32_t number = brickAt(x >> 2, y >> 2, z >> 2);
    if (number == kNone) return kNone;
    const BrickHalo::Own& own = owns_[number];
    return BrickHalo::place(own.first,
                            own.ranks[static_cast<std::size_t>((x & 3) + 4 * (y & 3) + 16 * (z & 3))]);
  }
  /// Places of the 27 cells around a cell of the list, in the order of Around.
  Around placesAround(std::int32_t x, std::int32_t y, std::int32_t z) const {
    Around places;
    const Around& bricks = around_[brickAt(x >> 2, y >> 2, z >> 2)];
    for (std::int32_t n = 0; n < 27; ++n) {
      const std::int32_t ax = (x & 3) + n % 3 - 1, ay = (y & 3) + n / 3 % 3 - 1, az = (z & 3) + n / 9 - 1;
      const BrickHalo::Own& own =
          owns_[bricks[static_cast<std::size_t>(13 + (ax >> 2) + 3 * (ay >> 2) + 9 * (az >> 2))]];
      const auto row = static_cast<std::size_t>((ax & 3) + 4 * (ay & 3) + 16 * (az & 3));
      places[static_cast<std::size_t>(n)] = BrickHalo::place(own.first, own.ranks[row]);
    }
    return places;
  }
  std::span<const Brick> bricks() const { return std::span(bricks_).first(around_.size()); }
  /// Whether a cell that a BrickHalo around this brick has is there several times.
  bool repeatsAround(std::size_t number) const {
    return repeats_ && std::any_of(around_[number].begin(), around_[number].end(),
                                   [&](std::uint32_t other) { return bricks_[other].repeats; });
  }
  /// The bricks around one. One that is not there has the number bricks().size().
  const Around& around(std::size_t number) const { return around_[number]; }
  /// By number; an empty one for bricks().size().
  const Brick& brickOrEmpty(std::size_t number) const { return bricks_[number]; }
  /// The places of the bricks' cells, by number; for bricks().size() none.
  const BrickHalo::Own* owns() const { return owns_.data(); }
  /// Memory beyond the object itself.
  std::uint64_t bytes() const {
    return bytesOf(bricks_) + bytesOf(blocks_) + bytesOf(around_) + bytesOf(owns_) + bytesOf(block_owns_) +
           map_.bytes();
  }
  /// Number of the brick at brick coordinates, or kNone.
  std::uint32_t brickAt(std::int32_t x, std::int32_t y, std::int32_t z) const {
    const std::uint32_t number = map_.find(x >> 2, y >> 2, z >> 2);
    return number == kNone ? kNone : place(blocks_[number], bit(x, y, z));
  }

  static std::uint64_t bit(std::int32_t x, std::int32_t y, std::int32_t z) {
    const auto spread = [](std::int32_t v) { return (v & 1) | (v & 2) << 2; };
    return std::uint64_t{1} << (spread(x) | spread(y) << 1 | spread(z) << 2);
  }

 private:
  /// Of a brick that is not in its block's list several times.
  static std::uint32_t place(const Brick& block, std::uint64_t bit) {
    if ((block.mask & bit) == 0) return kNone;
    return block.first + countBits(block.mask & (bit - 1));
  }
  template <class Cells>
  static std::size_t groupCount(const Cells& cells, std::size_t count) {
    std::size_t groups = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const auto &cell = cells[i], &before = cells[i == 0 ? 0 : i - 1];
      groups += i == 0 || ((cell.x ^ before.x) | (cell.y ^ before.y) | (cell.z ^ before.z)) >> 2 != 0;
    }
    return groups;
  }
  template <class Cells>
  static void group(const Cells& cells, std::size_t count, std::vector<Brick>& bricks,
                    std::vector<BrickHalo::Own>& owns, std::size_t most);
  void connect();

  std::vector<Brick> bricks_;  // and an empty one
  std::vector<Brick> blocks_;  // the bricks of bricks
  BrickMap map_;               // of blocks_
  std::vector<Around> around_;
  std::vector<BrickHalo::Own> owns_, block_owns_;
  bool repeats_ = false;
};

}  // namespace isoreel
