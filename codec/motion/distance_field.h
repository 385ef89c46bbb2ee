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

  /// At the node nearest to a place in cells.
  float at(float x, float y, float z) const;

 private:
  static constexpr std::int32_t kSide = 8;
  BrickMap map_;
  std::vector<std::array<float, kSide * kSide * kSide>> bricks_;
};

}  // namespace isoreel
