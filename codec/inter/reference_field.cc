// SPDX-License-Identifier: BSD-3-Clause
#include "inter/reference_field.h"

#include <algorithm>
#include <cstring>

namespace isoreel {
namespace {

using Row = std::int16_t __attribute__((vector_size(8)));
constexpr std::int16_t kFar = std::numeric_limits<std::int16_t>::max();

// Four nodes: those at -1, 0 and 1 from the vertex's own, and one that never wins.
void addRow(const Row& away, const Row& there, std::int16_t* distances, std::int16_t* nearest) {
  Row old_distance, old_nearest;
  std::memcpy(&old_distance, distances, sizeof(Row));
  std::memcpy(&old_nearest, nearest, sizeof(Row));
  const Row nearer = (away < old_nearest) & Row{-1, -1, -1, 0};
  old_distance ^= (old_distance ^ there) & nearer;
  old_nearest ^= (old_nearest ^ away) & nearer;
  std::memcpy(distances, &old_distance, sizeof(Row));
  std::memcpy(nearest, &old_nearest, sizeof(Row));
}

}  // namespace

void ReferenceField::build(std::span<const ReferencePlane> planes) {
  map_.clear();
  bricks_.clear();
  recent_ = {};
  for (const ReferencePlane& plane : planes) add(plane);
}

void ReferenceField::add(const ReferencePlane& plane) {
  std::array<std::int32_t, 3> first{}, low{}, high{};
  std::array<Row, 3> distance{}, square{};  // what each coordinate adds to the plane's and the vertex's
  for (std::size_t k = 0; k < 3; ++k) {
    first[k] = ((plane.position[k] + kCell / 2) >> kPositionBits) - 1;
    low[k] = std::max(0, (first[k] - 1) >> kSideLog2);  // a node on a brick's face is in both
    high[k] = (first[k] + 2) >> kSideLog2;
    for (std::int32_t i = 0; i < 3; ++i) {
      const std::int32_t d = (first[k] + i) * kCell - plane.position[k];
      distance[k][i] = static_cast<std::int16_t>((plane.normal[k] * d) >> kPositionBits);
      square[k][i] = static_cast<std::int16_t>((d >> 8) * (d >> 8));
    }
  }
  for (std::int32_t bz = low[2]; bz <= high[2]; ++bz) {
    for (std::int32_t by = low[1]; by <= high[1]; ++by) {
      for (std::int32_t bx = low[0]; bx <= high[0]; ++bx) {
        Brick& brick = brickAt(bx, by, bz);
        const std::int32_t x = first[0] - kSide * bx, y = first[1] - kSide * by, z = first[2] - kSide * bz;
        const std::int32_t y_end = std::min(3, kSide + 1 - y), z_end = std::min(3, kSide + 1 - z);
        for (std::int32_t j = std::max(0, -z); j < z_end; ++j) {
          const std::int32_t plane_place = (z + j) * kPlane + y * kRow + x + kBefore;
          const Row away_z = square[0] + square[2][j], there_z = distance[0] + distance[2][j];
          for (std::int32_t i = std::max(0, -y); i < y_end; ++i) {
            const std::int32_t place = plane_place + i * kRow;
            addRow(away_z + square[1][i], there_z + distance[1][i], brick.distances.data() + place,
                   brick.nearest.data() + place);
          }
        }
      }
    }
  }
}

ReferenceField::Brick& ReferenceField::brickAt(std::int32_t x, std::int32_t y, std::int32_t z) {
  Recent& recent = recent_[static_cast<std::size_t>((x & 1) | (y & 1) << 1 | (z & 1) << 2)];
  if (recent.x != x || recent.y != y || recent.z != z) {
    recent = {x, y, z, map_.findOrAdd(x, y, z)};
    if (recent.number == bricks_.size()) {
      Brick& brick = bricks_.emplace_back();
      brick.distances.fill(CornerValues::kUnknown);
      brick.nearest.fill(kFar);
    }
  }
  return bricks_[recent.number];
}

void ReferenceField::Cursor::look(const std::array<std::int32_t, 3>& brick) {
  brick_ = brick;
  distances_ = nullptr;
  for (const std::int32_t b : brick) {
    if (b < 0 || b > 65536 / kSide) return;
  }
  const std::uint32_t number = field_.map_.find(brick[0], brick[1], brick[2]);
  if (number != BrickMap::kNone) distances_ = field_.bricks_[number].distances.data();
}

}  // namespace isoreel
