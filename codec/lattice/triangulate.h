// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/codec/surface.h>

#include <vector>

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

/// World positions of all vertices: each is a corner of four quads on average.
inline std::vector<Vec3d> worldPositions(const Surface& surface) {
  std::vector<Vec3d> result(surface.vertices.size());
  for (std::uint32_t i = 0; i < result.size(); ++i) result[i] = surface.world(i);
  return result;
}

/// A quad's two triangles as Surface::triangles() has them; world(i) gives the position of a vertex, `flip`
/// tells that the grid mirrors. No branch on the diagonal: it is anybody's guess.
template <class World>
std::array<Triangle, 2> split(const Quad& quad, const World& world, bool flip) {
  const auto [a, b, c, d] = quad;
  const bool along_ac = squaredLength(minus(world(a), world(c))) <= squaredLength(minus(world(b), world(d)));
  const std::uint32_t last = along_ac ? c : d, first = along_ac ? a : b;
  return {flip ? Triangle{a, last, b} : Triangle{a, b, last},
          flip ? Triangle{first, d, c} : Triangle{first, c, d}};
}

/// Calls visit(triangle, its three world positions) for each triangle of Surface::triangles(), in order.
template <class Visit>
void forEachTriangle(const Surface& surface, Visit visit) {
  const bool flip = determinant(surface.grid) < 0;
  const std::vector<Vec3d> world = worldPositions(surface);
  for (const Quad& quad : surface.quads) {
    for (const Triangle& t : split(
             quad, [&](std::uint32_t i) -> const Vec3d& { return world[i]; }, flip))
      visit(t, world[t[0]], world[t[1]], world[t[2]]);
  }
}

}  // namespace isoreel
