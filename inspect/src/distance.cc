// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/inspect/distance.h>

#include <algorithm>
#include <limits>
#include <numeric>

#include "src/nearest.h"
#include "src/vec.h"

namespace isoreel::inspect {
namespace {

constexpr std::size_t kChunk = 4096;  // fixed, so that sums do not depend on the number of threads
constexpr double kRounding = 1e-9;    // cells; what double precision leaves of a distance that is nought

std::size_t chunksOf(std::size_t count) { return (count + kChunk - 1) / kChunk; }

/// Points spread evenly over a mesh's area: one in each of `count` equal shares of the area, taken in the
/// triangles' order, and inside its triangle at the next point of Roberts' R2 sequence.
class AreaSamples {
 public:
  AreaSamples(const Mesh& mesh, std::size_t count)
      : mesh_(mesh), count_(count), until_(mesh.triangles.size()) {
    double total = 0;
    for (std::size_t i = 0; i < until_.size(); ++i) until_[i] = total += area(i);
    if (total > 0) return;
    std::iota(until_.begin(), until_.end(), 1.0);  // no area at all: every triangle has the same share
  }

  Vec3d at(std::size_t i) const {
    const double share = (static_cast<double>(i) + 0.5) / static_cast<double>(count_) * until_.back();
    const auto found = std::upper_bound(until_.begin(), until_.end() - 1, share);
    const auto [a, b, c] = corners(static_cast<std::size_t>(found - until_.begin()));
    double u = fraction(0.5 + 0.7548776662466927 * static_cast<double>(i));
    double v = fraction(0.5 + 0.5698402909980532 * static_cast<double>(i));
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    return a + (b - a) * u + (c - a) * v;
  }

 private:
  static double fraction(double x) { return x - std::floor(x); }
  std::array<Vec3d, 3> corners(std::size_t triangle) const {
    const Triangle& t = mesh_.triangles[triangle];
    return {toDouble(mesh_.points[t[0]]), toDouble(mesh_.points[t[1]]), toDouble(mesh_.points[t[2]])};
  }
  double area(std::size_t triangle) const {
    const auto [a, b, c] = corners(triangle);
    return 0.5 * length(cross(b - a, c - a));
  }

  const Mesh& mesh_;
  std::size_t count_;
  std::vector<double> until_;  // area up to and with triangle i
};

struct Sums {
  double squares = 0;
  double largest = 0;  // squared
};

/// Squared distances from samples of `from` to `to`: their mean, and their maximum with every vertex of a
/// triangle.
Sums measure(const Mesh& from, const Mesh& to, const NearestTriangle& nearest, std::size_t samples,
             const ParallelFor& parallel) {
  const AreaSamples points(from, samples);
  std::vector<Sums> parts(chunksOf(samples));
  parallel(parts.size(), [&](std::size_t chunk) {
    std::uint32_t hint = 0;
    Sums sums;
    const std::size_t end = std::min(samples, (chunk + 1) * kChunk);
    for (std::size_t i = chunk * kChunk; i < end; ++i) {
      const double squared = nearest.squared(points.at(i), hint);
      sums.squares += squared;
      sums.largest = std::max(sums.largest, squared);
    }
    parts[chunk] = sums;
  });
  Sums all;
  for (const Sums& part : parts) {
    all.squares += part.squares;
    all.largest = std::max(all.largest, part.largest);
  }

  std::vector<bool> used(from.points.size());
  for (const Triangle& t : from.triangles) {
    for (const std::uint32_t i : t) used[i] = true;
  }
  std::vector<double> largest(chunksOf(from.points.size()), all.largest);
  parallel(largest.size(), [&](std::size_t chunk) {
    std::uint32_t hint = static_cast<std::uint32_t>(chunk * to.triangles.size() / largest.size());
    const std::size_t end = std::min(from.points.size(), (chunk + 1) * kChunk);
    for (std::size_t i = chunk * kChunk; i < end; ++i) {
      // Only a vertex that may be farther than all before it needs to be looked up to the end.
      if (used[i])
        largest[chunk] =
            std::max(largest[chunk], nearest.squared(toDouble(from.points[i]), hint, largest[chunk]));
    }
  });
  for (const double part : largest) all.largest = std::max(all.largest, part);
  return all;
}

Distance toDistance(double mean_square, double largest_square) {
  const auto root = [](double square) { return square <= kRounding * kRounding ? 0 : std::sqrt(square); };
  return {root(mean_square), root(largest_square)};
}

}  // namespace

Mesh meshOf(const Surface& surface) { return meshOf(surface, surface.grid); }

Mesh meshOf(const Surface& surface, const Grid& grid) {
  Vec3d scale;
  for (std::size_t k = 0; k < 3; ++k)
    scale[k] = static_cast<double>(grid.nodes[k] - 1) / (surface.grid.nodes[k] - 1) / kCell;
  Mesh mesh;
  mesh.triangles = surface.triangles();
  mesh.points.reserve(surface.vertices.size());
  for (const GridPosition& p : surface.vertices) {
    mesh.points.push_back(toFloat({scale[0] * p[0], scale[1] * p[1], scale[2] * p[2]}));
  }
  return mesh;
}

SurfaceDistance distance(const Mesh& a, const Mesh& b, std::size_t samples, const ParallelFor& parallel) {
  SurfaceDistance result;
  if (a.triangles.empty() && b.triangles.empty()) return result;
  if (a.triangles.empty() || b.triangles.empty()) {
    constexpr double kFar = std::numeric_limits<double>::infinity();
    result.forward = result.backward = result.symmetric = {kFar, kFar};
    return result;
  }
  result.samples = std::max<std::size_t>(samples, 1);
  const Sums forward = measure(a, b, NearestTriangle(b), result.samples, parallel);
  const Sums backward = measure(b, a, NearestTriangle(a), result.samples, parallel);
  const double count = static_cast<double>(result.samples);
  result.forward = toDistance(forward.squares / count, forward.largest);
  result.backward = toDistance(backward.squares / count, backward.largest);
  result.symmetric = toDistance((forward.squares + backward.squares) / (2 * count),
                                std::max(forward.largest, backward.largest));
  return result;
}

}  // namespace isoreel::inspect
