// SPDX-License-Identifier: BSD-3-Clause
// The sparse octree of the sign bitmap, built bottom-up, and the Truth that the sign coder asks (paper,
// section 2).
#pragma once

#include <span>
#include <vector>

#include "extract/sign_bitmap.h"
#include "intra/sign_tree.h"

namespace isoreel {

/// Which cells of each level hold a sign change. A cell does when one of its children does, since homogeneous
/// neighbours share nodes and so agree.
class SparseOctree {
 public:
  SparseOctree(std::span<const Cell> active, std::uint32_t depth) : levels_(depth + 1) {
    levels_[depth].reserve(active.size());
    for (const Cell& cell : active) levels_[depth].push_back(mortonCode(cell.x, cell.y, cell.z));
    for (std::uint32_t level = depth; level > 0; --level) {
      for (const std::uint64_t code : levels_[level]) {
        if (levels_[level - 1].empty() || levels_[level - 1].back() != code >> 3)
          levels_[level - 1].push_back(code >> 3);
      }
    }
  }
  /// Morton codes, rising.
  const std::vector<std::uint64_t>& level(std::uint32_t level) const { return levels_[level]; }

 private:
  std::vector<std::vector<std::uint64_t>> levels_;
};

class OctreeTruth {
 public:
  OctreeTruth(const SignBitmap& bitmap, const SparseOctree& octree) : bitmap_(bitmap), octree_(octree) {}

  bool sign(const LevelLattice& lattice, int x, int y, int z) const {
    return bitmap_.at(static_cast<std::uint32_t>(x) << lattice.shift,
                      static_cast<std::uint32_t>(y) << lattice.shift,
                      static_cast<std::uint32_t>(z) << lattice.shift);
  }
  // Asked in Morton order within a level: one step forward at a time.
  bool divided(std::uint32_t level, const Cell& cell) {
    if (level != level_) {
      level_ = level;
      next_ = 0;
    }
    const std::vector<std::uint64_t>& codes = octree_.level(level);
    const std::uint64_t code = mortonCode(cell.x, cell.y, cell.z);
    while (next_ < codes.size() && codes[next_] < code) ++next_;
    return next_ < codes.size() && codes[next_] == code;
  }

 private:
  const SignBitmap& bitmap_;
  const SparseOctree& octree_;
  std::uint32_t level_ = 0;
  std::size_t next_ = 0;
};

}  // namespace isoreel
