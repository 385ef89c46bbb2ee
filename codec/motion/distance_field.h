// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "inter/reference.h"

namespace isoreel {

/// Squared distance of grid nodes from the nearest vertex of the reference surface, in a band around it: what
/// the coarse search looks at. In cells.
class DistanceField {
 public:
  /// The band's half width.
  static constexpr std::int32_t kBand = 2;
  /// Squared distance of everything outside the band.
  static constexpr float kFar = kBand * kBand;

  explicit DistanceField(const Reference& reference);

  /// At the node nearest to a place in cells. Remembers the bricks it looked into last: not for two threads.
  float at(const std::array<float, 3>& place) {
    std::array<std::int32_t, 3> node;
    for (std::size_t k = 0; k < 3; ++k) {
      if (!(place[k] > -0.5f && place[k] < 65535.5f)) return kFar;
      // NOLINTNEXTLINE(bugprone-incorrect-roundings): never below 0 here, and exact in double
      node[k] = static_cast<std::int32_t>(static_cast<double>(place[k]) + 0.5);
    }
    const Found& found = foundAt({node[0] >> 3, node[1] >> 3, node[2] >> 3});
    return found.number == BrickMap::kNone ? kFar : bricks_[found.number][inBrick(node[0], node[1], node[2])];
  }

 private:
  static constexpr std::int32_t kSide = 8;
  struct Found {
    std::array<std::int32_t, 3> brick{-1, -1, -1};
    std::uint32_t number = BrickMap::kNone;
  };

  static std::size_t inBrick(std::int32_t x, std::int32_t y, std::int32_t z) {
    return static_cast<std::size_t>((x & 7) | (y & 7) << 3 | (z & 7) << 6);
  }
  Found& slotOf(const std::array<std::int32_t, 3>& brick) {
    return found_[static_cast<std::size_t>((brick[0] & 1) | (brick[1] & 1) << 1 | (brick[2] & 1) << 2)];
  }
  const Found& foundAt(const std::array<std::int32_t, 3>& brick) {
    Found& found = slotOf(brick);
    if (found.brick != brick) found = {brick, map_.find(brick[0], brick[1], brick[2])};
    return found;
  }
  float* added(const std::array<std::int32_t, 3>& brick);

  BrickMap map_;
  std::vector<std::array<float, kSide * kSide * kSide>> bricks_;
  std::array<Found, 8> found_;  // by their lowest bits
};

}  // namespace isoreel
