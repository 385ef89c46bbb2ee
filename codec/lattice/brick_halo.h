// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "lattice/cell_index.h"

namespace isoreel {

/// The places of the 6×6×6 cells from -1 to 4 around a brick of 4×4×4: a neighbour is a difference of slots.
class BrickHalo {
 public:
  static constexpr std::size_t slot(int x, int y, int z) {
    return static_cast<std::size_t>(x + 1 + 6 * (y + 1) + 36 * (z + 1));
  }

  /// The bricks around each brick of an index, itself in the middle: number dx + 1 + 3 (dy + 1) + 9 (dz + 1).
  class Around {
   public:
    void build(const CellIndex& index) {
      const auto count = static_cast<std::uint32_t>(index.bricks().size());
      std::array<std::uint32_t, 27> none;
      none.fill(CellIndex::kNone);
      clearFor(numbers_, count);
      numbers_.assign(count, none);
      for (std::uint32_t i = 0; i < count; ++i) {
        const CellIndex::Brick& brick = index.bricks()[i];
        numbers_[i][13] = i;
        // Half of them are enough: each finds the other.
        for (std::size_t around = 0; around < 13; ++around) {
          const auto n = static_cast<int>(around);
          const std::uint32_t other =
              index.brickAt(brick.x + n % 3 - 1, brick.y + n / 3 % 3 - 1, brick.z + n / 9 - 1);
          if (other == CellIndex::kNone) continue;
          numbers_[i][around] = other;
          numbers_[other][26 - around] = i;
        }
      }
    }
    const std::array<std::uint32_t, 27>& operator[](std::size_t brick) const { return numbers_[brick]; }
    std::uint64_t bytes() const { return bytesOf(numbers_); }
    static std::uint64_t bytesFor(std::size_t bricks) {
      return bricks * sizeof(std::array<std::uint32_t, 27>);
    }

   private:
    std::vector<std::array<std::uint32_t, 27>> numbers_;
  };

  /// Fills the slots around a brick of `index`, whose neighbours are `around`.
  void gather(const CellIndex& index, const std::array<std::uint32_t, 27>& around) {
    places_.fill(CellIndex::kNone);
    count_ = 0;
    // The brick in the middle first: all of its cells are there, one after the other.
    const CellIndex::Brick& middle = index.bricks()[around[13]];
    std::uint32_t place = middle.first;
    for (std::uint64_t cells = middle.mask; cells != 0; cells &= cells - 1)
      put(kSlots[static_cast<std::size_t>(std::countr_zero(cells))], place++);
    for (std::size_t n = 0; n < 27; ++n) {
      if (around[n] == CellIndex::kNone || n == 13) continue;
      const CellIndex::Brick& other = index.bricks()[around[n]];
      for (std::uint64_t cells = other.mask & kReached[n]; cells != 0; cells &= cells - 1) {
        put(kSlots[static_cast<std::size_t>(std::countr_zero(cells))] + kBricks[n],
            other.first + countBits(other.mask & ((cells & (0 - cells)) - 1)));
      }
    }
  }
  /// The place of the cell in a slot, or CellIndex::kNone.
  std::uint32_t operator[](std::size_t slot) const { return places_[slot]; }
  /// Calls visit(slot, place) for each cell.
  template <class Visit>
  void forEach(Visit visit) const {
    for (std::size_t i = 0; i < count_; ++i) visit(filled_[i], places_[filled_[i]]);
  }

 private:
  void put(int slot, std::uint32_t place) {
    places_[static_cast<std::size_t>(slot)] = place;
    filled_[count_++] = static_cast<std::uint8_t>(slot);
  }

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
  // By brick around: where its slots are from those of the brick in the middle.
  static constexpr auto kBricks = [] {
    std::array<int, 27> bricks{};
    for (int n = 0; n < 27; ++n)
      bricks[static_cast<std::size_t>(n)] = 4 * (n % 3 - 1 + 6 * (n / 3 % 3 - 1) + 36 * (n / 9 - 1));
    return bricks;
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
