// SPDX-License-Identifier: BSD-3-Clause
#include "inter/reference.h"

#include <cmath>

namespace isoreel {
namespace {

// Radii of the likelihood ellipsoid: 1.2 cells along the normal, 1.6 across it. The factors are 1/1.44 and
// 1/2.56 in 1/256.
constexpr std::int64_t kAlong = 178, kAcross = 100;
// A plane counts when its normal is within 78 degrees of the local frame's: cosine 0.2 in 1/2^26.
constexpr std::int64_t kMinCosine = 13421773;

std::int64_t floorSqrt(std::int64_t square) {
  auto root = static_cast<std::int64_t>(std::sqrt(static_cast<double>(square)));
  while (root * root > square) --root;  // the double may have been rounded up
  while ((root + 1) * (root + 1) <= square) ++root;
  return root;
}

std::array<std::int32_t, 3> unitNormal(const std::array<std::int32_t, 3>& sum, const LocalFrame& frame) {
  std::int64_t square = 0;
  for (const std::int32_t s : sum) square += std::int64_t{s} * s;
  std::array<std::int32_t, 3> unit{};
  if (square == 0) {
    for (std::size_t k = 0; k < 3; ++k) unit[k] = frame.normal[k] >> 2;
    return unit;
  }
  const std::int64_t scale = (std::int64_t{1} << 38) / floorSqrt(square);
  for (std::size_t k = 0; k < 3; ++k) unit[k] = static_cast<std::int32_t>((sum[k] * scale) >> 26);
  return unit;
}

}  // namespace

void Reference::build(const Surface& surface, std::span<const Cell> cells, CellIndex& index) {
  std::swap(index_, index);
  samples_.resize(surface.vertices.size());
  for (std::size_t i = 0; i < samples_.size(); ++i) samples_[i] = {surface.vertices[i], {}};
  for (const Quad& quad : surface.quads) {
    std::array<std::int32_t, 3> a{}, b{};
    for (std::size_t k = 0; k < 3; ++k) {
      a[k] = (surface.vertices[quad[2]][k] - surface.vertices[quad[0]][k]) >> 6;
      b[k] = (surface.vertices[quad[3]][k] - surface.vertices[quad[1]][k]) >> 6;
    }
    const std::array<std::int32_t, 3> cross{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                                            a[0] * b[1] - a[1] * b[0]};
    for (const std::uint32_t corner : quad) {
      for (std::size_t k = 0; k < 3; ++k) samples_[corner].normal[k] += cross[k];
    }
  }
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    samples_[i].normal = unitNormal(samples_[i].normal, kLocalFrames[cells[i].corners]);
  }
}

PlaneSums Reference::planesAround(const std::array<std::int32_t, 3>& at, const LocalFrame& frame,
                                  Neighbours& neighbours) const {
  PlaneSums sums;
  neighbours.forEach(
      at[0] >> kPositionBits, at[1] >> kPositionBits, at[2] >> kPositionBits, [&](std::uint32_t place) {
        const Sample& sample = samples_[place];
        std::int64_t cosine = 0;
        for (std::size_t k = 0; k < 3; ++k) cosine += std::int64_t{sample.normal[k]} * frame.normal[k];
        if (cosine < kMinCosine) return;
        std::array<std::int64_t, 3> d{};
        std::int64_t along = 0, square = 0;
        for (std::size_t k = 0; k < 3; ++k) {
          d[k] = at[k] - sample.position[k];
          along += d[k] * frame.normal[k];
          square += (d[k] >> 4) * (d[k] >> 4);
        }
        along >>= kPositionBits + 4;
        const std::int64_t across = std::max<std::int64_t>(0, square - along * along);
        const std::int64_t depth = 256 - ((along * along * kAlong + across * kAcross) >> 20);
        if (depth <= 0) return;
        const std::int64_t weight = (depth * depth) >> 8;
        const std::int64_t distance =
            (d[0] * sample.normal[0] + d[1] * sample.normal[1] + d[2] * sample.normal[2]) >> 12;
        sums.weight += static_cast<std::int32_t>(weight);
        sums.distance += weight * distance;
        sums.squares += weight * ((distance >> 4) * (distance >> 4));
        for (std::size_t k = 0; k < 3; ++k) sums.normal[k] += weight * sample.normal[k];
      });
  return sums;
}

}  // namespace isoreel
