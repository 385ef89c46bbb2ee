// SPDX-License-Identifier: BSD-3-Clause
#include "lattice/dual_mesh.h"

#include <algorithm>

#include "lattice/sheets.h"

namespace isoreel {
namespace {

// Steps between slots of a BrickHalo.
constexpr std::array<std::uint32_t, 3> kStrides{1, 6, 36};

// How far back the second, third and fourth corner of a quad are: by axis, then by whether the
// cell's corner 0 is inside.
constexpr auto kBack = [] {
  std::array<std::array<std::uint8_t, 3>, 6> back{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto u = static_cast<std::uint8_t>(kStrides[(axis + 1) % 3]),
               v = static_cast<std::uint8_t>(kStrides[(axis + 2) % 3]);
    back[2 * axis + 1] = {u, static_cast<std::uint8_t>(u + v), v};
    back[2 * axis] = {v, static_cast<std::uint8_t>(u + v), u};
  }
  return back;
}();

// The axes along which the edge from the cell's corner 0 changes sign, one bit each.
std::uint32_t changes(const Cell& cell) {
  const std::uint32_t c = cell.corners;
  return ((c ^ c >> 1) & 1) | ((c ^ c >> 2) & 1) << 1 | ((c ^ c >> 4) & 1) << 2;
}
// The axes along which the edge from the cell's corner 0 has all its cells.
std::uint32_t whole(const Cell& cell) {
  return (cell.x == 0 ? 1u : 7u) & (cell.y == 0 ? 2u : 7u) & (cell.z == 0 ? 4u : 7u);
}

// From the first sheets of the cells around an edge to those that have it: `from` is its lower end in the
// first cell, the others follow as in kBack.
void findSheets(std::span<const Cell> cells, std::size_t axis, bool inside, Quad& quad) {
  const std::uint32_t along = 1u << axis, u = 1u << (axis + 1) % 3, v = 1u << (axis + 2) % 3;
  const std::array<std::uint32_t, 3> low{inside ? u : v, u | v, inside ? v : u};
  for (std::size_t k = 0; k < 3; ++k) {
    std::uint32_t& place = quad[k + 1];
    while (((cells[place].corners >> low[k] ^ cells[place].corners >> (low[k] | along)) & 1) == 0) ++place;
  }
}

}  // namespace

std::size_t quadCount(std::span<const Cell> cells) {
  std::size_t count = 0;
  for (const Cell& cell : cells) count += countBits(changes(cell) & whole(cell));
  return count;
}

std::vector<Quad> dualQuads(std::span<const Cell> cells, const CellIndex& index, std::size_t most) {
  std::vector<Quad> quads;
  quads.reserve(most);
  BrickHalo places;
  std::array<Quad, std::size_t{3} * 64> made;
  struct Edge {
    std::uint32_t vertex;
    std::uint8_t slot;
    std::uint8_t back;
  };
  std::array<Edge, std::size_t{3} * 64 + 1> edges;
  for (std::size_t number = 0; number < index.bricks().size(); ++number) {
    const CellIndex::Brick& brick = index.bricks()[number];
    places.gatherLower(index.owns(), index.around(number));
    const bool at_border = brick.x == 0 || brick.y == 0 || brick.z == 0;
    // First which edges, then their quads: where an edge lies in its brick is anybody's guess, and so would
    // be a branch on it.
    std::size_t count = 0;
    for (std::uint32_t i = brick.first; i < brick.first + brick.count; ++i) {
      const Cell& cell = cells[i];
      const std::uint32_t axes = changes(cell) & (at_border ? whole(cell) : 7u);
      const auto slot = static_cast<std::uint8_t>(BrickHalo::slot(cell.x & 3, cell.y & 3, cell.z & 3));
      for (std::uint32_t axis = 0; axis < 3; ++axis) {
        edges[count] = {i, slot, static_cast<std::uint8_t>(2 * axis + (cell.corners & 1))};
        count += axes >> axis & 1;
      }
    }
    count = std::min(count, most - quads.size());
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t slot = edges[k].slot;
      const auto& back = kBack[edges[k].back];
      made[k] = {edges[k].vertex, places[slot - back[0]], places[slot - back[1]], places[slot - back[2]]};
    }
    if (index.repeatsAround(number)) {
      for (std::size_t k = 0; k < count; ++k)
        findSheets(cells, edges[k].back / 2, edges[k].back % 2 != 0, made[k]);
    }
    quads.insert(quads.end(), made.begin(), made.begin() + static_cast<std::ptrdiff_t>(count));
  }
  return quads;
}

}  // namespace isoreel
