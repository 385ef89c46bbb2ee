// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <isoreel/inspect/distance.h>

#include <limits>
#include <map>
#include <random>

#include "shapes.h"

namespace isoreel::inspect {
namespace {

double fromCentre(double x, double y, double z) { return std::hypot(x - 16.3, y - 15.9, z - 16.1); }

/// How often each directed edge is used, less its reverse; and the largest number of triangles at an edge.
struct Edges {
  bool balanced = true;
  int most = 0;
  int least = 1000;
};
Edges edgesOf(const Mesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::pair<int, int>> edges;  // (forwards, backwards)
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = t[i], b = t[(i + 1) % 3];
      ++(a < b ? edges[{a, b}].first : edges[{b, a}].second);
    }
  }
  Edges result;
  for (const auto& [edge, uses] : edges) {
    result.balanced &= uses.first == uses.second;
    result.most = std::max(result.most, uses.first + uses.second);
    result.least = std::min(result.least, uses.first + uses.second);
  }
  return result;
}

TEST(VolumeIsosurface, OfASphereIsThatSphere) {
  for (const Inside inside : {Inside::kBelow, Inside::kAbove}) {
    const double side = inside == Inside::kBelow ? 1 : -1;
    const Volume volume =
        volumeOf(33, [&](double x, double y, double z) { return side * (fromCentre(x, y, z) - 10); });
    const Mesh mesh = volumeIsosurface(volume, 0, inside);
    EXPECT_NEAR(areaOf(mesh), 4 * std::numbers::pi * 100, 0.005 * 4 * std::numbers::pi * 100);
    EXPECT_NEAR(enclosedVolume(mesh), 4.0 / 3 * std::numbers::pi * 1000,
                0.01 * 4.0 / 3 * std::numbers::pi * 1000);
    for (const auto& p : mesh.points) {
      // Trilinear interpolation of a distance field is off by at most h²/8 · curvature a direction.
      EXPECT_NEAR(fromCentre(p[0], p[1], p[2]), 10, 2.0 / 8 / 10 + 1e-3);
    }
    const Edges edges = edgesOf(mesh);
    EXPECT_TRUE(edges.balanced);
    EXPECT_EQ(edges.most, 2);
    EXPECT_EQ(edges.least, 2);
  }
}

TEST(VolumeIsosurface, VerticesLieOnTheTrilinearInterpolant) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> value(-1, 1);
  const Volume volume = volumeOf(6, [&](double, double, double) { return value(random); });
  const double iso = 0.1;
  for (const int refinement : {1, 3, 4}) {
    for (const auto& p : volumeIsosurface(volume, iso, Inside::kAbove, refinement).points) {
      std::array<std::uint32_t, 3> cell;
      Point t;
      for (std::size_t k = 0; k < 3; ++k) {
        cell[k] = std::min(static_cast<std::uint32_t>(p[k]), 4u);
        t[k] = static_cast<double>(p[k]) - cell[k];
      }
      double sum = 0;
      for (std::uint32_t c = 0; c < 8; ++c) {
        double weight = 1;
        for (std::size_t k = 0; k < 3; ++k) weight *= c >> k & 1 ? t[k] : 1 - t[k];
        sum += weight *
               static_cast<double>(volume.at(cell[0] + (c & 1), cell[1] + (c >> 1 & 1), cell[2] + (c >> 2)));
      }
      EXPECT_NEAR(sum, iso, 1e-5);
    }
  }
}

TEST(VolumeIsosurface, IsClosedForAnySigns) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    std::mt19937 random(seed);
    // Whole numbers: many samples equal the isovalue, many faces are ambiguous. The border is outside.
    std::uniform_int_distribution<int> value(-2, 2);
    const bool whole = seed % 2 == 0;
    std::uniform_real_distribution<double> real(-1, 1);
    const Volume volume = volumeOf(9, [&](double x, double y, double z) {
      const bool border = std::min({x, y, z}) == 0 || std::max({x, y, z}) == 8;
      return border ? -1.0 : whole ? value(random) : real(random);
    });
    const Mesh mesh = volumeIsosurface(volume, 0, Inside::kAbove, 1 + static_cast<int>(seed % 4));
    ASSERT_FALSE(mesh.triangles.empty());
    EXPECT_TRUE(edgesOf(mesh).balanced) << seed;
    EXPECT_GT(enclosedVolume(mesh), 0) << seed;
    for (const Triangle& t : mesh.triangles) EXPECT_TRUE(t[0] != t[1] && t[1] != t[2] && t[2] != t[0]);
  }
}

TEST(VolumeIsosurface, JoinsOrSeparatesAsTheInterpolantDoes) {
  // One cell with two inside corners across its lower face: the saddle between them is inside only if they
  // outweigh it.
  const auto triangles = [](double in, double out) {
    const Volume volume =
        volumeOf(2, [&](double x, double y, double z) { return z == 0 ? (x == y ? in : -out) : -5.0; });
    return volumeIsosurface(volume, 0, Inside::kAbove, 1).triangles.size();
  };
  EXPECT_EQ(triangles(1, 0.5), 4u);  // one loop of six edges
  EXPECT_EQ(triangles(0.5, 1), 2u);  // a triangle at either corner
}

TEST(VolumeIsosurface, MeetsNodesThatEqualTheIsovalue) {
  // Outside where x >= 4, and 0 there: the plane goes through the nodes themselves.
  const Volume volume = volumeOf(9, [](double x, double, double) { return std::min(x - 4, 0.0); });
  const Mesh mesh = volumeIsosurface(volume, 0, Inside::kBelow);
  EXPECT_DOUBLE_EQ(areaOf(mesh), 64);
  for (const auto& p : mesh.points) EXPECT_EQ(p[0], 4);
  EXPECT_EQ(mesh.points.size(), 33u * 33u);
  EXPECT_EQ(mesh.triangles.size(), 2u * 32u * 32u);
}

TEST(VolumeIsosurface, TakesSamplesThatAreNoNumbersAsOutside) {
  const double nan = std::numeric_limits<double>::quiet_NaN(),
               infinity = std::numeric_limits<double>::infinity();
  for (const double odd : {nan, infinity, -infinity}) {
    const Volume volume = volumeOf(9, [&](double x, double, double) { return x < 4 ? -3.0 : odd; });
    const Mesh mesh = volumeIsosurface(volume, 0, Inside::kBelow);
    EXPECT_NEAR(areaOf(mesh), 64, 1e-9);
    for (const auto& p : mesh.points) EXPECT_EQ(p[0], 3.5f);  // the middle of the edge
  }
}

TEST(VolumeIsosurface, IsEmptyWhereNothingChangesSign) {
  EXPECT_TRUE(volumeIsosurface(volumeOf(5, [](double, double, double) { return 1; }), 0, Inside::kBelow)
                  .triangles.empty());
  EXPECT_TRUE(volumeIsosurface(volumeOf(5, [](double, double, double) { return 0; }), 0, Inside::kAbove)
                  .triangles.empty());
  EXPECT_TRUE(volumeIsosurface(volumeOf(5, [](double, double, double) { return -1; }), 0, Inside::kBelow)
                  .triangles.empty());
}

TEST(VolumeIsosurface, FinerIsNearerToTheInterpolant) {
  const Volume volume =
      volumeOf(17, [](double x, double y, double z) { return std::hypot(x - 8, y - 8, z - 8) - 5; });
  const Mesh finest = volumeIsosurface(volume, 0, Inside::kBelow, 12);
  double before = 1;
  for (const int refinement : {1, 2, 4}) {
    const double rms =
        distance(volumeIsosurface(volume, 0, Inside::kBelow, refinement), finest, 20'000).symmetric.rms;
    EXPECT_LT(rms, before / 3);  // the error of flat triangles falls with the square
    before = rms;
  }
}

}  // namespace
}  // namespace isoreel::inspect
