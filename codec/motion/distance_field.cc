// SPDX-License-Identifier: BSD-3-Clause
#include "motion/distance_field.h"

#include <algorithm>

namespace isoreel {

float* DistanceField::added(const std::array<std::int32_t, 3>& brick) {
  Found& found = slotOf(brick);
  if (found.brick != brick) {
    found = {brick, map_.findOrAdd(brick[0], brick[1], brick[2])};
    if (found.number == bricks_.size()) bricks_.emplace_back().fill(kFar);
  }
  return bricks_[found.number].data();
}

DistanceField::DistanceField(const Reference& reference) {
  map_.clear();
  constexpr std::size_t kNodes = 2 * kBand;
  for (const ReferencePlane& plane : reference.planes()) {
    std::array<std::int32_t, 3> low{}, high{};
    std::array<std::array<float, kNodes>, 3> squares{};  // of the way to each node along an axis
    for (std::size_t k = 0; k < 3; ++k) {
      const float vertex = static_cast<float>(plane.position[k]) / kCell;
      low[k] = std::max(static_cast<std::int32_t>(vertex) - kBand + 1, 0);
      high[k] = static_cast<std::int32_t>(vertex) + kBand;
      for (std::size_t i = 0; i < kNodes; ++i) {
        const float way = static_cast<float>(low[k] + static_cast<std::int32_t>(i)) - vertex;
        squares[k][i] = way * way;
      }
    }
    // The nodes, cut where bricks end.
    std::array<std::int32_t, 3> from{}, to{};
    for (from[2] = low[2]; from[2] <= high[2]; from[2] = to[2] + 1) {
      to[2] = std::min(high[2], from[2] | (kSide - 1));
      for (from[1] = low[1]; from[1] <= high[1]; from[1] = to[1] + 1) {
        to[1] = std::min(high[1], from[1] | (kSide - 1));
        for (from[0] = low[0]; from[0] <= high[0]; from[0] = to[0] + 1) {
          to[0] = std::min(high[0], from[0] | (kSide - 1));
          float* const nodes = added({from[0] >> 3, from[1] >> 3, from[2] >> 3});
          for (std::int32_t z = from[2]; z <= to[2]; ++z) {
            for (std::int32_t y = from[1]; y <= to[1]; ++y) {
              const float square = squares[1][static_cast<std::size_t>(y - low[1])] +
                                   squares[2][static_cast<std::size_t>(z - low[2])];
              float* const row = nodes + inBrick(0, y, z);
              for (std::int32_t x = from[0]; x <= to[0]; ++x) {
                const float here = square + squares[0][static_cast<std::size_t>(x - low[0])];
                row[x & 7] = std::min(row[x & 7], here);
              }
            }
          }
        }
      }
    }
  }
  found_.fill({});
}

}  // namespace isoreel
