// SPDX-License-Identifier: BSD-3-Clause
// Where the bricks of a sparse lattice are: memory follows the surface, not the grid.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <vector>

namespace isoreel {

/// Maps brick coordinates (each from -1 to 65536) to numbers counted from 0 in order of insertion.
/// Open addressing; no removal.
class BrickMap {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFF;

  void clear() {
    slots_.assign(64, Slot{});
    count_ = 0;
  }
  /// The same, with room for so many bricks: it takes bytesFor(bricks) and no more.
  void clear(std::size_t bricks) {
    const std::size_t slots = slotsFor(bricks);
    if (slots_.capacity() < slots) slots_ = std::vector<Slot>();
    slots_.assign(slots, Slot{});
    count_ = 0;
  }
  static std::uint64_t bytesFor(std::size_t bricks) { return slotsFor(bricks) * sizeof(Slot); }
  std::uint32_t find(std::int32_t x, std::int32_t y, std::int32_t z) const {
    const std::uint64_t key = pack(x, y, z);
    for (std::size_t i = hash(key) & mask();; i = (i + 1) & mask()) {
      if (slots_[i].key == key) return slots_[i].value;
      if (slots_[i].key == 0) return kNone;
    }
  }
  /// The brick's number; a new one when it is not there yet.
  std::uint32_t findOrAdd(std::int32_t x, std::int32_t y, std::int32_t z) {
    if (count_ * 2 >= slots_.size()) grow();
    const std::uint64_t key = pack(x, y, z);
    for (std::size_t i = hash(key) & mask();; i = (i + 1) & mask()) {
      if (slots_[i].key == key) return slots_[i].value;
      if (slots_[i].key == 0) {
        slots_[i] = {key, count_};
        return count_++;
      }
    }
  }
  std::uint32_t size() const { return count_; }
  /// Memory beyond the object itself.
  std::uint64_t bytes() const { return slots_.capacity() * sizeof(Slot); }

 private:
  struct Slot {
    std::uint64_t key = 0;  // 0: free
    std::uint32_t value = kNone;
  };
  static std::size_t slotsFor(std::size_t bricks) {
    return std::max(std::size_t{64}, std::bit_ceil(2 * bricks + 1));
  }
  static std::uint64_t pack(std::int32_t x, std::int32_t y, std::int32_t z) {
    return static_cast<std::uint64_t>(x + 2) | static_cast<std::uint64_t>(y + 2) << 20 |
           static_cast<std::uint64_t>(z + 2) << 40;
  }
  static std::size_t hash(std::uint64_t key) {
    return static_cast<std::size_t>((key * 0x9E3779B97F4A7C15ull) >> 24);
  }
  std::size_t mask() const { return slots_.size() - 1; }
  void grow() {
    std::vector<Slot> old(slots_.size() * 2);
    old.swap(slots_);
    for (const Slot& slot : old) {
      if (slot.key == 0) continue;
      std::size_t i = hash(slot.key) & mask();
      while (slots_[i].key != 0) i = (i + 1) & mask();
      slots_[i] = slot;
    }
  }

  std::vector<Slot> slots_ = std::vector<Slot>(64);
  std::uint32_t count_ = 0;
};

}  // namespace isoreel
