// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <isoreel/inspect/manifold.h>

#include <algorithm>

namespace isoreel::inspect {
namespace {

/// A cube with the vertices from `first`, counter-clockwise seen from outside.
std::vector<Quad> cube(std::uint32_t first) {
  std::vector<Quad> quads{{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (Quad& quad : quads) {
    for (std::uint32_t& v : quad) v += first;
  }
  return quads;
}
std::vector<Quad> twoCubes() {
  std::vector<Quad> quads = cube(0), other = cube(8);
  quads.insert(quads.end(), other.begin(), other.end());
  return quads;
}
void merge(std::vector<Quad>& quads, std::uint32_t into, std::uint32_t from) {
  for (Quad& quad : quads) std::ranges::replace(quad, from, into);
}

TEST(Manifoldness, OfClosedAndOpenCubes) {
  EXPECT_EQ(manifoldness({}, 3).faults, 0u);
  std::vector<Quad> quads = cube(0);
  const Manifoldness closed = manifoldness(quads, 8);
  EXPECT_EQ(closed.faults, 0u);
  EXPECT_EQ(closed.border, 0u);
  EXPECT_EQ(closed.first, "");
  quads.pop_back();
  const Manifoldness open = manifoldness(quads, 8);
  EXPECT_EQ(open.faults, 0u);
  EXPECT_EQ(open.border, 4u);
}

TEST(Manifoldness, FindsCubesThatTouch) {
  std::vector<Quad> quads = twoCubes();
  EXPECT_EQ(manifoldness(quads, 16).faults, 0u);
  merge(quads, 7, 8);
  const Manifoldness corner = manifoldness(quads, 16);
  EXPECT_EQ(corner.faults, 1u);
  EXPECT_EQ(corner.first, "vertex 7: several fans of quads");
  merge(quads, 3, 9);  // now along an edge
  const Manifoldness edge = manifoldness(quads, 16);
  EXPECT_EQ(edge.faults, 2u);
  EXPECT_EQ(edge.first, "vertex 3: an edge with two quads on one side");
}

TEST(Manifoldness, FindsQuadsThatAreTurnedOrFolded) {
  std::vector<Quad> turned = cube(0);
  std::swap(turned[2][1], turned[2][3]);
  EXPECT_EQ(manifoldness(turned, 8).faults, 4u);
  EXPECT_EQ(manifoldness(std::vector<Quad>{{0, 1, 2, 1}}, 3).first,
            "vertex 0: a quad that runs along an edge and back");
}

}  // namespace
}  // namespace isoreel::inspect
