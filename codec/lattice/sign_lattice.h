// SPDX-License-Identifier: BSD-3-Clause
// The signs that are known so far on the lattice of one octree level, in sparse bricks of 8×8×8 nodes.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "lattice/brick_map.h"

namespace isoreel {

/// The 11×11×11 nodes from -1 to 9 around a brick: what the contexts of its nodes can see. Rows run along x,
/// bit x + 1. A node that is not known has both bits clear.
struct SignBlock {
  static constexpr int kSide = 11;
  std::array<std::uint16_t, kSide * kSide> known;
  std::array<std::uint16_t, kSide * kSide> inside;

  static std::size_t row(int y, int z) { return static_cast<std::size_t>((z + 1) * kSide + y + 1); }
  bool isKnown(int x, int y, int z) const { return (known[row(y, z)] >> (x + 1)) & 1; }
  bool isInside(int x, int y, int z) const { return (inside[row(y, z)] >> (x + 1)) & 1; }
  void set(int x, int y, int z, bool sign) {
    known[row(y, z)] = static_cast<std::uint16_t>(known[row(y, z)] | 1u << (x + 1));
    inside[row(y, z)] = static_cast<std::uint16_t>(inside[row(y, z)] | unsigned{sign} << (x + 1));
  }
  /// The 3×3×3 nodes around (x, y, z), bit (dx + 1) + 3 (dy + 1) + 9 (dz + 1).
  static std::uint32_t neighbours(const std::array<std::uint16_t, kSide * kSide>& rows, int x, int y, int z) {
    std::uint32_t bits = 0;
    for (int dz = -1, shift = 0; dz <= 1; ++dz) {
      for (int dy = -1; dy <= 1; ++dy, shift += 3) {
        bits |= ((static_cast<std::uint32_t>(rows[row(y + dy, z + dz)]) >> x) & 7u) << shift;
      }
    }
    return bits;
  }
};

class SignLattice {
 public:
  void clear() {
    map_.clear();
    bricks_.clear();
  }
  /// The block around the brick at brick coordinates (node coordinates / 8).
  void load(std::int32_t bx, std::int32_t by, std::int32_t bz, SignBlock& block) const;
  /// Adds what the block knows of nodes 0 to 8, making bricks where there are none.
  void store(std::int32_t bx, std::int32_t by, std::int32_t bz, const SignBlock& block);

 private:
  struct Brick {
    std::array<std::uint64_t, 8> known{};  // plane z, byte y, bit x
    std::array<std::uint64_t, 8> inside{};
  };
  BrickMap map_;
  std::vector<Brick> bricks_;
};

}  // namespace isoreel
