// SPDX-License-Identifier: BSD-3-Clause
#include "inter/prediction.h"

#include "lattice/bits.h"

namespace isoreel {
namespace {

// How the distances at the corners of a cell of the reference depart from a plane, by CornerValues::bend():
// 0.0005, 0.004 and 0.015 cells squared in the mean, times 64, in 1/2^24.
constexpr std::array<std::int64_t, 3> kBends{1 << 19, 1 << 22, 1 << 24};
// The surface may meet the local frame's normal at no flatter an angle than this: cosine 0.4 in 1/16384.
constexpr std::int32_t kFlattest = 6554;

/// The sign-changing edges of a configuration.
struct Edges {
  // By axis, then whether they go from outside to inside: their lower corners, one bit each.
  std::array<std::array<std::uint8_t, 2>, 3> from{};
  std::int32_t part = 0;  // 65536 / their number
};

constexpr auto kEdges = [] {
  std::array<Edges, 256> table{};
  for (std::uint32_t c = 0; c < 256; ++c) {
    std::int32_t count = 0;
    for (std::uint32_t corner = 0; corner < 8; ++corner) {
      for (std::uint32_t axis = 0; axis < 3; ++axis) {
        const std::uint32_t other = corner | 1u << axis;
        if (other == corner || ((c >> corner ^ c >> other) & 1) == 0) continue;
        std::uint8_t& from = table[c].from[axis][(c >> corner & 1) == 0];
        from = static_cast<std::uint8_t>(from | 1u << corner);
        ++count;
      }
    }
    if (count > 0) table[c].part = 65536 / count;
  }
  return table;
}();

// The values at a cell's corners of the plane that has `value` and `slope` at a place inside it.
std::array<std::int32_t, 8> cornersOfPlane(std::int32_t value, const std::array<std::int32_t, 3>& slope,
                                           const std::array<std::int32_t, 3>& place) {
  std::int64_t back = 0;
  for (std::size_t k = 0; k < 3; ++k) back += std::int64_t{slope[k]} * place[k];
  std::array<std::int32_t, 8> result{};
  result[0] = value - static_cast<std::int32_t>(back >> kPositionBits);
  result[1] = result[0] + slope[0];
  for (std::size_t j = 0; j < 2; ++j) result[2 + j] = result[j] + slope[1];
  for (std::size_t j = 0; j < 4; ++j) result[4 + j] = result[j] + slope[2];
  return result;
}

std::uint32_t insideCorners(const std::array<std::int32_t, 8>& values) {
#ifdef __SSE2__
  const auto signs = [&](std::size_t first) {
    return static_cast<std::uint32_t>(_mm_movemask_ps(
        _mm_castsi128_ps(_mm_loadu_si128(reinterpret_cast<const __m128i*>(values.data() + first)))));
  };
  return signs(0) | signs(4) << 4;
#else
  std::uint32_t inside = 0;
  for (std::size_t j = 0; j < 8; ++j) inside |= (static_cast<std::uint32_t>(values[j]) >> 31) << j;
  return inside;
#endif
}

// `wrong`: the corners that the plane has on the wrong side, one bit each; `corners`: of the cell of the
// reference.
std::uint8_t confidence(std::uint32_t wrong, const CornerValues& corners) {
  std::size_t grade = 0;
  const std::int64_t bend = corners.bend();
  while (grade < kBends.size() && bend >= kBends[grade]) ++grade;
  return static_cast<std::uint8_t>(std::min(countBits(wrong), 3u) * 4 + grade);
}

}  // namespace

std::int32_t MovedPlane::offset(const LocalFrame& frame, const std::array<std::int64_t, 3>& offsets) const {
  std::array<std::int64_t, 3> along{};  // the slope along the frame's axes
  for (std::size_t k = 0; k < 3; ++k) {
    along[0] += std::int64_t{slope[k]} * frame.normal[k];
    along[1] += std::int64_t{slope[k]} * frame.tangent1[k];
    along[2] += std::int64_t{slope[k]} * frame.tangent2[k];
  }
  const std::int64_t at =
      distance + (((along[1] >> kPositionBits) * offsets[1] + (along[2] >> kPositionBits) * offsets[2]) >>
                  kPositionBits);
  const std::int64_t facing = std::max<std::int64_t>(along[0] >> kPositionBits, kFlattest);
  return static_cast<std::int32_t>(std::clamp<std::int64_t>(-at * kCell / facing, -kCell, kCell));
}

MovedHeight movedHeight(ReferenceField::Cursor& field, const Cell& cell, const Lanes& point,
                        const Lanes& normal, const std::array<std::int32_t, 3>& motion) {
  const std::array<std::int32_t, 3> inner{8 * point.v[0], 8 * point.v[1], 8 * point.v[2]};
  const std::array<std::int32_t, 3> at{cell.x * kCell + inner[0] + motion[0],
                                       cell.y * kCell + inner[1] + motion[1],
                                       cell.z * kCell + inner[2] + motion[2]};
  const CornerValues corners = field.around(at);
  if (!corners.allKnown()) return {};
  const CornerValues::Between between = corners.slopesAt(at);
  std::int32_t facing = 0;  // 1/4096
  for (std::size_t k = 0; k < 3; ++k) facing += (between.slope[k] * normal.v[k]) >> kPositionBits;
  facing = std::max(facing, kFlattest >> 2);
  MovedHeight result;
  result.height = static_cast<std::int16_t>(std::clamp(-between.value * kCell / facing, -kCell, kCell));
  const std::uint32_t inside = insideCorners(cornersOfPlane(between.value, between.slope, inner));
  result.confidence = confidence(inside ^ cell.corners, corners);
  return result;
}

MovedPlane planeInCell(ReferenceField::Cursor& field, const Cell& cell,
                       const std::array<std::int32_t, 3>& motion) {
  MovedPlane plane;
  const LocalFrame& frame = kLocalFrames[cell.corners];
  const std::array<std::int32_t, 3> at{cell.x * kCell + frame.vertex[0] + motion[0],
                                       cell.y * kCell + frame.vertex[1] + motion[1],
                                       cell.z * kCell + frame.vertex[2] + motion[2]};
  const CornerValues corners = field.around(at);
  if (!corners.allKnown()) return plane;
  const CornerValues::Between between = corners.slopesAt(at);
  plane.known = true;
  plane.distance = 4 * between.value;
  plane.slope = {4 * between.slope[0], 4 * between.slope[1], 4 * between.slope[2]};

  const std::array<std::int32_t, 8> at_corner = cornersOfPlane(plane.distance, plane.slope, frame.vertex);
  // Where it crosses the edges whose ends differ in sign.
  std::array<std::int32_t, 3> shift{};
  const Edges& edges = kEdges[cell.corners];
  for (std::size_t k = 0; k < 3; ++k) {
    const std::int32_t slope = plane.slope[k];
    // Those along this axis that it rises or falls along as the signs do.
    std::uint32_t left = edges.from[k][slope < 0];
    if (left == 0 || slope == 0) continue;
    const std::int64_t inverse = (slope < 0 ? -1 : 1) * ((1 << 28) / std::abs(slope));
    for (; left != 0; left &= left - 1) {
      const std::int64_t place =
          (-at_corner[static_cast<std::size_t>(std::countr_zero(left))] * inverse) >> kPositionBits;
      shift[k] += static_cast<std::int32_t>(std::clamp<std::int64_t>(place, 0, kCell)) - kCell / 2;
    }
  }
  for (std::size_t t = 0; t < 2; ++t) {
    const auto& tangent = t == 0 ? frame.tangent1 : frame.tangent2;
    std::int64_t along = 0;
    for (std::size_t k = 0; k < 3; ++k) along += std::int64_t{shift[k]} * tangent[k];
    plane.tangents[t] = static_cast<std::int32_t>((along * edges.part) >> (kPositionBits + 16));
  }
  plane.confidence = confidence(insideCorners(at_corner) ^ cell.corners, corners);
  return plane;
}

}  // namespace isoreel
