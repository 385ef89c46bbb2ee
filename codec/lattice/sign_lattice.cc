// SPDX-License-Identifier: BSD-3-Clause
#include "lattice/sign_lattice.h"

namespace isoreel {
namespace {

// Which of a block's coordinates -1 … 9 lie in the brick `offset` (-1, 0, 1) of an axis.
struct Range {
  int first;
  int last;
};
constexpr Range range(int offset) {
  return offset < 0 ? Range{-1, -1} : offset == 0 ? Range{0, 7} : Range{8, 9};
}

}  // namespace

void SignLattice::load(std::int32_t bx, std::int32_t by, std::int32_t bz, SignBlock& block) const {
  block.known.fill(0);
  block.inside.fill(0);
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const std::uint32_t number = map_.find(bx + dx, by + dy, bz + dz);
        if (number == BrickMap::kNone) continue;
        const Brick& brick = bricks_[number];
        // Bits of a brick's row as they stand in the block's row.
        const auto place = [dx](std::uint32_t byte) {
          return static_cast<std::uint16_t>(dx < 0 ? byte >> 7 : dx == 0 ? byte << 1 : (byte & 3) << 9);
        };
        for (int z = range(dz).first; z <= range(dz).last; ++z) {
          const std::uint64_t known = brick.known[static_cast<std::size_t>(z & 7)];
          const std::uint64_t inside = brick.inside[static_cast<std::size_t>(z & 7)];
          if (known == 0) continue;
          for (int y = range(dy).first; y <= range(dy).last; ++y) {
            const std::size_t row = SignBlock::row(y, z);
            block.known[row] =
                static_cast<std::uint16_t>(block.known[row] | place((known >> (8 * (y & 7))) & 0xFF));
            block.inside[row] =
                static_cast<std::uint16_t>(block.inside[row] | place((inside >> (8 * (y & 7))) & 0xFF));
          }
        }
      }
    }
  }
}

void SignLattice::store(std::int32_t bx, std::int32_t by, std::int32_t bz, const SignBlock& block) {
  for (int dz = 0; dz <= 1; ++dz) {
    for (int dy = 0; dy <= 1; ++dy) {
      for (int dx = 0; dx <= 1; ++dx) {
        std::array<std::uint64_t, 8> known{};
        std::array<std::uint64_t, 8> inside{};
        std::uint64_t any = 0;
        const auto bits = [dx](std::uint16_t row) -> std::uint64_t {
          return dx == 0 ? (row >> 1) & 0xFF : (row >> 9) & 1;
        };
        for (int z = 8 * dz; z <= (dz == 0 ? 7 : 8); ++z) {
          for (int y = 8 * dy; y <= (dy == 0 ? 7 : 8); ++y) {
            const std::size_t row = SignBlock::row(y, z);
            known[static_cast<std::size_t>(z & 7)] |= bits(block.known[row]) << (8 * (y & 7));
            inside[static_cast<std::size_t>(z & 7)] |= bits(block.inside[row]) << (8 * (y & 7));
          }
          any |= known[static_cast<std::size_t>(z & 7)];
        }
        if (any == 0) continue;
        const std::uint32_t number = map_.findOrAdd(bx + dx, by + dy, bz + dz);
        if (number == bricks_.size()) bricks_.emplace_back();
        for (std::size_t z = 0; z < 8; ++z) {
          bricks_[number].known[z] |= known[z];
          bricks_[number].inside[z] |= inside[z];
        }
      }
    }
  }
}

}  // namespace isoreel
