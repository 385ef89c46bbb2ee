// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <isoreel/inspect/distance.h>

#include <limits>
#include <random>

#include "shapes.h"

namespace isoreel::inspect {
namespace {

Mesh sphere(double radius = 10) { return meshOf(sphereSurface({16, 16, 16}, radius)); }

/// n × n squares in the plane z = 3.
Mesh plane(std::uint32_t n) {
  Mesh mesh;
  for (std::uint32_t y = 0; y <= n; ++y) {
    for (std::uint32_t x = 0; x <= n; ++x)
      mesh.points.push_back({static_cast<float>(x), static_cast<float>(y), 3});
  }
  for (std::uint32_t y = 0; y < n; ++y) {
    for (std::uint32_t x = 0; x < n; ++x) {
      const std::uint32_t i = y * (n + 1) + x;
      mesh.triangles.push_back({i, i + 1, i + n + 2});
      mesh.triangles.push_back({i, i + n + 2, i + n + 1});
    }
  }
  return mesh;
}

/// A hundred random triangles, some of them needles, some without area.
Mesh rubble(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> place(0, 100), size(-4, 4);
  Mesh mesh;
  for (std::uint32_t i = 0; i < 100; ++i) {
    const std::array<float, 3> a{place(random), place(random), place(random)};
    std::array<float, 3> b = a, c = a;
    for (std::size_t k = 0; k < 3; ++k) {
      b[k] += size(random);
      c[k] = i % 5 == 0 ? a[k] + (b[k] - a[k]) * 2 + (k == 0 ? 1e-5f : 0) : c[k] + size(random);
      if (i % 11 == 0) c[k] = b[k];
    }
    mesh.points.insert(mesh.points.end(), {a, b, c});
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return mesh;
}

// The nearest point by a search over the triangle's parameters instead of geometry: slow, but of another
// kind.
double bruteDistance(const Point& p, const Mesh& mesh) {
  double best = std::numeric_limits<double>::infinity();
  for (const Triangle& t : mesh.triangles) {
    const Point a = cornerOf(mesh, t, 0), b = cornerOf(mesh, t, 1), c = cornerOf(mesh, t, 2);
    const auto at = [&](double u, double v) {
      double sum = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const double d = a[k] + (b[k] - a[k]) * u + (c[k] - a[k]) * v - p[k];
        sum += d * d;
      }
      return sum;
    };
    // Squared distance is convex in each parameter and so is its minimum over v: ternary search in both.
    const auto least = [](double low, double high, const auto& f) {
      for (int i = 0; i < 60; ++i) {
        const double x = low + (high - low) / 3, y = high - (high - low) / 3;
        (f(x) < f(y) ? high : low) = f(x) < f(y) ? y : x;
      }
      return f((low + high) / 2);
    };
    best = std::min(
        best, least(0, 1, [&](double u) { return least(0, 1 - u, [&](double v) { return at(u, v); }); }));
  }
  return std::sqrt(best);
}

TEST(Distance, OfAMeshToItselfIsNought) {
  for (const Mesh& mesh : {sphere(), plane(7), rubble(1)}) {
    const SurfaceDistance d = distance(mesh, mesh, 20'000);
    EXPECT_EQ(d.symmetric.rms, 0);
    EXPECT_EQ(d.symmetric.max, 0);
  }
}

TEST(Distance, OfAMovedSphereIsAThirdOfTheSquareInTheMean) {
  const double d = 0.25;
  for (const std::array<float, 3>& direction : {std::array<float, 3>{1, 0, 0}, {0, 0, -1}, {0.6f, 0.8f, 0}}) {
    std::array<float, 3> by = direction;
    for (float& c : by) c *= 0.25f;
    const SurfaceDistance found = distance(sphere(), moved(sphere(), by), 50'000);
    for (const Distance& way : {found.forward, found.backward, found.symmetric}) {
      EXPECT_NEAR(way.rms, d / std::sqrt(3.0), 0.01 * d);
      EXPECT_NEAR(way.max, d, 0.01 * d);
    }
  }
}

TEST(Distance, OfAMovedPlaneIsTheMove) {
  const SurfaceDistance d = distance(plane(9), moved(plane(9), {0, 0, 0.5f}), 10'000);
  EXPECT_EQ(d.forward.rms, 0.5);
  EXPECT_EQ(d.forward.max, 0.5);
  EXPECT_EQ(d.symmetric.rms, 0.5);
  EXPECT_EQ(d.samples, 10'000u);
}

TEST(Distance, EachWayIsItsOwn) {
  // All of the small plane lies on the large one; the large one's far corner is 6√2 away.
  const SurfaceDistance d = distance(plane(3), plane(9), 90'000);
  EXPECT_EQ(d.forward.max, 0);
  EXPECT_NEAR(d.backward.max, 6 * std::sqrt(2.0), 1e-9);
  // Mean square over [0, 9]²: 2 · ∫₃⁹ (x - 3)² dx / 9 = 2 · 72 / 9.
  EXPECT_NEAR(d.backward.rms, 4, 0.001);
  EXPECT_NEAR(d.symmetric.rms, std::sqrt(8.0), 0.001);
  EXPECT_EQ(d.symmetric.max, d.backward.max);
}

TEST(Distance, OfEmptyMeshesIsDefined) {
  const Mesh empty;
  const SurfaceDistance nothing = distance(empty, empty);
  EXPECT_EQ(nothing.symmetric.rms, 0);
  EXPECT_EQ(nothing.symmetric.max, 0);
  for (const SurfaceDistance& d : {distance(empty, plane(1)), distance(plane(1), empty)}) {
    EXPECT_TRUE(std::isinf(d.forward.rms) && std::isinf(d.backward.max) && std::isinf(d.symmetric.rms));
  }
}

TEST(Distance, IsExactForAnyTriangles) {
  const Mesh target = rubble(2);
  std::mt19937 random(3);
  std::uniform_real_distribution<float> place(-50, 150);
  for (int i = 0; i < 12; ++i) {
    // One triangle without extent is one query point; near ones and far ones.
    Mesh point;
    point.points = {{place(random), place(random), place(random)}};
    if (i % 3 == 0) point.points[0] = target.points[static_cast<std::size_t>(i)];
    if (i == 11) point.points[0] = {1e5f, -1e5f, 30};
    point.triangles = {{0, 0, 0}};
    const SurfaceDistance d = distance(point, target, 1);
    const double expected =
        bruteDistance({point.points[0][0], point.points[0][1], point.points[0][2]}, target);
    EXPECT_NEAR(d.forward.rms, expected, 1e-7 * (1 + expected));
    EXPECT_EQ(d.forward.rms, d.forward.max);
  }
}

TEST(Distance, EveryVertexCountsForTheMaximum) {
  Mesh spiked = plane(30);
  const auto tip = static_cast<std::uint32_t>(spiked.points.size());
  spiked.points.push_back({0.5f, 0.5f, 8});  // on a triangle too small to be sampled
  spiked.points.push_back({1, 1, 999});      // of no triangle: no part of the surface
  spiked.triangles.push_back({0, 0, tip});
  EXPECT_EQ(distance(spiked, plane(30), 100).forward.max, 5);
}

TEST(Distance, TheMaximumIsThatOfTheFarthestVertex) {
  const Mesh from = rubble(5), to = rubble(6);
  double farthest = 0;
  for (const auto& p : from.points) {
    farthest = std::max(farthest, distance({{p}, {{0, 0, 0}}}, to, 1).forward.rms);
  }
  const SurfaceDistance d = distance(from, to, 1);
  EXPECT_EQ(d.forward.max, std::max(farthest, d.forward.rms));  // rms: of the one sample
}

TEST(Distance, DoesNotDependOnThreads) {
  const Mesh a = sphere(), b = sphere(10.1);
  const SurfaceDistance serial = distance(a, b, 30'000);
  for (const unsigned threads : {2u, 5u}) {
    const SurfaceDistance d = distance(a, b, 30'000, threadedFor(threads));
    EXPECT_EQ(d.forward.rms, serial.forward.rms);
    EXPECT_EQ(d.backward.rms, serial.backward.rms);
    EXPECT_EQ(d.symmetric.max, serial.symmetric.max);
  }
}

TEST(MeshOf, IsInCellsWhateverTheWorld) {
  Surface surface = sphereSurface({16, 16, 16}, 10);
  surface.grid.spacing = {0.5, 0.5, 0.5};
  surface.grid.origin = {100, 0, 0};
  const Mesh mesh = meshOf(surface);
  EXPECT_EQ(mesh.triangles.size(), 2 * surface.quads.size());
  EXPECT_NEAR(enclosedVolume(mesh), 4.0 / 3 * std::numbers::pi * 1000, 10);
}

}  // namespace
}  // namespace isoreel::inspect
