// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <bit>

#include "lattice/cell_index.h"

namespace isoreel {

/// Visits the cells around a place. Remembers, for a few bricks, where in the list their cells and those one
/// step around them are, so that places near one another cost little. One for each thread.
class Neighbours {
 public:
  /// `index` must outlive it.
  explicit Neighbours(const CellIndex& index) : index_(index) {}

  /// Calls visit(place) for each cell of the list among the 3×3×3 around (x, y, z), which may lie anywhere.
  template <class Visit>
  void forEach(std::int32_t x, std::int32_t y, std::int32_t z, Visit visit) {
    if (x < 0 || y < 0 || z < 0 || x > 65535 || y > 65535 || z > 65535) return;
    Table& table = tables_[static_cast<std::size_t>((x >> 2 & 3) | (y & 12) | (z << 2 & 48))];
    if (table.x != x >> 2 || table.y != y >> 2 || table.z != z >> 2) gather(table, x >> 2, y >> 2, z >> 2);
    const int shift = x & 3;
    const std::size_t first = static_cast<std::size_t>((y & 3) + 6 * (z & 3));
    std::uint32_t cells = 0;
    for (std::size_t row = 0; row < 9; ++row)
      cells |= (table.rows[first + kRows[row]] >> shift & 7u) << (3 * row);
    for (const std::uint32_t* places = &table.places[6 * first + static_cast<std::size_t>(shift)]; cells != 0;
         cells &= cells - 1) {
      visit(places[kCells[static_cast<std::size_t>(std::countr_zero(cells))]]);
    }
  }

 private:
  // 6×6×6 cells: a brick and one step around it, x fastest.
  struct Table {
    std::int32_t x = -9, y = 0, z = 0;     // cell coordinates / 4
    std::array<std::uint32_t, 36> rows{};  // bit x is set where there is a cell
    std::array<std::uint32_t, 216> places;
  };
  static constexpr auto kRows = [] {
    std::array<std::size_t, 9> rows{};
    for (std::size_t i = 0; i < 9; ++i) rows[i] = i % 3 + 6 * (i / 3);
    return rows;
  }();
  static constexpr auto kCells = [] {
    std::array<std::size_t, 27> cells{};
    for (std::size_t i = 0; i < 27; ++i) cells[i] = i % 3 + 6 * (i / 3 % 3) + 36 * (i / 9);
    return cells;
  }();

  void gather(Table& table, std::int32_t x, std::int32_t y, std::int32_t z) const;

  const CellIndex& index_;
  std::vector<Table> tables_ = std::vector<Table>(64);  // by the two lowest bits of the brick's coordinates
};

}  // namespace isoreel
