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
  std::array<std::array<std::int32_t, 3>, 3> part{};  // what each coordinate adds to a node
  for (std::size_t k = 0; k < 3; ++k) {
    first[k] = ((plane.position[k] + kCell / 2) >> kPositionBits) - 1;
    low[k] = std::max(0, (first[k] - 1) >> kSideLog2);  // a node on a brick's face is in both
    high[k] = (first[k] + 2) >> kSideLog2;
    std::int32_t d = first[k] * kCell - plane.position[k];
    for (std::size_t i = 0; i < 3; ++i, d += kCell)
      part[k][i] = (d >> 8) * (d >> 8) * 65536 + ((plane.normal[k] * d) >> kPositionBits);
  }
  const Row never{0, 0, 0, kNothing};
  const Row on_x = Row{part[0][0], part[0][1], part[0][2], 0} + 32768;
  const std::array<Row, 3> on_xy{(on_x + part[1][0]) | never, (on_x + part[1][1]) | never,
                                 (on_x + part[1][2]) | never};
  const std::array<Row, 3> on_z{Row{part[2][0], part[2][0], part[2][0], 0},
                                Row{part[2][1], part[2][1], part[2][1], 0},
                                Row{part[2][2], part[2][2], part[2][2], 0}};
  const auto put = [&](std::int32_t* at, std::size_t y, std::size_t z) {
    const Row made = on_xy[y] + on_z[z];
    Row old;
    std::memcpy(&old, at, sizeof(Row));
    old = made < old ? made : old;
    std::memcpy(at, &old, sizeof(Row));
  };
  if (low == high && std::min({first[0], first[1], first[2]}) >= 0) {  // the usual case
    std::int32_t* const at = brickAt(low[0], low[1], low[2]).data() + (first[2] - kSide * low[2]) * kPlane +
                             (first[1] - kSide * low[1]) * kRow + (first[0] - kSide * low[0]) + kBefore;
    for (std::size_t z = 0; z < 3; ++z) {
      for (std::size_t y = 0; y < 3; ++y)
        put(at + static_cast<std::int32_t>(z) * kPlane + static_cast<std::int32_t>(y) * kRow, y, z);
    }
    return;
  }
  for (std::int32_t bz = low[2]; bz <= high[2]; ++bz) {
    for (std::int32_t by = low[1]; by <= high[1]; ++by) {
      for (std::int32_t bx = low[0]; bx <= high[0]; ++bx) {
        const std::int32_t x = first[0] - kSide * bx, y = first[1] - kSide * by, z = first[2] - kSide * bz;
        std::int32_t* const at = brickAt(bx, by, bz).data() + z * kPlane + y * kRow + x + kBefore;
        for (std::int32_t j = std::max(0, -z); j < std::min(3, kSide + 1 - z); ++j) {
          for (std::int32_t i = std::max(0, -y); i < std::min(3, kSide + 1 - y); ++i)
            put(at + j * kPlane + i * kRow, static_cast<std::size_t>(i), static_cast<std::size_t>(j));
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
