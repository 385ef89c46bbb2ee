// SPDX-License-Identifier: BSD-3-Clause
#include "motion/distance_field.h"

#include <cmath>

namespace isoreel {
namespace {

std::size_t inBrick(std::int32_t x, std::int32_t y, std::int32_t z) {
  return static_cast<std::size_t>((x & 7) | (y & 7) << 3 | (z & 7) << 6);
}

}  // namespace

DistanceField::DistanceField(const Reference& reference) {
  map_.clear();
  for (const ReferencePlane& plane : reference.planes()) {
    std::array<float, 3> vertex{};
    for (std::size_t k = 0; k < 3; ++k) vertex[k] = static_cast<float>(plane.position[k]) / kCell;
    std::array<std::int32_t, 3> low{}, high{};
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::max(static_cast<std::int32_t>(vertex[k]) - kBand + 1, 0);
      high[k] = static_cast<std::int32_t>(vertex[k]) + kBand;
    }
    // Rows of nodes, cut where bricks end.
    for (std::int32_t z = low[2]; z <= high[2]; ++z) {
      for (std::int32_t y = low[1]; y <= high[1]; ++y) {
        const float dy = static_cast<float>(y) - vertex[1], dz = static_cast<float>(z) - vertex[2];
        const float square = dy * dy + dz * dz;
        for (std::int32_t x = low[0]; x <= high[0];) {
          const std::uint32_t number = map_.findOrAdd(x >> 3, y >> 3, z >> 3);
          if (number == bricks_.size()) bricks_.emplace_back().fill(kFar);
          float* row = &bricks_[number][inBrick(0, y, z)];
          for (const std::int32_t end = std::min(high[0], x | 7); x <= end; ++x) {
            const float dx = static_cast<float>(x) - vertex[0];
            row[x & 7] = std::min(row[x & 7], square + dx * dx);
          }
        }
      }
    }
  }
}

float DistanceField::at(float x, float y, float z) const {
  const auto nx = static_cast<std::int32_t>(std::lround(x)), ny = static_cast<std::int32_t>(std::lround(y)),
             nz = static_cast<std::int32_t>(std::lround(z));
  if (nx < 0 || ny < 0 || nz < 0 || nx > 65535 || ny > 65535 || nz > 65535) return kFar;
  const std::uint32_t number = map_.find(nx >> 3, ny >> 3, nz >> 3);
  return number == BrickMap::kNone ? kFar : bricks_[number][inBrick(nx, ny, nz)];
}

}  // namespace isoreel
