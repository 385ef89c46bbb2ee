// SPDX-License-Identifier: BSD-3-Clause
// The nodes that a cell's children add to its corners (spec codec 4.3), and tables over sets of them.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "lattice/sign_block.h"

namespace isoreel {

/// A node, from the lowest corner of the cell, in steps of its children's lattice: each 0 to 2.
struct alignas(8) NewNode {
  std::uint8_t x, y, z;
  std::uint8_t window;  // the first of three that SignBlock::around takes, from the cell's first
  std::uint8_t shift;   // and how far the lowest node around lies in it
  std::uint8_t corner;  // of the cell: a leaf beside the cell on which the node lies has this corner too

  constexpr NewNode(int dx, int dy, int dz)
      : x(static_cast<std::uint8_t>(dx)),
        y(static_cast<std::uint8_t>(dy)),
        z(static_cast<std::uint8_t>(dz)),
        window(static_cast<std::uint8_t>(SignBlock::kNextPlane * dz)),
        shift(static_cast<std::uint8_t>(SignWindow::kLane * dy + dx)),
        corner(static_cast<std::uint8_t>(dx >> 1 | dy >> 1 << 1 | dz >> 1 << 2)) {}
};

/// In the order of their coding: the cell's middle, the middles of its faces, then of its edges. A set of
/// them has bit i for node i.
inline constexpr std::array<NewNode, 19> kNewNodes{{{1, 1, 1},
                                                    {1, 1, 0},
                                                    {1, 0, 1},
                                                    {0, 1, 1},
                                                    {1, 1, 2},
                                                    {1, 2, 1},
                                                    {2, 1, 1},
                                                    {1, 0, 0},
                                                    {0, 1, 0},
                                                    {0, 0, 1},
                                                    {1, 2, 0},
                                                    {2, 1, 0},
                                                    {1, 0, 2},
                                                    {0, 1, 2},
                                                    {2, 0, 1},
                                                    {0, 2, 1},
                                                    {1, 2, 2},
                                                    {2, 1, 2},
                                                    {2, 2, 1}}};
inline constexpr std::uint32_t kAllNewNodes = (1u << kNewNodes.size()) - 1;

/// The new nodes that also lie on one of the cells around; cells as of CellBlock::around.
inline std::uint32_t newNodesOn(std::uint32_t cells) {
  // For each dy, the nodes on any of the nine cells.
  static constexpr auto kNodes = [] {
    std::array<std::array<std::uint32_t, 512>, 3> nodes{};
    const auto touches = [](int node, int cell) { return cell == 1 || node == cell; };
    for (int dy = 0; dy < 3; ++dy) {
      auto& sets = nodes[static_cast<std::size_t>(dy)];
      for (std::uint32_t cell = 0; cell < 9; ++cell) {
        const int dx = static_cast<int>(cell % 3), dz = static_cast<int>(cell / 3);
        std::uint32_t set = 0;
        for (std::size_t i = 0; i < kNewNodes.size(); ++i) {
          const NewNode& node = kNewNodes[i];
          if (touches(node.x, dx) && touches(node.y, dy) && touches(node.z, dz)) set |= 1u << i;
        }
        if (dx == 1 && dy == 1 && dz == 1) set = 0;  // the cell itself
        for (std::uint32_t others = 0; others < 1u << cell; ++others)
          sets[others | 1u << cell] = sets[others] | set;
      }
    }
    return nodes;
  }();
  return kNodes[0][cells & 511] | kNodes[1][cells >> 9 & 511] | kNodes[2][cells >> 18];
}

/// The new nodes that are no more than room[axis] steps along each axis from the cell's lowest corner.
inline std::uint32_t newNodesWithin(const std::array<std::int32_t, 3>& room) {
  static constexpr auto kNodes = [] {
    std::array<std::array<std::uint32_t, 3>, 3> nodes{};
    for (std::size_t i = 0; i < kNewNodes.size(); ++i) {
      const std::array<std::uint8_t, 3> at{kNewNodes[i].x, kNewNodes[i].y, kNewNodes[i].z};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        for (std::size_t limit = at[axis]; limit < 3; ++limit) nodes[axis][limit] |= 1u << i;
      }
    }
    return nodes;
  }();
  std::uint32_t result = kAllNewNodes;
  for (std::size_t axis = 0; axis < 3; ++axis)
    result &= kNodes[axis][static_cast<std::size_t>(std::clamp(room[axis], 0, 2))];
  return result;
}

/// A set of new nodes as SignBlock::around has the cell's 27 nodes.
inline std::uint64_t newNodesAround(std::uint32_t set) {
  // By the first seven, the next six, the last six.
  static constexpr auto kNodes = [] {
    std::array<std::array<std::uint64_t, 128>, 3> nodes{};
    for (std::size_t i = 0; i < kNewNodes.size(); ++i) {
      const std::size_t part = i < 7 ? 0 : i < 13 ? 1 : 2, bit = i - (part == 0 ? 0 : part == 1 ? 7 : 13);
      const NewNode& node = kNewNodes[i];
      for (std::size_t others = 0; others < std::size_t{1} << bit; ++others) {
        nodes[part][others | std::size_t{1} << bit] =
            nodes[part][others] | std::uint64_t{1} << (node.x + 3 * node.z + SignWindow::kLane * node.y);
      }
    }
    return nodes;
  }();
  return kNodes[0][set & 127] | kNodes[1][set >> 7 & 63] | kNodes[2][set >> 13];
}

/// The new nodes whose corner (see NewNode) is inside.
inline std::uint32_t newNodesLike(std::uint8_t corners) {
  static constexpr auto kNodes = [] {
    std::array<std::uint32_t, 256> nodes{};
    for (std::size_t c = 0; c < nodes.size(); ++c) {
      for (std::size_t i = 0; i < kNewNodes.size(); ++i)
        nodes[c] |= static_cast<std::uint32_t>(c >> kNewNodes[i].corner & 1) << i;
    }
    return nodes;
  }();
  return kNodes[corners];
}

/// The signs of a cell's 27 nodes, as SignBlock::around has them, with those that are more than room[axis]
/// steps from the lowest corner made as the last one inside the grid (spec codec 4.1).
inline std::uint64_t signsInGrid(std::uint64_t signs, const std::array<std::int32_t, 3>& room) {
  // The lowest nodes along each axis, and the way to the next.
  constexpr std::array<std::uint64_t, 3> kPlanes{0x49 * SignWindow::kLanes, 0x1FF, 7 * SignWindow::kLanes};
  constexpr std::array<int, 3> kStrides{1, SignWindow::kLane, 3};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (int node = room[axis] + 1; node <= 2; ++node) {
      const std::uint64_t inside = signs >> (kStrides[axis] * (node - 1)) & kPlanes[axis];
      signs = (signs & ~(kPlanes[axis] << kStrides[axis] * node)) | inside << kStrides[axis] * node;
    }
  }
  return signs;
}

/// The corners of a cell's eight children, a byte each, from the signs of its 27 nodes.
inline std::uint64_t cornersOfChildren(std::uint64_t signs) {
  // From nodes with the same dy: what they are as the lower corners of the children on that side.
  static constexpr auto kLower = [] {
    std::array<std::uint64_t, 512> corners{};
    for (std::size_t node = 0; node < 9; ++node) {
      std::uint64_t bits = 0;
      for (std::size_t z = 0; z < 2; ++z) {
        for (std::size_t x = 0; x < 2; ++x) {
          for (std::size_t corner = 0; corner < 8; ++corner) {
            if ((corner & 2) == 0 && node == x + (corner & 1) + 3 * (z + (corner >> 2)))
              bits |= std::uint64_t{1} << (8 * (x + 4 * z) + corner);
          }
        }
      }
      for (std::size_t others = 0; others < std::size_t{1} << node; ++others)
        corners[others | std::size_t{1} << node] = corners[others] | bits;
    }
    return corners;
  }();
  const std::uint64_t low = kLower[signs & 511], middle = kLower[signs >> SignWindow::kLane & 511],
                      high = kLower[signs >> 2 * SignWindow::kLane & 511];
  return low | middle << 2 | (middle | high << 2) << 16;
}

/// Which of eight children are active: a bit each, from their corners, a byte each.
inline std::uint32_t activeChildren(std::uint64_t corners) {
  constexpr std::uint64_t kLow = 0x7F7F7F7F7F7F7F7F;
  const auto filled = [](std::uint64_t v) {
    return ((v & kLow) + kLow) | v;
  };  // bit 7 of each byte that is not 0
  return static_cast<std::uint32_t>((filled(corners) & filled(~corners) & ~kLow) / 128 * 0x0102040810204080 >>
                                    56);
}

}  // namespace isoreel
