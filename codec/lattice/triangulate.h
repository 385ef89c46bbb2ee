// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/codec/surface.h>

#include <utility>

namespace isoreel {

inline Vec3d minus(const Vec3d& a, const Vec3d& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline Vec3d cross(const Vec3d& a, const Vec3d& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline double squaredLength(const Vec3d& a) { return a[0] * a[0] + a[1] * a[1] + a[2] * a[2]; }

/// Of a grid's direction: negative when it mirrors.
inline double determinant(const Grid& grid) {
  const auto& d = grid.direction;
  return d[0] * (d[4] * d[8] - d[5] * d[7]) - d[1] * (d[3] * d[8] - d[5] * d[6]) +
         d[2] * (d[3] * d[7] - d[4] * d[6]);
}

/// Calls visit(triangle, its three world positions) for each triangle of Surface::triangles(), in order.
template <class Visit>
void forEachTriangle(const Surface& surface, Visit visit) {
  const bool flip = determinant(surface.grid) < 0;
  for (const auto& [a, b, c, d] : surface.quads) {
    const Vec3d at_a = surface.world(a), at_b = surface.world(b), at_c = surface.world(c),
                at_d = surface.world(d);
    const auto send = [&](std::uint32_t i, std::uint32_t j, std::uint32_t k, const Vec3d& p, const Vec3d& q,
                          const Vec3d& r) {
      if (flip) {
        visit(Triangle{i, k, j}, p, r, q);
      } else {
        visit(Triangle{i, j, k}, p, q, r);
      }
    };
    if (squaredLength(minus(at_a, at_c)) <= squaredLength(minus(at_b, at_d))) {
      send(a, b, c, at_a, at_b, at_c);
      send(a, c, d, at_a, at_c, at_d);
    } else {
      send(a, b, d, at_a, at_b, at_d);
      send(b, c, d, at_b, at_c, at_d);
    }
  }
}

}  // namespace isoreel
