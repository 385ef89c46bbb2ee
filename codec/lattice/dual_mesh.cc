// SPDX-License-Identifier: BSD-3-Clause
#include "lattice/dual_mesh.h"

#include <algorithm>
#include <bit>

namespace isoreel {
namespace {

// A brick's own cells, and those one step lower along each axis: their places in the list, 5×5×5 of them. The
// way from a cell to its neighbour is a difference of indices.
class Places {
 public:
  static constexpr std::array<std::uint32_t, 3> kStrides{1, 5, 25};
  static constexpr std::size_t kOrigin = 1 + 5 + 25;

  /// Where in the table the cell is that has this bit (by number) in CellIndex::Brick::mask.
  static std::size_t slot(int bit) { return kSlots[static_cast<std::size_t>(bit)]; }

  void gather(const CellIndex& index, const CellIndex::Brick& brick) {
    places_.fill(CellIndex::kNone);
    std::uint32_t next = brick.first;
    for (std::uint64_t mask = brick.mask; mask != 0; mask &= mask - 1)
      places_[slot(std::countr_zero(mask))] = next++;
    for (int lower = 1; lower < 8; ++lower) {  // the axes along which the neighbour brick is lower
      const std::uint32_t number =
          index.brickAt(brick.x - (lower & 1), brick.y - (lower >> 1 & 1), brick.z - (lower >> 2));
      if (number == BrickMap::kNone) continue;
      const CellIndex::Brick& other = index.bricks()[number];
      std::uint64_t mask = other.mask;
      std::size_t back = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if ((lower >> axis & 1) == 0) continue;
        mask &= kHighest[axis];
        back += 4 * kStrides[axis];
      }
      for (; mask != 0; mask &= mask - 1)
        places_[slot(std::countr_zero(mask)) - back] = CellIndex::place(other, mask & (0 - mask));
    }
  }
  std::uint32_t operator[](std::size_t slot) const { return places_[slot]; }

 private:
  static constexpr auto kSlots = [] {
    std::array<std::uint8_t, 64> slots{};
    for (std::size_t bit = 0; bit < 64; ++bit) {
      std::size_t at = kOrigin;
      for (std::size_t axis = 0; axis < 3; ++axis)
        at += kStrides[axis] * ((bit >> axis & 1) + 2 * (bit >> (axis + 3) & 1));
      slots[bit] = static_cast<std::uint8_t>(at);
    }
    return slots;
  }();
  // The cells of a brick with coordinate 3 along an axis.
  static constexpr auto kHighest = [] {
    std::array<std::uint64_t, 3> masks{};
    for (std::size_t bit = 0; bit < 64; ++bit) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (bit >> axis & bit >> (axis + 3) & 1) masks[axis] |= std::uint64_t{1} << bit;
      }
    }
    return masks;
  }();

  std::array<std::uint32_t, 125> places_;
};

// How far back in Places the second, third and fourth corner of a quad are: by axis, then by whether the
// cell's corner 0 is inside.
constexpr auto kBack = [] {
  std::array<std::array<std::uint8_t, 3>, 6> back{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto u = static_cast<std::uint8_t>(Places::kStrides[(axis + 1) % 3]),
               v = static_cast<std::uint8_t>(Places::kStrides[(axis + 2) % 3]);
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

}  // namespace

std::size_t quadCount(std::span<const Cell> cells) {
  std::size_t count = 0;
  for (const Cell& cell : cells) count += countBits(changes(cell) & whole(cell));
  return count;
}

std::vector<Quad> dualQuads(std::span<const Cell> cells, const CellIndex& index, std::size_t most) {
  std::vector<Quad> quads;
  quads.reserve(most);
  Places places;
  std::array<Quad, std::size_t{3} * 64> made;
  struct Edge {
    std::uint8_t slot;
    std::uint8_t back;
  };
  std::array<Edge, std::size_t{3} * 64 + 1> edges;
  for (const CellIndex::Brick& brick : index.bricks()) {
    places.gather(index, brick);
    const bool at_border = brick.x == 0 || brick.y == 0 || brick.z == 0;
    // First which edges, then their quads: where an edge lies in its brick is anybody's guess, and so would
    // be a branch on it.
    std::size_t count = 0;
    std::uint32_t i = brick.first;
    for (std::uint64_t mask = brick.mask; mask != 0; mask &= mask - 1, ++i) {
      const Cell& cell = cells[i];
      const std::uint32_t axes = changes(cell) & (at_border ? whole(cell) : 7u);
      const auto slot = static_cast<std::uint8_t>(Places::slot(std::countr_zero(mask)));
      for (std::uint32_t axis = 0; axis < 3; ++axis) {
        edges[count] = {slot, static_cast<std::uint8_t>(2 * axis + (cell.corners & 1))};
        count += axes >> axis & 1;
      }
    }
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t slot = edges[k].slot;
      const auto& back = kBack[edges[k].back];
      made[k] = {places[slot], places[slot - back[0]], places[slot - back[1]], places[slot - back[2]]};
    }
    count = std::min(count, most - quads.size());
    quads.insert(quads.end(), made.begin(), made.begin() + static_cast<std::ptrdiff_t>(count));
  }
  return quads;
}

}  // namespace isoreel
