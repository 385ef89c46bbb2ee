// SPDX-License-Identifier: BSD-3-Clause
#include "lattice/dual_mesh.h"

namespace isoreel {
namespace {

// Calls visit(axis, low corner is inside) for each sign-changing edge from the cell's corner 0 that has all
// its cells.
template <class Visit>
void forEachQuad(const Cell& cell, Visit visit) {
  const bool low = cell.corners & 1;
  const std::array<bool, 3> at_border{cell.x == 0, cell.y == 0, cell.z == 0};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const bool high = cell.corners >> (1u << axis) & 1;
    if (low == high || at_border[(axis + 1) % 3] || at_border[(axis + 2) % 3]) continue;
    visit(axis, low);
  }
}

}  // namespace

std::size_t countQuads(std::span<const Cell> cells) {
  std::size_t count = 0;
  for (const Cell& cell : cells) forEachQuad(cell, [&](std::size_t, bool) { ++count; });
  return count;
}

std::vector<Quad> dualQuads(std::span<const Cell> cells, const CellIndex& index) {
  std::vector<Quad> quads;
  quads.reserve(countQuads(cells));
  for (const CellIndex::Brick& brick : index.bricks()) {
    for (std::uint32_t i = brick.first; i < brick.first + brick.count; ++i) {
      const Cell& cell = cells[i];
      const auto neighbour = [&](std::array<std::int32_t, 3> back) {
        const std::int32_t x = cell.x - back[0], y = cell.y - back[1], z = cell.z - back[2];
        if (x >> 2 == brick.x && y >> 2 == brick.y && z >> 2 == brick.z)
          return CellIndex::place(brick, CellIndex::bit(x, y, z));
        return index.find(x, y, z);
      };
      forEachQuad(cell, [&](std::size_t axis, bool low_inside) {
        const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
        std::array<std::int32_t, 3> back_u{}, back_v{}, back_uv{};
        back_u[u] = back_uv[u] = 1;
        back_v[v] = back_uv[v] = 1;
        const std::uint32_t one = neighbour(back_u), two = neighbour(back_uv), three = neighbour(back_v);
        quads.push_back(low_inside ? Quad{i, one, two, three} : Quad{i, three, two, one});
      });
    }
  }
  return quads;
}

}  // namespace isoreel
