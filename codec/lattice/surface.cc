// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/codec/surface.h>

#include <xxhash.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "lattice/triangulate.h"

namespace isoreel {
Status checkGrid(const Grid& grid) {
  const auto refuse = [](const std::string& rule) {
    return Status(ErrorCode::kInvalidArgument, "grid: " + rule + " (spec codec 2)");
  };
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
  std::vector<Triangle> result(quads.size() * 2);
  const auto fill = [&](const auto& world_of) {
    const bool flip = determinant(grid) < 0;
    for (std::size_t i = 0; i < quads.size(); ++i) {
      const std::array<Triangle, 2> two = split(quads[i], world_of, flip);
      result[2 * i] = two[0];
      result[2 * i + 1] = two[1];
    }
  };
  const auto& d = grid.direction;
  const bool along_axes = d[1] == 0 && d[2] == 0 && d[3] == 0 && d[5] == 0 && d[6] == 0 && d[7] == 0;
  if (along_axes) {
    // The sums of Grid::world() without the terms that are 0: the same numbers, soon made.
    const Vec3d scale{d[0] * grid.spacing[0], d[4] * grid.spacing[1], d[8] * grid.spacing[2]};
    fill([&](std::uint32_t i) {
      const GridPosition& p = vertices[i];
      return Vec3d{grid.origin[0] + scale[0] * (static_cast<double>(p[0]) / kCell),
                   grid.origin[1] + scale[1] * (static_cast<double>(p[1]) / kCell),
                   grid.origin[2] + scale[2] * (static_cast<double>(p[2]) / kCell)};
    });
  } else {
    const std::vector<Vec3d> world = worldPositions(*this);
    fill([&](std::uint32_t i) -> const Vec3d& { return world[i]; });
  }
  return result;
}

std::vector<std::array<float, 3>> Surface::normals() const {
  std::vector<Vec3d> sums(vertices.size(), Vec3d{0, 0, 0});
  forEachTriangle(*this, [&](const Triangle& t, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    const Vec3d normal = cross(minus(b, a), minus(c, a));  // length: twice the area
    for (const std::uint32_t i : t) {
      for (std::size_t k = 0; k < 3; ++k) sums[i][k] += normal[k];
    }
  });
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
      if (a >= surface.vertices.size())
        return {ErrorCode::kBadData, "a quad names vertex " + std::to_string(a) + ", which is not there"};
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
    return {ErrorCode::kBadData,
            "not closed at the edge of vertices " + std::to_string(a) + " and " + std::to_string(b)};
  }
  return {};
}

std::uint64_t surfaceHash(const Surface& surface) {
  static_assert(std::endian::native == std::endian::little,
                "hash the elements one by one on a big-endian machine");
  XXH3_state_t* state = XXH3_createState();
  XXH3_64bits_reset(state);
  XXH3_64bits_update(state, surface.vertices.data(), surface.vertices.size() * sizeof(GridPosition));
  XXH3_64bits_update(state, surface.quads.data(), surface.quads.size() * sizeof(Quad));
  const std::uint64_t hash = XXH3_64bits_digest(state);
  XXH3_freeState(state);
  return hash;
}

}  // namespace isoreel
