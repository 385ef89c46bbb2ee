// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/codec/grid.h>

#include <cmath>

namespace isoreel {

/// A block of a P frame: an aligned cube of cells that the surface passes through, and how its piece of the
/// surface was predicted (spec codec 8.2).
struct MotionBlock {
  std::array<std::int32_t, 3> cell{};  // its first one, along each axis
  std::int32_t side = 0;               // in cells
  std::uint32_t first = 0;             // its vertices in Surface::vertices are those from here on,
  std::uint32_t vertices = 0;          // so many: 1 or more
  std::uint32_t predicted = 0;         // of these, from the surface of the frame before
  bool moves = false;                  // false: an I block, coded as in an I frame
  /// From this frame's surface to where it was in the frame before, at most 64 cells along an axis; 1/16384
  /// of a cell. What moves along +x has a vector along -x. Zero for an I block.
  std::array<std::int32_t, 3> vector{};

  /// How far the block's piece of surface moved since the frame before, in cells.
  double speed() const { return std::hypot(vector[0], vector[1], vector[2]) / kCell; }
};

}  // namespace isoreel
