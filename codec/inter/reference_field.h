// SPDX-License-Identifier: BSD-3-Clause
// The signed distance field of the previous surface in a narrow band around it (spec codec 8.4; paper,
// section 4.3).
#pragma once

#include <isoreel/codec/surface.h>

#include <limits>
#include <span>
#include <vector>

#include "lattice/brick_map.h"

namespace isoreel {

/// A vertex of the previous surface with its tangent plane.
struct ReferencePlane {
  GridPosition position;
  std::array<std::int32_t, 3> normal{};  // unit, towards the outside, in 1/4096
};

/// Distances at the nodes around the surface: each node's to the plane of the vertex nearest to it, of those
/// that have it among the 27 nodes around their own nearest one. Memory follows the surface.
class ReferenceField {
 public:
  /// Of a node, in 1/8192 of a cell, outside positive.
  using Distance = std::int16_t;
  static constexpr int kDistanceBits = 13;
  static constexpr std::int32_t kFarthest = 12288;  // 1.5 cells: what is further counts as that
  static constexpr Distance kUnknown = std::numeric_limits<Distance>::min();

  /// `planes` in the order of their cells, positions not below 0.
  void build(std::span<const ReferencePlane> planes);

 private:
  // 9×9×9 nodes: neighbouring bricks share those of their faces, so that the eight nodes of any cell are in
  // one. Rows have room on both sides, since the build writes four nodes at a time.
  static constexpr std::int32_t kSide = 8;
  static constexpr std::int32_t kBefore = 2, kRow = kBefore + kSide + 4, kPlane = (kSide + 1) * kRow;
  using Brick = std::array<std::int16_t, std::size_t{kSide + 1} * kPlane>;

  void add(const ReferencePlane& plane);

  BrickMap map_;
  std::vector<Brick> distances_;
  std::vector<Brick> nearest_;  // squared distance of the vertex nearest so far, 1/4096 of a cell squared

 public:
  /// Looks places up; remembers the brick of the last one. One for each thread, for a field that stays as it
  /// is meanwhile.
  class Cursor {
   public:
    explicit Cursor(const ReferenceField& field) : field_(field) {}

    /// The distances at the eight corners of a cell, x fastest; false when one is not known. Any coordinates.
    bool corners(const std::array<std::int32_t, 3>& cell, std::array<std::int32_t, 8>& result) {
      const std::array<std::int32_t, 3> brick{cell[0] >> 3, cell[1] >> 3, cell[2] >> 3};
      if (brick != brick_) look(brick);
      if (distances_ == nullptr) return false;
      const Distance* const at =
          distances_ + (cell[2] & 7) * kPlane + (cell[1] & 7) * kRow + (cell[0] & 7) + kBefore;
      const std::array<Distance, 8> found{at[0],      at[1],          at[kRow],          at[kRow + 1],
                                          at[kPlane], at[kPlane + 1], at[kPlane + kRow], at[kPlane + kRow + 1]};
      bool known = true;
      for (std::size_t i = 0; i < 8; ++i) {
        result[i] = found[i];
        known &= found[i] != kUnknown;
      }
      return known;
    }

    /// The distance at a place of the grid (1/16384 of a cell) between nodes, in 1/8192 of a cell; kUnknown when that of a
    /// node around it is not known.
    std::int32_t at(const std::array<std::int32_t, 3>& place) {
      std::array<std::int32_t, 8> v{};
      if (!corners({place[0] >> kPositionBits, place[1] >> kPositionBits, place[2] >> kPositionBits}, v)) return kUnknown;
      return mix(v, place);
    }
    /// The value between the eight corners of a cell, at the parts of a place that lie inside it.
    static std::int32_t mix(const std::array<std::int32_t, 8>& v, const std::array<std::int32_t, 3>& place) {
      const std::int32_t x = place[0] & (kCell - 1), y = place[1] & (kCell - 1), z = place[2] & (kCell - 1);
      return between(between(between(v[0], v[1], x), between(v[2], v[3], x), y),
                     between(between(v[4], v[5], x), between(v[6], v[7], x), y), z);
    }

    bool any() const { return distances_ != nullptr; }
   private:
    static std::int32_t between(std::int32_t a, std::int32_t b, std::int32_t part) {
      return a + (((b - a) * part) >> kPositionBits);
    }
    void look(const std::array<std::int32_t, 3>& brick);

    const ReferenceField& field_;
    std::array<std::int32_t, 3> brick_{-2, -2, -2};
    const Distance* distances_ = nullptr;
  };
};

}  // namespace isoreel
