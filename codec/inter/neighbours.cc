// SPDX-License-Identifier: BSD-3-Clause
#include "inter/neighbours.h"

namespace isoreel {
namespace {

// Cells of a brick that are in the table of the brick `step` (-1 to 1) before it along an axis, as bits of
// CellIndex::bit: all, or those with the coordinate at the near side.
constexpr auto kSlabs = [] {
  std::array<std::array<std::uint64_t, 3>, 3> slabs{};
  for (std::uint32_t cell = 0; cell < 64; ++cell) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::uint32_t at = (cell >> axis & 1) | (cell >> (axis + 3) & 1) << 1;
      const std::uint64_t bit = std::uint64_t{1} << cell;
      slabs[axis][1] |= bit;
      if (at == 3) slabs[axis][0] |= bit;
      if (at == 0) slabs[axis][2] |= bit;
    }
  }
  return slabs;
}();

// Where a brick's own cells are in its table.
struct Slot {
  std::int32_t column, row;
};
constexpr auto kSlots = [] {
  std::array<Slot, 64> slots{};
  for (std::uint64_t cell = 0; cell < 64; ++cell) {
    slots[cell] = {static_cast<std::int32_t>(gatherBits(cell)) + 1,
                   static_cast<std::int32_t>(gatherBits(cell >> 1) + 6 * gatherBits(cell >> 2)) + 7};
  }
  return slots;
}();

}  // namespace

void Neighbours::gather(Table& table, std::int32_t x, std::int32_t y, std::int32_t z) const {
  table.x = x;
  table.y = y;
  table.z = z;
  table.rows.fill(0);
  for (std::int32_t i = 0; i < 27; ++i) {
    const std::array<std::int32_t, 3> step{i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1};
    const std::uint32_t number = index_.brickAt(x + step[0], y + step[1], z + step[2]);
    if (number == BrickMap::kNone) continue;
    const CellIndex::Brick& brick = index_.bricks()[number];
    std::uint64_t cells = brick.mask;
    for (std::size_t axis = 0; axis < 3; ++axis)
      cells &= kSlabs[axis][static_cast<std::size_t>(step[axis] + 1)];
    const std::int32_t rows = 4 * step[1] + 24 * step[2];
    for (; cells != 0; cells &= cells - 1) {
      const Slot& slot = kSlots[static_cast<std::size_t>(std::countr_zero(cells))];
      table.rows[static_cast<std::size_t>(slot.row + rows)] |= 1u << (slot.column + 4 * step[0]);
      table.places[static_cast<std::size_t>(6 * (slot.row + rows) + slot.column + 4 * step[0])] =
          CellIndex::place(brick, cells & (0 - cells));
    }
  }
}

}  // namespace isoreel
