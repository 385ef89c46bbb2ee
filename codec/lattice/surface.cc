// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/codec/surface.h>

#include <xxhash.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace isoreel {
namespace {

Vec3d minus(const Vec3d& a, const Vec3d& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Vec3d cross(const Vec3d& a, const Vec3d& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double squaredLength(const Vec3d& a) { return a[0] * a[0] + a[1] * a[1] + a[2] * a[2]; }

bool mirrors(const Grid& grid) {
  const auto& d = grid.direction;
  return d[0] * (d[4] * d[8] - d[5] * d[7]) - d[1] * (d[3] * d[8] - d[5] * d[6]) + d[2] * (d[3] * d[7] - d[4] * d[6]) < 0;
}

}  // namespace

Status checkGrid(const Grid& grid) {
  const auto refuse = [](const std::string& rule) { return Status(ErrorCode::kInvalidArgument, "grid: " + rule + " (spec codec 2)"); };
  for (const std::uint32_t n : grid.nodes) {
    if (n < kMinNodes || n > kMaxNodes) {
      return refuse(std::to_string(n) + " nodes on a side, where 2 to 65536 are allowed");
    }
  }
  for (std::size_t i = 0; i < 3; ++i) {
    if (!std::isfinite(grid.origin[i])) return refuse("origin is not finite");
    if (!std::isfinite(grid.spacing[i]) || grid.spacing[i] <= 0) return refuse("spacing is not above 0");
  }
  for (const double d : grid.direction) {
    if (!std::isfinite(d)) return refuse("direction is not finite");
  }
  return {};
}

std::vector<Triangle> Surface::triangles() const {
  std::vector<Vec3d> points(vertices.size());
  for (std::size_t i = 0; i < vertices.size(); ++i) points[i] = grid.world(vertices[i]);
  const bool flip = mirrors(grid);
  std::vector<Triangle> result;
  result.reserve(quads.size() * 2);
  for (const auto& [a, b, c, d] : quads) {
    const bool first = squaredLength(minus(points[a], points[c])) <= squaredLength(minus(points[b], points[d]));
    Triangle one = first ? Triangle{a, b, c} : Triangle{a, b, d};
    Triangle two = first ? Triangle{a, c, d} : Triangle{b, c, d};
    if (flip) {
      std::swap(one[1], one[2]);
      std::swap(two[1], two[2]);
    }
    result.push_back(one);
    result.push_back(two);
  }
  return result;
}

std::vector<std::array<float, 3>> Surface::normals() const {
  std::vector<Vec3d> sums(vertices.size(), Vec3d{0, 0, 0});
  for (const Triangle& t : triangles()) {
    const Vec3d a = world(t[0]);
    const Vec3d normal = cross(minus(world(t[1]), a), minus(world(t[2]), a));  // length: twice the area
    for (const std::uint32_t i : t) {
      for (std::size_t k = 0; k < 3; ++k) sums[i][k] += normal[k];
    }
  }
  std::vector<std::array<float, 3>> result(vertices.size(), {0, 0, 0});
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const double length = std::sqrt(squaredLength(sums[i]));
    if (length == 0) continue;
    for (std::size_t k = 0; k < 3; ++k) result[i][k] = static_cast<float>(sums[i][k] / length);
  }
  return result;
}

Status checkClosed(const Surface& surface) {
  // Each directed edge as (low vertex, high vertex, direction): the two directions of a closed edge balance.
  std::vector<std::pair<std::uint64_t, int>> edges;
  edges.reserve(surface.quads.size() * 4);
  for (const Quad& quad : surface.quads) {
    for (std::size_t k = 0; k < 4; ++k) {
      const std::uint64_t a = quad[k], b = quad[(k + 1) % 4];
      if (a >= surface.vertices.size()) return {ErrorCode::kBadData, "a quad names vertex " + std::to_string(a) + ", which is not there"};
      edges.emplace_back(a < b ? a << 32 | b : b << 32 | a, a < b ? 1 : -1);
    }
  }
  std::sort(edges.begin(), edges.end());
  const auto at_border = [&](std::uint64_t a, std::uint64_t b) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int32_t last = static_cast<std::int32_t>(surface.grid.nodes[axis] - 2) * kCell;
      const std::int32_t p = surface.vertices[a][axis], q = surface.vertices[b][axis];
      if ((p <= kCell && q <= kCell) || (p >= last && q >= last)) return true;
    }
    return false;
  };
  for (std::size_t i = 0; i < edges.size();) {
    const std::uint64_t key = edges[i].first;
    int balance = 0;
    for (; i < edges.size() && edges[i].first == key; ++i) balance += edges[i].second;
    const std::uint64_t a = key >> 32, b = key & 0xFFFFFFFF;
    if (balance == 0 || at_border(a, b)) continue;
    return {ErrorCode::kBadData, "not closed at the edge of vertices " + std::to_string(a) + " and " + std::to_string(b)};
  }
  return {};
}

std::uint64_t surfaceHash(const Surface& surface) {
  static_assert(std::endian::native == std::endian::little, "hash the elements one by one on a big-endian machine");
  XXH3_state_t* state = XXH3_createState();
  XXH3_64bits_reset(state);
  XXH3_64bits_update(state, surface.vertices.data(), surface.vertices.size() * sizeof(GridPosition));
  XXH3_64bits_update(state, surface.quads.data(), surface.quads.size() * sizeof(Quad));
  const std::uint64_t hash = XXH3_64bits_digest(state);
  XXH3_freeState(state);
  return hash;
}

}  // namespace isoreel
