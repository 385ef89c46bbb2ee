// SPDX-License-Identifier: BSD-3-Clause
#include "inter/reference.h"

#include <cmath>

#include "lattice/sign_tables.h"

namespace isoreel {
namespace {

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
  // Both are whole and below 2^53, so that a double's quotient is never rounded up to the next whole number.
  const auto scale = static_cast<std::int64_t>(static_cast<double>(std::int64_t{1} << 38) /
                                               static_cast<double>(floorSqrt(square)));
  for (std::size_t k = 0; k < 3; ++k) unit[k] = static_cast<std::int32_t>((sum[k] * scale) >> 26);
  return unit;
}

}  // namespace

void Reference::setPlanes(const Surface& surface, std::span<const Cell> cells) {
  setSize(planes_, surface.vertices.size());
  for (std::size_t i = 0; i < planes_.size(); ++i) planes_[i] = {surface.vertices[i], {}};
  for (const Quad& quad : surface.quads) {
    std::array<std::int32_t, 3> a{}, b{};
    for (std::size_t k = 0; k < 3; ++k) {
      a[k] = (surface.vertices[quad[2]][k] - surface.vertices[quad[0]][k]) >> 6;
      b[k] = (surface.vertices[quad[3]][k] - surface.vertices[quad[1]][k]) >> 6;
    }
    const std::array<std::int32_t, 3> cross{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                                            a[0] * b[1] - a[1] * b[0]};
    for (const std::uint32_t corner : quad) {
      for (std::size_t k = 0; k < 3; ++k) planes_[corner].normal[k] += cross[k];
    }
  }
  for (std::size_t i = 0; i < planes_.size(); ++i) {
    planes_[i].normal = unitNormal(planes_[i].normal, kLocalFrames[cells[i].corners]);
  }
  field_.clear();
}

}  // namespace isoreel
