// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "lattice/cell_index.h"

namespace isoreel {

/// The places of the 6×6×6 cells from -1 to 4 around a brick of 4×4×4: a neighbour is a difference of slots.
class BrickHalo {
 public:
  static constexpr std::size_t slot(int x, int y, int z) {
    return static_cast<std::size_t>(x + 1 + 6 * (y + 1) + 36 * (z + 1));
  }

  /// Looks them up; `index` and `brick` (of it) are kept until the next call.
  void gather(const CellIndex& index, const CellIndex::Brick& brick) {
    places_.fill(CellIndex::kNone);
    count_ = 0;
    for (int around = 0; around < 27; ++around) {
      const int dx = around % 3 - 1, dy = around / 3 % 3 - 1, dz = around / 9 - 1;
      const std::uint32_t number = index.brickAt(brick.x + dx, brick.y + dy, brick.z + dz);
      if (number == CellIndex::kNone) continue;
      const CellIndex::Brick& other = index.bricks()[number];
      const std::uint64_t reached = kReached[static_cast<std::size_t>(around)];
      for (std::uint64_t cells = other.mask & reached; cells != 0; cells &= cells - 1) {
        const auto bit = static_cast<std::size_t>(std::countr_zero(cells));
        const auto at = static_cast<std::size_t>(kSlots[bit] + 4 * (dx + 6 * dy + 36 * dz));
        places_[at] = other.first + countBits(other.mask & ((cells & (0 - cells)) - 1));
        filled_[count_++] = static_cast<std::uint8_t>(at);
      }
    }
  }
  /// The place of the cell in a slot, or CellIndex::kNone.
  std::uint32_t operator[](std::size_t slot) const { return places_[slot]; }
  /// Calls visit(x, y, z, place) for each cell, coordinates -1 to 4.
  template <class Visit>
  void forEach(Visit visit) const {
    for (std::size_t i = 0; i < count_; ++i) {
      const int at = filled_[i];
      visit(at % 6 - 1, at / 6 % 6 - 1, at / 36 - 1, places_[filled_[i]]);
    }
  }

 private:
  // By bit of CellIndex::Brick::mask: the slot in the brick itself.
  static constexpr auto kSlots = [] {
    std::array<int, 64> slots{};
    for (int bit = 0; bit < 64; ++bit) {
      slots[static_cast<std::size_t>(bit)] = 43 + (bit & 1) + 2 * (bit >> 3 & 1) +
                                             6 * ((bit >> 1 & 1) + 2 * (bit >> 4 & 1)) +
                                             36 * ((bit >> 2 & 1) + 2 * (bit >> 5 & 1));
    }
    return slots;
  }();
  // By brick around: those of its cells that are in the halo.
  static constexpr auto kReached = [] {
    std::array<std::uint64_t, 27> reached{};
    for (int around = 0; around < 27; ++around) {
      const std::array<int, 3> offset{around % 3 - 1, around / 3 % 3 - 1, around / 9 - 1};
      for (int bit = 0; bit < 64; ++bit) {
        bool in = true;
        for (int axis = 0; axis < 3; ++axis) {
          const int at =
              4 * offset[static_cast<std::size_t>(axis)] + (bit >> axis & 1) + 2 * (bit >> (axis + 3) & 1);
          in = in && at >= -1 && at <= 4;
        }
        if (in) reached[static_cast<std::size_t>(around)] |= std::uint64_t{1} << bit;
      }
    }
    return reached;
  }();

  std::array<std::uint32_t, 216> places_;
  std::array<std::uint8_t, 216> filled_;
  std::size_t count_ = 0;
};

}  // namespace isoreel
