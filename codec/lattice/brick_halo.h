// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <utility>

#ifdef __SSE2__
#include <immintrin.h>
#endif

namespace isoreel {

/// The places of the 6×6×6 cells from -1 to 4 around a brick of 4×4×4: a neighbour is a difference of slots.
class BrickHalo {
 public:
  static constexpr std::size_t kSlots = 216;
  static constexpr std::uint32_t kNone = 0xFFFFFFFF;
  static constexpr std::size_t slot(int x, int y, int z) {
    return static_cast<std::size_t>(x + 1 + 6 * (y + 1) + 36 * (z + 1));
  }

  /// The cells of a brick: where the list has the first one, and by x + 4y + 16z how many come before it, or
  /// -1 where there is none.
  struct Own {
    std::array<std::int16_t, 64> ranks;
    std::uint32_t first;
  };
  /// Of a cell with this rank, or kNone.
  static std::uint32_t place(std::uint32_t first, std::int32_t rank) {
    return (first + static_cast<std::uint32_t>(rank)) | static_cast<std::uint32_t>(rank >> 31);
  }
  static constexpr Own kEmpty = [] {
    Own own{};
    own.ranks.fill(-1);
    return own;
  }();

  /// Fills the slots. `owns`: by number of brick, `around`: the numbers of the 27, as of CellIndex.
  void gather(const Own* owns, const std::array<std::uint32_t, 27>& around) {
    gather(owns, around, std::make_index_sequence<27>());
  }
  /// Those of the brick itself, and those next to them that are lower along any axes.
  void gatherLower(const Own* owns, const std::array<std::uint32_t, 27>& around) {
    gather(owns, around, std::index_sequence<0, 1, 3, 4, 9, 10, 12, 13>());
  }
  /// Those of the brick itself, and those across its faces.
  void gatherFaces(const Own* owns, const std::array<std::uint32_t, 27>& around) {
    gather(owns, around, std::index_sequence<4, 10, 12, 13, 14, 16, 22>());
  }
  /// The place of the cell in a slot, or kNone.
  std::uint32_t operator[](std::size_t slot) const { return places_[slot]; }

 private:
  template <std::size_t... N>
  void gather(const Own* owns, const std::array<std::uint32_t, 27>& around, std::index_sequence<N...>) {
    (put<static_cast<int>(N)>(owns[around[N]]), ...);
  }
  // The cells of the brick at one offset.
  template <int N>
  void put(const Own& own) {
    constexpr int kX = N % 3 - 1, kY = N / 3 % 3 - 1, kZ = N / 9 - 1;
    constexpr auto kFirst = [](int d) { return d < 0 ? 3 : 0; };
    constexpr auto kLast = [](int d) { return d > 0 ? 0 : 3; };
    for (int z = kFirst(kZ); z <= kLast(kZ); ++z) {
      for (int y = kFirst(kY); y <= kLast(kY); ++y) {
        const std::int16_t* const from = own.ranks.data() + kFirst(kX) + 4 * y + 16 * z;
        std::uint32_t* const to = places_.data() + slot(kFirst(kX) + 4 * kX, y + 4 * kY, z + 4 * kZ);
        if constexpr (kX == 0) {
          putRow(own.first, from, to);
        } else {
          *to = place(own.first, *from);
        }
      }
    }
  }
  static void putRow(std::uint32_t first, const std::int16_t* ranks, std::uint32_t* to) {
#ifdef __SSE2__
    __m128i rank = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(ranks));
    rank = _mm_srai_epi32(_mm_unpacklo_epi16(rank, rank), 16);
    const __m128i places = _mm_or_si128(_mm_add_epi32(rank, _mm_set1_epi32(static_cast<std::int32_t>(first))),
                                        _mm_srai_epi32(rank, 31));
    _mm_storeu_si128(reinterpret_cast<__m128i*>(to), places);
#else
    for (int i = 0; i < 4; ++i) to[i] = place(first, ranks[i]);
#endif
  }

  std::array<std::uint32_t, kSlots> places_;
};

}  // namespace isoreel
