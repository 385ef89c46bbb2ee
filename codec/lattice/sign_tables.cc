// SPDX-License-Identifier: BSD-3-Clause
#include "lattice/sign_tables.h"

#include <isoreel/codec/grid.h>

namespace isoreel {
namespace {

using Vector = std::array<std::int64_t, 3>;

constexpr std::int64_t dot(const Vector& a, const Vector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// The largest r with r² <= value.
constexpr std::int64_t squareRoot(std::int64_t value) {
  std::int64_t root = 0;
  for (std::int64_t bit = std::int64_t{1} << 31; bit > 0; bit >>= 1) {
    if ((root + bit) <= value / (root + bit)) root += bit;
  }
  return root;
}

/// v at length 16384, each component rounded from a floor square root with one more bit. Exact integer
/// arithmetic, so that every implementation gets the same table.
constexpr std::array<std::int32_t, 3> normalised(const Vector& v) {
  std::array<std::int32_t, 3> result{};
  for (std::size_t i = 0; i < 3; ++i) {
    const std::int64_t twice = squareRoot((v[i] * v[i] << (2 * kPositionBits + 2)) / dot(v, v));
    result[i] = static_cast<std::int32_t>((twice + 1) >> 1) * (v[i] < 0 ? -1 : 1);
  }
  return result;
}

constexpr std::int64_t cornerCoordinate(std::size_t corner, std::size_t axis) {
  return static_cast<std::int64_t>(corner >> axis & 1);
}

constexpr LocalFrame localFrame(std::size_t configuration) {
  LocalFrame frame;
  // The mean of the middles of the sign-changing edges, in half cells times their number.
  Vector sum{0, 0, 0};
  std::int64_t edges = 0;
  Vector gradient{0, 0, 0};
  for (std::size_t a = 0; a < 8; ++a) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t b = a | std::size_t{1} << axis;
      gradient[axis] += (2 * cornerCoordinate(a, axis) - 1) * ((configuration >> a & 1) != 0 ? -1 : 1);
      if (b == a || (configuration >> a & 1) == (configuration >> b & 1)) continue;
      ++edges;
      for (std::size_t k = 0; k < 3; ++k) sum[k] += cornerCoordinate(a, k) + cornerCoordinate(b, k);
    }
  }
  for (std::size_t k = 0; k < 3; ++k) {
    frame.vertex[k] =
        static_cast<std::int32_t>(edges == 0 ? kCell / 2 : (sum[k] * kCell + edges) / (2 * edges));
  }
  if (dot(gradient, gradient) == 0) gradient = {0, 0, 1};
  // The first tangent: the axis that is least along the normal, made orthogonal to it.
  std::size_t least = 0;
  for (std::size_t k = 1; k < 3; ++k) {
    if (gradient[k] * gradient[k] < gradient[least] * gradient[least]) least = k;
  }
  Vector tangent{0, 0, 0};
  tangent[least] = dot(gradient, gradient);
  for (std::size_t k = 0; k < 3; ++k) tangent[k] -= gradient[k] * gradient[least];
  const Vector other{gradient[1] * tangent[2] - gradient[2] * tangent[1],
                     gradient[2] * tangent[0] - gradient[0] * tangent[2],
                     gradient[0] * tangent[1] - gradient[1] * tangent[0]};
  frame.normal = normalised(gradient);
  frame.tangent1 = normalised(tangent);
  frame.tangent2 = normalised(other);
  return frame;
}

constexpr std::array<LocalFrame, 256> localFrames() {
  std::array<LocalFrame, 256> frames{};
  for (std::size_t c = 0; c < 256; ++c) frames[c] = localFrame(c);
  return frames;
}

}  // namespace

constinit const std::array<LocalFrame, 256> kLocalFrames = localFrames();

}  // namespace isoreel
