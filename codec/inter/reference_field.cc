// SPDX-License-Identifier: BSD-3-Clause
#include "inter/reference_field.h"

#include <algorithm>

namespace isoreel {
namespace {

constexpr std::int16_t kFar = std::numeric_limits<std::int16_t>::max();

}  // namespace

void ReferenceField::build(std::span<const ReferencePlane> planes) {
  map_.clear();
  distances_.clear();
  nearest_.clear();
  for (const ReferencePlane& plane : planes) add(plane);
}

// Four nodes in a row at a time: those at -1, 0 and 1 from the vertex's own, and one that never wins.
void ReferenceField::add(const ReferencePlane& plane) {
  std::array<std::int32_t, 3> middle{}, low{}, high{};
  std::array<std::array<std::int32_t, 4>, 3> product{};  // what each coordinate adds to the distance
  std::array<std::array<std::int16_t, 4>, 3> square{};   // and to the squared distance of the vertex
  for (std::size_t k = 0; k < 3; ++k) {
    middle[k] = (plane.position[k] + kCell / 2) >> kPositionBits;
    low[k] = std::max(0, (middle[k] - 2) >> 3);  // a node on a brick's face is in both
    high[k] = (middle[k] + 1) >> 3;
    for (std::int32_t i = 0; i < 3; ++i) {
      const std::int32_t d = (middle[k] - 1 + i) * kCell - plane.position[k];
      product[k][static_cast<std::size_t>(i)] = plane.normal[k] * d;
      square[k][static_cast<std::size_t>(i)] = static_cast<std::int16_t>((d >> 8) * (d >> 8));
    }
  }
  square[0][3] = kFar;
  const auto row = [&](Brick& distances, Brick& nearest, std::size_t place, std::size_t y, std::size_t z) {
    const std::int32_t base = product[1][y] + product[2][z];
    const auto apart = static_cast<std::int16_t>(square[1][y] + square[2][z]);
    for (std::size_t x = 0; x < 4; ++x) {
      const auto distance =
          static_cast<Distance>(std::clamp((product[0][x] + base) >> kDistanceBits, -kFarthest, kFarthest));
      const auto away = static_cast<std::int16_t>(std::min<std::int32_t>(square[0][x] + apart, kFar));
      const bool nearer = away < nearest[place + x];
      distances[place + x] = nearer ? distance : distances[place + x];
      nearest[place + x] = nearer ? away : nearest[place + x];
    }
  };
  for (std::int32_t bz = low[2]; bz <= high[2]; ++bz) {
    for (std::int32_t by = low[1]; by <= high[1]; ++by) {
      for (std::int32_t bx = low[0]; bx <= high[0]; ++bx) {
        const std::uint32_t number = map_.findOrAdd(bx, by, bz);
        if (number == distances_.size()) {
          distances_.emplace_back().fill(kUnknown);
          nearest_.emplace_back().fill(kFar);
        }
        const std::int32_t x = middle[0] - 1 - kSide * bx, y = middle[1] - 1 - kSide * by,
                           z = middle[2] - 1 - kSide * bz;
        for (std::int32_t j = std::max(0, -z); j < std::min(3, kSide + 1 - z); ++j) {
          for (std::int32_t i = std::max(0, -y); i < std::min(3, kSide + 1 - y); ++i) {
            row(distances_[number], nearest_[number],
                static_cast<std::size_t>((z + j) * kPlane + (y + i) * kRow + x + kBefore),
                static_cast<std::size_t>(i), static_cast<std::size_t>(j));
          }
        }
      }
    }
  }
}

void ReferenceField::Cursor::look(const std::array<std::int32_t, 3>& brick) {
  brick_ = brick;
  distances_ = nullptr;
  for (const std::int32_t b : brick) {
    if (b < 0 || b > 65536 / kSide) return;
  }
  const std::uint32_t number = field_.map_.find(brick[0], brick[1], brick[2]);
  if (number != BrickMap::kNone) distances_ = field_.distances_[number].data();
}

}  // namespace isoreel
