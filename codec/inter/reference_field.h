// SPDX-License-Identifier: BSD-3-Clause
// The signed distance field of the previous surface in a narrow band around it (spec codec 8.4; paper,
// section 4.3).
#pragma once

#include <isoreel/codec/surface.h>

#include <limits>
#include <span>
#include <vector>

#include "inter/corner_values.h"
#include "lattice/brick_map.h"

namespace isoreel {

/// A vertex of the previous surface with its tangent plane.
struct ReferencePlane {
  GridPosition position;
  std::array<std::int32_t, 3> normal{};  // unit, towards the outside, in 1/4096
};

/// Distances at the nodes around the surface, in 1/4096 of a cell, outside positive: each node's to the plane
/// of the vertex nearest to it, of those that have it among the 27 nodes around their own nearest one. Memory
/// follows the surface.
class ReferenceField {
 public:
  /// Positions not below 0, in any order.
  void build(std::span<const ReferencePlane> planes);
  /// Memory beyond the object itself.
  std::uint64_t bytes() const { return map_.bytes() + bricks_.capacity() * sizeof(Brick); }

 private:
  // 17×17×17 nodes: neighbouring bricks share those of their faces, so that the eight nodes of any cell are
  // in one. Rows have room on both sides, since the build writes four nodes at a time. A node is a number
  // whose high half is the squared distance of the nearest vertex, 1/4096 of a cell squared, and whose low
  // half is the plane's distance + 32768: the least is the nearest.
  static constexpr int kSideLog2 = 3;
  static constexpr std::int32_t kSide = 1 << kSideLog2;
  static constexpr std::int32_t kBefore = 2, kRow = kBefore + kSide + 4, kPlane = (kSide + 1) * kRow;
  using Brick = std::array<std::int32_t, std::size_t{kSide + 1} * kPlane>;
  struct Recent {
    std::int32_t x = -1, y = 0, z = 0;
    std::uint32_t number = 0;
  };

  void add(const ReferencePlane& plane);
  Brick& brickAt(std::int32_t x, std::int32_t y, std::int32_t z);

  BrickMap map_;
  std::vector<Brick> bricks_;
  std::array<Recent, 8> recent_{};  // the last brick found, by the lowest bits of its coordinates

 public:
  /// Looks places up; remembers the brick of the last one. One for each thread, for a field that stays as it
  /// is meanwhile.
  class Cursor {
   public:
    explicit Cursor(const ReferenceField& field) : field_(field) {}

    /// The distances at the eight corners of the cell that holds a place, 1/16384 of a cell; anywhere.
    CornerValues around(const std::array<std::int32_t, 3>& place) {
      constexpr int kBrickBits = kPositionBits + kSideLog2;
      const std::array<std::int32_t, 3> brick{place[0] >> kBrickBits, place[1] >> kBrickBits,
                                              place[2] >> kBrickBits};
      if (brick != brick_) look(brick);
      if (nodes_ == nullptr) return CornerValues::unknown();
      constexpr std::int32_t kInBrick = kSide - 1;
      return CornerValues::load<kRow, kPlane>(nodes_ + (place[2] >> kPositionBits & kInBrick) * kPlane +
                                              (place[1] >> kPositionBits & kInBrick) * kRow +
                                              (place[0] >> kPositionBits & kInBrick) + kBefore);
    }

   private:
    void look(const std::array<std::int32_t, 3>& brick);

    const ReferenceField& field_;
    std::array<std::int32_t, 3> brick_{-2, -2, -2};
    const std::int32_t* nodes_ = nullptr;
  };
};

}  // namespace isoreel
