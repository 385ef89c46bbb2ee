// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/inspect/attribute.h>

#include <algorithm>

#include "src/nearest.h"
#include "src/vec.h"

namespace isoreel::inspect {
namespace {

constexpr std::size_t kChunk = 4096;

bool mirrored(const Grid& grid) {
  const auto& d = grid.direction;
  return d[0] * (d[4] * d[8] - d[5] * d[7]) - d[1] * (d[3] * d[8] - d[5] * d[6]) +
             d[2] * (d[3] * d[7] - d[4] * d[6]) <
         0;
}

/// Vertices on an edge that only one quad has.
std::vector<bool> borderVertices(const Surface& surface) {
  std::vector<std::array<std::uint32_t, 2>> edges;
  edges.reserve(surface.quads.size() * 4);
  for (const Quad& quad : surface.quads) {
    for (std::size_t i = 0; i < 4; ++i) {
      const auto [a, b] = std::minmax(quad[i], quad[(i + 1) % 4]);
      edges.push_back({a, b});
    }
  }
  std::sort(edges.begin(), edges.end());
  std::vector<bool> border(surface.vertices.size());
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t end = i + 1;
    while (end < edges.size() && edges[end] == edges[i]) ++end;
    if (end == i + 1) border[edges[i][0]] = border[edges[i][1]] = true;
    i = end;
  }
  return border;
}

}  // namespace

std::vector<float> meanCurvature(const Surface& surface) {
  const Mesh mesh = meshOf(surface);
  struct Sums {
    Vec3d laplacian{0, 0, 0}, normal{0, 0, 0};
    double area = 0;
  };
  std::vector<Sums> sums(mesh.points.size());
  for (std::size_t n = 0; n < mesh.triangles.size(); ++n) {
    const Triangle& t = mesh.triangles[n];
    std::array<Vec3d, 3> p;
    for (std::size_t i = 0; i < 3; ++i) p[i] = toDouble(mesh.points[t[i]]);
    const Vec3d normal = cross(p[1] - p[0], p[2] - p[0]);  // length: twice the area
    const double twice = length(normal);
    if (twice < 1e-9) continue;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
      const double cotangent = dot(p[j] - p[i], p[k] - p[i]) / twice;
      const Vec3d along = (p[k] - p[j]) * cotangent;
      sums[t[j]].laplacian = sums[t[j]].laplacian + along;
      sums[t[k]].laplacian = sums[t[k]].laplacian - along;
      sums[t[i]].normal = sums[t[i]].normal + normal;
    }
    for (const std::uint32_t corner : surface.quads[n / 2]) sums[corner].area += twice / 8;
  }
  const std::vector<bool> border = borderVertices(surface);
  // The sum is 2 * area * the mean curvature's vector, twice over, and points inwards where convex.
  const double side = mirrored(surface.grid) ? 1 : -1;
  std::vector<float> result(sums.size(), 0.f);
  for (std::size_t i = 0; i < sums.size(); ++i) {
    if (border[i] || sums[i].area == 0) continue;
    result[i] =
        static_cast<float>(side * dot(sums[i].laplacian, normalized(sums[i].normal)) / (4 * sums[i].area));
  }
  return result;
}

std::vector<float> vertexDistance(const Mesh& mesh, const Mesh& reference, const ParallelFor& parallel) {
  std::vector<float> result(mesh.points.size(), 0.f);
  if (reference.triangles.empty()) return result;
  const NearestTriangle nearest(reference);
  parallel((result.size() + kChunk - 1) / kChunk, [&](std::size_t chunk) {
    std::uint32_t hint = 0;
    const std::size_t end = std::min(result.size(), (chunk + 1) * kChunk);
    for (std::size_t i = chunk * kChunk; i < end; ++i)
      result[i] = static_cast<float>(std::sqrt(nearest.squared(toDouble(mesh.points[i]), hint)));
  });
  return result;
}

}  // namespace isoreel::inspect
