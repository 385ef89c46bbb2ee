// SPDX-License-Identifier: BSD-3-Clause
// Binary STL: 80 bytes, a count, and 50 bytes a triangle. Assimp's exporter gives facets the mean of smoothed
// vertex normals instead of their own, and refuses an empty mesh.
#include <bit>
#include <cmath>
#include <cstring>

#include "src/mesh.h"

namespace isoreel::io {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are written as they lie in memory");

using Vector = std::array<float, 3>;

struct Facet {
  Vector normal;
  std::array<Vector, 3> corners;
};
static_assert(sizeof(Facet) == 48);
constexpr std::size_t kHeaderBytes = 80, kFacetBytes = sizeof(Facet) + 2;  // the last two say nothing

// Of the corners as they are written, counter-clockwise seen from outside; zero for a triangle without area.
Vector facetNormal(const std::array<Vector, 3>& corners) {
  std::array<double, 3> u{}, v{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    u[axis] = double{corners[1][axis]} - double{corners[0][axis]};
    v[axis] = double{corners[2][axis]} - double{corners[0][axis]};
  }
  const std::array<double, 3> n{u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                                u[0] * v[1] - u[1] * v[0]};
  const double length = std::hypot(n[0], n[1], n[2]);
  if (length == 0) return {0, 0, 0};
  return {static_cast<float>(n[0] / length), static_cast<float>(n[1] / length),
          static_cast<float>(n[2] / length)};
}

}  // namespace

Result<std::string> stlOf(const Mesh& mesh, const MeshOptions&) {
  std::string file = "isoreel";  // anything but "solid", which starts a text
  file.resize(kHeaderBytes + sizeof(std::uint32_t) + mesh.triangles.size() * kFacetBytes, '\0');
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  std::memcpy(&file[kHeaderBytes], &count, sizeof count);
  std::size_t at = kHeaderBytes + sizeof count;
  for (const auto& [a, b, c] : mesh.triangles) {
    Facet facet{{}, {mesh.positions[a], mesh.positions[b], mesh.positions[c]}};
    facet.normal = facetNormal(facet.corners);
    std::memcpy(&file[at], &facet, sizeof facet);
    at += kFacetBytes;
  }
  return file;
}

}  // namespace isoreel::io
