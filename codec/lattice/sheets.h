// SPDX-License-Identifier: BSD-3-Clause
// The sheets of the surface in a cell, each of which has a vertex of its own (spec codec 5.5). A sheet is a
// Cell: that of the grid, with the signs that its corners would have if there were no other.
#pragma once

#include <isoreel/codec/cell.h>

#include <span>
#include <utility>
#include <vector>

#include "lattice/cell_index.h"

namespace isoreel {

/// The sheets of active cells, in the order of the cells, which are in Morton order. `index`: of the cells;
/// becomes that of the sheets. Takes room for `most` sheets, and gives one more where there are more than
/// that.
std::vector<Cell> splitSheets(std::vector<Cell> cells, CellIndex& index, std::size_t most);
/// The same, all of them.
inline std::vector<Cell> splitSheets(std::vector<Cell> cells, CellIndex& index) {
  const std::size_t most = 4 * cells.size();
  return splitSheets(std::move(cells), index, most);
}

/// The signs of the corners of the cell whose first sheet is at `first` in a list of sheets.
std::uint8_t signsOf(std::span<const Cell> sheets, std::size_t first);
/// The cells that have these sheets.
std::vector<Cell> uniteSheets(std::span<const Cell> sheets);

/// Of the sheets of the cell whose first one is at `first`: the one that `sheet`, of another cell that has a
/// node in common with it, is joined to or faces (spec codec 11.1).
std::uint32_t facingSheet(std::span<const Cell> sheets, std::uint32_t first, const Cell& sheet);

/// What the nodes from -1 to 2 around a cell, as Surroundings::signs has them, would be if there were but
/// this sheet in it (spec codec 11.1).
std::uint64_t signsAround(std::uint64_t signs, const Cell& sheet);

}  // namespace isoreel
