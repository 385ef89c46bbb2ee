// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>

namespace isoreel {

/// A bit for each of the 6×6×6 cells from -1 to 4 around a brick of 4×4×4 cells.
class CellBlock {
 public:
  static constexpr int kLane = 9;  // a row's place in its plane: so three planes of 3×3 cells interleave

  /// The cells from `first` to `last`, both -1 to 4.
  static CellBlock box(const std::array<std::int32_t, 3>& first, const std::array<std::int32_t, 3>& last) {
    std::uint64_t plane = 0;
    for (int y = first[1]; y <= last[1]; ++y) plane |= 2 * bit(last[0], y) - bit(first[0], y);
    CellBlock result;
    for (int z = first[2]; z <= last[2]; ++z) result.planes_[static_cast<std::size_t>(z + 1)] = plane;
    return result;
  }

  /// Adds the cells of the brick at an offset, numbered as in CellIndex::Around; `rows` as of
  /// CellIndex::Brick.
  void add(std::uint64_t rows, std::uint32_t offset) {
    static constexpr auto kMoves = [] {
      std::array<Move, 27> moves{};
      for (int n = 0; n < 27; ++n) {
        const int dx = n % 3 - 1, dy = n / 3 % 3 - 1;
        Move& move = moves[static_cast<std::size_t>(n)];
        move.from = (dx < 0 ? 8u : dx > 0 ? 1u : 15u) * (dy < 0 ? 0x1000u : dy > 0 ? 1u : 0x1111u);
        move.left = static_cast<std::uint8_t>((dx < 0   ? 0
                                               : dx > 0 ? 5
                                                        : 1) +
                                              kLane * (dy < 0   ? 0
                                                       : dy > 0 ? 5
                                                                : 1));
        move.right = static_cast<std::uint8_t>((dx < 0 ? 3 : 0) + kLane * (dy < 0 ? 3 : 0));
      }
      return moves;
    }();
    const Move& move = kMoves[offset];
    const auto plane = [&](std::uint64_t from) {
      from &= move.from;
      const std::uint64_t lanes =
          (from & 0xF) | (from & 0xF0) << 5 | (from & 0xF00) << 10 | (from & 0xF000) << 15;
      return lanes << move.left >> move.right;
    };
    if (offset < 9) {
      planes_[0] |= plane(rows >> 48);
    } else if (offset < 18) {
      for (std::size_t z = 0; z < 4; ++z) planes_[z + 1] |= plane(rows >> 16 * z);
    } else {
      planes_[5] |= plane(rows);
    }
  }
  void add(int x, int y, int z) { planes_[static_cast<std::size_t>(z + 1)] |= bit(x, y); }
  bool has(int x, int y, int z) const { return (planes_[static_cast<std::size_t>(z + 1)] & bit(x, y)) != 0; }
  /// Cells that are in this block and not in the other.
  CellBlock without(const CellBlock& other) const {
    CellBlock result;
    for (std::size_t z = 0; z < 6; ++z) result.planes_[z] = planes_[z] & ~other.planes_[z];
    return result;
  }
  /// The 3×3×3 cells around (x, y, z), 0 to 3: bit (dx + 1) + 3 (dz + 1) + 9 (dy + 1).
  std::uint32_t around(int x, int y, int z) const {
    constexpr std::uint64_t kSquare = 7 | 7 << kLane | 7 << 2 * kLane;
    const std::uint64_t* at = &planes_[static_cast<std::size_t>(z)];
    const int shift = kLane * y + x;
    return static_cast<std::uint32_t>((at[0] >> shift & kSquare) | (at[1] >> shift & kSquare) << 3 |
                                      (at[2] >> shift & kSquare) << 6);
  }

 private:
  // Which cells of a plane of another brick are near, and how far they go.
  struct Move {
    std::uint32_t from;
    std::uint8_t left, right;
  };
  static std::uint64_t bit(int x, int y) { return std::uint64_t{1} << (kLane * (y + 1) + x + 1); }

  std::array<std::uint64_t, 6> planes_{};  // by z + 1; row y at lane y + 1, bit x + 1 of a lane
};

}  // namespace isoreel
