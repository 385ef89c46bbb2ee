// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <vector>

#include "lattice/cell_index.h"

namespace isoreel {

/// Visits the cells around a place. Remembers bricks it has looked up, so that places near one another cost
/// little. One for each thread.
class Neighbours {
 public:
  /// `index` must outlive it, unchanged.
  explicit Neighbours(const CellIndex& index) : index_(index) {}

  /// Calls visit(place) for each cell of the list among the 3×3×3 around (x, y, z), which may lie anywhere.
  /// May leave out those whose place is `end` or later.
  template <class Visit>
  void forEach(std::int32_t x, std::int32_t y, std::int32_t z, Visit visit,
               std::uint32_t end = CellIndex::kNone) {
    if (x < 0 || y < 0 || z < 0 || x > 65535 || y > 65535 || z > 65535) return;
    const std::array<std::int32_t, 3> first{x - 1, y - 1, z - 1};
    const Window& window = windowAt(first[0] >> 2, first[1] >> 2, first[2] >> 2);
    std::array<const std::array<std::uint64_t, 2>*, 3> slabs{};
    for (std::size_t axis = 0; axis < 3; ++axis)
      slabs[axis] = &kSlabs[axis][static_cast<std::size_t>(first[axis] & 3)];
    for (std::size_t i = 0; i < 8; ++i) {
      const CellIndex::Brick* brick = window.bricks[i];
      if (brick == nullptr || brick->first >= end) continue;
      std::uint64_t cells = brick->mask & (*slabs[0])[i & 1] & (*slabs[1])[i >> 1 & 1] & (*slabs[2])[i >> 2];
      for (; cells != 0; cells &= cells - 1)
        visit(brick->first + countBits(brick->mask & ((cells & (0 - cells)) - 1)));
    }
  }

 private:
  /// A brick and those one step higher along each axis: bit 0 of the place is for x. Null where there is
  /// none.
  struct Window {
    std::int32_t x = -9, y = 0, z = 0;  // cell coordinates / 4
    std::array<const CellIndex::Brick*, 8> bricks{};
  };
  // Three cells in a row from coordinate 0 to 3 of a brick on, by axis: those of the brick, and those of the
  // next, as bits of CellIndex::bit.
  static constexpr auto kSlabs = [] {
    std::array<std::array<std::array<std::uint64_t, 2>, 4>, 3> slabs{};
    for (std::uint32_t cell = 0; cell < 64; ++cell) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::uint32_t at = (cell >> axis & 1) | (cell >> (axis + 3) & 1) << 1;
        for (std::uint32_t first = 0; first < 4; ++first) {
          if (at >= first && at <= first + 2) slabs[axis][first][0] |= std::uint64_t{1} << cell;
          if (at + 4 <= first + 2) slabs[axis][first][1] |= std::uint64_t{1} << cell;
        }
      }
    }
    return slabs;
  }();

  const Window& windowAt(std::int32_t x, std::int32_t y, std::int32_t z) {
    Window& window = windows_[static_cast<std::size_t>((x & 3) | (y & 3) << 2 | (z & 3) << 4)];
    if (window.x != x || window.y != y || window.z != z) {
      window = {x, y, z, {}};
      for (std::int32_t i = 0; i < 8; ++i) {
        const std::uint32_t number = index_.brickAt(x + (i & 1), y + (i >> 1 & 1), z + (i >> 2));
        if (number != CellIndex::kNone) window.bricks[static_cast<std::size_t>(i)] = &index_.bricks()[number];
      }
    }
    return window;
  }

  const CellIndex& index_;
  std::vector<Window> windows_ =
      std::vector<Window>(64);  // by the two lowest bits of the brick's coordinates
};

}  // namespace isoreel
