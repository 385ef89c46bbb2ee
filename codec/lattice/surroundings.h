// SPDX-License-Identifier: BSD-3-Clause
// What lies around the active cells of a surface: cells across faces and further, and
// the signs of 4×4×4 nodes (spec codec 11.1, 11.4).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "lattice/brick_halo.h"

namespace isoreel {

/// Faces in this order: low x, high x, low y, high y, low z, high z.
struct Surroundings {
  /// For each cell, the cell across each face whose corners differ in sign; the cell itself where they agree,
  /// and at the grid's border.
  std::vector<std::array<std::uint32_t, 6>> across;
  /// For each cell, the faces that have another cell in `across`, one bit each.
  std::vector<std::uint8_t> faces;
  /// For each cell, the signs of the nodes from -1 to 2 along each axis, from its corner 0: bit (x + 1) + 4
  /// (y + 1) + 16 (z + 1). Outside the grid: that of the nearest node in it.
  std::vector<std::uint64_t> signs;

  /// The cells of one parity of x + y + z, in order, and for each its links.
  struct Colour {
    std::vector<std::uint32_t> cells;
    /// Even cells: how many of the cells that differ by 1 in two coordinates come earlier. Odd cells: in bits
    /// 0 to 2 those that differ in one, from bit 4 those that differ in three.
    std::vector<std::uint8_t> counts;
    std::vector<std::uint32_t> links;  // these cells, one cell's after the other's
  };
  static std::uint32_t linkCount(std::uint8_t count) { return (count & 15u) + (count >> 4); }
  /// Even, then odd: no two odd cells are linked.
  std::array<Colour, 2> colours;

  /// `cells`: the active cells of a surface in Morton order; `index` is theirs. Keeps its memory from call to
  /// call.
  void build(std::span<const Cell> cells, const CellIndex& index);
  /// Memory beyond the object itself.
  std::uint64_t bytes() const;
  /// The most that build() takes. Of two colours' lists that double as they grow, the old and the new one
  /// are there at once, for 14 links a cell at most.
  static std::uint64_t bytesFor(std::size_t cells, std::size_t bricks) {
    constexpr std::size_t kPerCell = sizeof(std::array<std::uint32_t, 6>) + 1 + sizeof(std::uint64_t);
    constexpr std::size_t kList = 3 * (sizeof(std::uint32_t) + 1 + 14 * sizeof(std::uint32_t));
    return cells * (kPerCell + kList) + 32768 + BrickHalo::Around::bytesFor(bricks);
  }

 private:
  BrickHalo::Around bricks_;
};

}  // namespace isoreel
