// SPDX-License-Identifier: BSD-3-Clause
#include "inter/reference_field.h"

#include <algorithm>
#include <cstring>

namespace isoreel {
namespace {

using Row = std::int32_t __attribute__((vector_size(16)));
// Of a node without a distance: further than all, and CornerValues::kUnknown.
constexpr std::int32_t kNothing = 0x7FFF0000;

}  // namespace

void ReferenceField::build(std::span<const ReferencePlane> planes) {
  map_.clear();
  bricks_.clear();
  recent_ = {};
  for (const ReferencePlane& plane : planes) add(plane);
}

// Nodes go in rows of four: those at -1, 0 and 1 from the vertex's own, and one that never wins.
void ReferenceField::add(const ReferencePlane& plane) {
  std::array<std::int32_t, 3> first{}, low{}, high{};
  std::array<std::array<std::int32_t, 4>, 3> part{};  // what each coordinate adds to a node
  for (std::size_t k = 0; k < 3; ++k) {
    first[k] = ((plane.position[k] + kCell / 2) >> kPositionBits) - 1;
    low[k] = std::max(0, (first[k] - 1) >> kSideLog2);  // a node on a brick's face is in both
    high[k] = (first[k] + 2) >> kSideLog2;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::int32_t d = (first[k] + static_cast<std::int32_t>(i)) * kCell - plane.position[k];
      part[k][i] = (d >> 8) * (d >> 8) * 65536 + ((plane.normal[k] * d) >> kPositionBits);
    }
  }
  const Row x_part{part[0][0], part[0][1], part[0][2], 0};
  const Row never{0, 0, 0, kNothing};
  for (std::int32_t bz = low[2]; bz <= high[2]; ++bz) {
    for (std::int32_t by = low[1]; by <= high[1]; ++by) {
      for (std::int32_t bx = low[0]; bx <= high[0]; ++bx) {
        Brick& brick = brickAt(bx, by, bz);
        const std::int32_t x = first[0] - kSide * bx, y = first[1] - kSide * by, z = first[2] - kSide * bz;
        const std::int32_t y_end = std::min(3, kSide + 1 - y), z_end = std::min(3, kSide + 1 - z);
        for (std::int32_t j = std::max(0, -z); j < z_end; ++j) {
          const Row xz_part = x_part + (part[2][static_cast<std::size_t>(j)] + 32768);
          for (std::int32_t i = std::max(0, -y); i < y_end; ++i) {
            std::int32_t* const at = brick.data() + (z + j) * kPlane + (y + i) * kRow + x + kBefore;
            const Row made = (xz_part + part[1][static_cast<std::size_t>(i)]) | never;
            Row old;
            std::memcpy(&old, at, sizeof(Row));
            old = made < old ? made : old;
            std::memcpy(at, &old, sizeof(Row));
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
    if (recent.number == bricks_.size()) bricks_.emplace_back().fill(kNothing);
  }
  return bricks_[recent.number];
}

void ReferenceField::Cursor::look(const std::array<std::int32_t, 3>& brick) {
  brick_ = brick;
  nodes_ = nullptr;
  for (const std::int32_t b : brick) {
    if (b < 0 || b > 65536 / kSide) return;
  }
  const std::uint32_t number = field_.map_.find(brick[0], brick[1], brick[2]);
  if (number != BrickMap::kNone) nodes_ = field_.bricks_[number].data();
}

}  // namespace isoreel
