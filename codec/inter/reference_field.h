// SPDX-License-Identifier: BSD-3-Clause
// The signed distance field of the previous surface in a narrow band around it (spec codec 8.4; paper,
// section 4.3).
#pragma once

#include <isoreel/base/parallel.h>
#include <isoreel/codec/surface.h>

#include <limits>
#include <span>
#include <vector>

#include "inter/corner_values.h"
#include "lattice/brick_map.h"
#include "lattice/set_size.h"

namespace isoreel {

/// A vertex of the previous surface with its tangent plane.
struct ReferencePlane {
  GridPosition position;
  std::array<std::int32_t, 3> normal{};  // unit, towards the outside, in 1/4096
};

/// Distances at the nodes around the surface, in 1/4096 of a cell, outside positive: each node's to the plane
/// of the vertex nearest to it, of those that have it among the 27 nodes around their own nearest one. Memory
/// follows the surface. It is built in waves: of bricks that have all their vertices only the distances stay.
class ReferenceField {
 public:
  /// Positions not below 0, in any order; the fewer bricks between neighbours in it, the faster, and the less
  /// memory it takes meanwhile. False, and an empty field, when it would take more than `most` bytes at any
  /// time: small pieces of a surface, each in bricks of its own, take up to 10 kilobytes a vertex.
  bool build(std::span<const ReferencePlane> planes,
             std::uint64_t most = std::numeric_limits<std::uint64_t>::max(),
             const ParallelFor& parallel = serialFor);
  /// Keeps its memory.
  void clear();
  /// Memory beyond the object itself.
  std::uint64_t bytes() const { return map_.bytes() + bytesOf(places_) + bytesOf(bricks_); }

 private:
  // 9×9×9 nodes: neighbouring bricks share those of their faces, so that the eight nodes of any cell are in
  // one.
  static constexpr int kSideLog2 = 3;
  static constexpr std::int32_t kSide = 1 << kSideLog2;
  static constexpr std::int32_t kRow = kSide + 1, kPlane = kRow * kRow;
  using Brick = std::array<std::int16_t, std::size_t{kSide + 1} * kPlane>;

  struct Place {
    std::int32_t x, y, z;  // coordinates / 8
  };
  class Builder;

  BrickMap map_;
  std::vector<Place> places_;
  std::vector<Brick> bricks_;

 public:
  /// Looks places up; remembers the bricks of the last ones. One for each thread, for a field that stays as
  /// it is meanwhile.
  class Cursor {
   public:
    explicit Cursor(const ReferenceField& field) : field_(field) {}

    /// The distances at the eight corners of the cell that holds a place, 1/16384 of a cell; anywhere.
    CornerValues around(const std::array<std::int32_t, 3>& place) {
      const std::int16_t* const corner = nodeOf(place);
      return corner == nullptr ? CornerValues::unknown() : CornerValues::load<kRow, kPlane>(corner);
    }
    /// That at the lowest of these corners.
    std::int16_t lowest(const std::array<std::int32_t, 3>& place) {
      const std::int16_t* const corner = nodeOf(place);
      return corner == nullptr ? CornerValues::kUnknown : *corner;
    }

   private:
    struct Found {
      std::array<std::int32_t, 3> brick{std::numeric_limits<std::int32_t>::min(), 0, 0};
      const std::int16_t* nodes = nullptr;
    };
    Found look(const std::array<std::int32_t, 3>& brick) const;

    /// The lowest corner of the cell that holds a place, in the brick that has all eight; or null.
    const std::int16_t* nodeOf(const std::array<std::int32_t, 3>& place) {
      constexpr int kBrickBits = kPositionBits + kSideLog2;
      const std::array<std::int32_t, 3> brick{place[0] >> kBrickBits, place[1] >> kBrickBits,
                                              place[2] >> kBrickBits};
      // A block of motion, wherever it is moved to, is in no two bricks with the same lowest bits.
      Found& found =
          found_[static_cast<std::size_t>((brick[0] & 1) | (brick[1] & 1) << 1 | (brick[2] & 1) << 2)];
      if (((brick[0] ^ found.brick[0]) | (brick[1] ^ found.brick[1]) | (brick[2] ^ found.brick[2])) != 0)
        found = look(brick);
      if (found.nodes == nullptr) return nullptr;
      constexpr std::int32_t kInBrick = kSide - 1;
      return found.nodes + (place[2] >> kPositionBits & kInBrick) * kPlane +
             (place[1] >> kPositionBits & kInBrick) * kRow + (place[0] >> kPositionBits & kInBrick);
    }

    const ReferenceField& field_;
    std::array<Found, 8> found_;
  };
};

}  // namespace isoreel
