// SPDX-License-Identifier: BSD-3-Clause
// Shapes whose distances, areas and pictures are known.
#pragma once

#include <isoreel/inspect/distance.h>

#include <atomic>
#include <cmath>
#include <functional>
#include <numbers>
#include <thread>

namespace isoreel::inspect {

using Point = std::array<double, 3>;

/// On `threads` threads, taking indices in an order that differs from run to run.
inline ParallelFor threadedFor(unsigned threads) {
  return [threads](std::size_t count, const std::function<void(std::size_t)>& body) {
    std::atomic<std::size_t> next{0};
    std::vector<std::thread> workers;
    for (unsigned t = 0; t < threads; ++t) {
      workers.emplace_back([&] {
        for (std::size_t i = next++; i < count; i = next++) body(i);
      });
    }
    for (std::thread& worker : workers) worker.join();
  };
}

/// A grid of `nodes` a side with spacing 1 and samples f(x, y, z).
inline Volume volumeOf(std::uint32_t nodes, const std::function<double(double, double, double)>& f) {
  Grid grid;
  grid.nodes = {nodes, nodes, nodes};
  std::vector<float> samples;
  for (std::uint32_t z = 0; z < nodes; ++z) {
    for (std::uint32_t y = 0; y < nodes; ++y) {
      for (std::uint32_t x = 0; x < nodes; ++x) samples.push_back(static_cast<float>(f(x, y, z)));
    }
  }
  return Volume::own(grid, std::move(samples));
}

/// A sphere's quads, seen from outside counter-clockwise, in a grid of 33 nodes. Poles are quads with two
/// equal corners.
inline Surface sphereSurface(const Point& centre, double radius, int rings = 48) {
  Surface surface;
  surface.grid.nodes = {33, 33, 33};
  const int segments = 2 * rings;
  for (int ring = 0; ring <= rings; ++ring) {
    const double theta = std::numbers::pi * ring / rings;
    for (int segment = 0; segment < segments; ++segment) {
      const double phi = 2 * std::numbers::pi * segment / segments;
      const Point p{centre[0] + radius * std::sin(theta) * std::cos(phi),
                    centre[1] + radius * std::sin(theta) * std::sin(phi),
                    centre[2] - radius * std::cos(theta)};
      GridPosition position;
      for (std::size_t i = 0; i < 3; ++i) position[i] = static_cast<std::int32_t>(std::lround(p[i] * kCell));
      surface.vertices.push_back(position);
    }
  }
  const auto at = [&](int ring, int segment) {
    return static_cast<std::uint32_t>(ring * segments + segment % segments);
  };
  for (int ring = 0; ring < rings; ++ring) {
    for (int segment = 0; segment < segments; ++segment) {
      surface.quads.push_back(
          {at(ring, segment), at(ring, segment + 1), at(ring + 1, segment + 1), at(ring + 1, segment)});
    }
  }
  return surface;
}

inline Mesh moved(Mesh mesh, const std::array<float, 3>& by) {
  for (auto& p : mesh.points) {
    for (std::size_t i = 0; i < 3; ++i) p[i] += by[i];
  }
  return mesh;
}

inline Point cornerOf(const Mesh& mesh, const Triangle& t, std::size_t i) {
  const auto& p = mesh.points[t[i]];
  return {p[0], p[1], p[2]};
}

/// Twice the area's vector.
inline Point crossOf(const Point& a, const Point& b, const Point& c) {
  const Point u{b[0] - a[0], b[1] - a[1], b[2] - a[2]}, v{c[0] - a[0], c[1] - a[1], c[2] - a[2]};
  return {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
}

inline double areaOf(const Mesh& mesh) {
  double area = 0;
  for (const Triangle& t : mesh.triangles) {
    const Point n = crossOf(cornerOf(mesh, t, 0), cornerOf(mesh, t, 1), cornerOf(mesh, t, 2));
    area += std::hypot(n[0], n[1], n[2]) / 2;
  }
  return area;
}

/// Positive when the triangles' outer sides look outside.
inline double enclosedVolume(const Mesh& mesh) {
  double volume = 0;
  for (const Triangle& t : mesh.triangles) {
    const Point a = cornerOf(mesh, t, 0);
    const Point n = crossOf(a, cornerOf(mesh, t, 1), cornerOf(mesh, t, 2));
    volume += (a[0] * n[0] + a[1] * n[1] + a[2] * n[2]) / 6;
  }
  return volume;
}

}  // namespace isoreel::inspect
