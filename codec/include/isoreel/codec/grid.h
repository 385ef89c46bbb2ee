// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/base/status.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace isoreel {

using Vec3d = std::array<double, 3>;
/// A position in grid space: 1/16384 of a cell, from node (0, 0, 0). Never negative in a surface.
using GridPosition = std::array<std::int32_t, 3>;

inline constexpr int kPositionBits = 14;
inline constexpr std::int32_t kCell = std::int32_t{1} << kPositionBits;
/// Nodes along one axis (spec codec 2): a position fits 31 bits.
inline constexpr std::uint32_t kMinNodes = 2;
inline constexpr std::uint32_t kMaxNodes = 1u << 16;

/// A grid of nx × ny × nz nodes, x fastest, and where it lies in the world:
/// world = origin + direction · (spacing ⊙ node). `direction` is row-major 3×3; its columns are the world
/// directions of the grid's axes (the identity unless a reader finds better).
struct Grid {
  std::array<std::uint32_t, 3> nodes{2, 2, 2};
  Vec3d origin{0, 0, 0};
  Vec3d spacing{1, 1, 1};
  std::array<double, 9> direction{1, 0, 0, 0, 1, 0, 0, 0, 1};

  bool operator==(const Grid&) const = default;

  std::size_t nodeCount() const { return std::size_t{nodes[0]} * nodes[1] * nodes[2]; }
  std::size_t nodeIndex(std::uint32_t x, std::uint32_t y, std::uint32_t z) const {
    return (std::size_t{z} * nodes[1] + y) * nodes[0] + x;
  }
  /// World coordinates of a point given in cells from node (0, 0, 0).
  Vec3d world(const Vec3d& cells) const {
    Vec3d result = origin;
    for (std::size_t row = 0; row < 3; ++row) {
      for (std::size_t axis = 0; axis < 3; ++axis)
        result[row] += direction[3 * row + axis] * spacing[axis] * cells[axis];
    }
    return result;
  }
  Vec3d world(const GridPosition& p) const {
    return world(Vec3d{static_cast<double>(p[0]) / kCell, static_cast<double>(p[1]) / kCell,
                       static_cast<double>(p[2]) / kCell});
  }
};

/// The depth of the octree over a grid, which is also its deepest level: its root is the smallest cube of
/// 2^depth cells that holds the grid (spec codec 4.1).
inline std::uint32_t octreeDepth(const Grid& grid) {
  const std::uint32_t cells = std::max({grid.nodes[0], grid.nodes[1], grid.nodes[2]}) - 1;
  return static_cast<std::uint32_t>(std::bit_width(cells - 1));
}

/// OK, or the rule of spec codec 2 that the grid breaks: nodes from 2 to 65536 a side, finite placement,
/// spacing above 0.
Status checkGrid(const Grid& grid);

}  // namespace isoreel
