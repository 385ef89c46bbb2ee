// SPDX-License-Identifier: BSD-3-Clause
// The cells of one octree level, and the way from a cell's coordinates to its place in their order.
#pragma once

#include <isoreel/codec/cell.h>

#include <cstdint>
#include <span>
#include <vector>

#include "lattice/bits.h"
#include "lattice/brick_map.h"
#include "lattice/morton.h"
#include "lattice/set_size.h"

namespace isoreel {

inline bool isActive(const Cell& cell) { return cell.corners != 0 && cell.corners != 0xFF; }

/// Finds cells by coordinates, in a list that is in Morton order: the cells of an aligned 4×4×4 brick are
/// neighbours in the list, so a bit mask and one number a brick are enough.
class CellIndex {
 public:
  struct Brick {
    std::uint64_t mask = 0;   // bit: Morton code of the cell inside the brick
    std::uint64_t rows = 0;   // the same with bit x + 4y + 16z
    std::uint32_t first = 0;  // place of the brick's first cell
    std::uint32_t count = 0;
    std::int32_t x = 0, y = 0, z = 0;  // cell coordinates / 4
  };
  static constexpr std::uint32_t kNone = BrickMap::kNone;

  /// `cells` in Morton order; not kept. Takes room for `bricks`, at least as many as they are in.
  void build(std::span<const Cell> cells, std::size_t bricks);
  void build(std::span<const Cell> cells) { build(cells, brickCount(cells)); }
  /// How many bricks they are in, and the memory of an index of so many.
  static std::size_t brickCount(std::span<const Cell> cells);
  static std::uint64_t bytesFor(std::size_t bricks) {
    return bricks * sizeof(Brick) + BrickMap::bytesFor(bricks);
  }
  /// Place of the cell in the list, or kNone. Coordinates from -1 to 65536.
  std::uint32_t find(std::int32_t x, std::int32_t y, std::int32_t z) const {
    const std::uint32_t number = map_.find(x >> 2, y >> 2, z >> 2);
    if (number == BrickMap::kNone) return kNone;
    return place(bricks_[number], bit(x, y, z));
  }
  const std::vector<Brick>& bricks() const { return bricks_; }
  /// Memory beyond the object itself.
  std::uint64_t bytes() const { return bricks_.capacity() * sizeof(Brick) + map_.bytes(); }
  /// Number of the brick at brick coordinates, or BrickMap::kNone.
  std::uint32_t brickAt(std::int32_t x, std::int32_t y, std::int32_t z) const { return map_.find(x, y, z); }

  static std::uint64_t bit(std::int32_t x, std::int32_t y, std::int32_t z) {
    const auto spread = [](std::int32_t v) { return (v & 1) | (v & 2) << 2; };
    return std::uint64_t{1} << (spread(x) | spread(y) << 1 | spread(z) << 2);
  }
  static std::uint32_t place(const Brick& brick, std::uint64_t bit) {
    if ((brick.mask & bit) == 0) return kNone;
    return brick.first + countBits(brick.mask & (bit - 1));
  }

 private:
  BrickMap map_;
  std::vector<Brick> bricks_;
};

}  // namespace isoreel
