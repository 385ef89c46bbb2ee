// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/codec/grid.h>

#include <array>
#include <cstdint>
#include <vector>

namespace isoreel {

using Triangle = std::array<std::uint32_t, 3>;
using Quad = std::array<std::uint32_t, 4>;

/// The dual mesh of one frame: a vertex in each active cell, or in profile main for each sheet of the surface
/// in it, and a quad for each sign-changing edge inside the grid. It is closed except at the grid's border,
/// and with a vertex for each sheet a 2-manifold (but perhaps at the border of a grid with two nodes on a
/// side). Corners run counter-clockwise seen from outside, in grid space and in the world alike (a grid whose
/// direction mirrors is accounted for by triangles()).
struct Surface {
  Grid grid;
  std::vector<GridPosition> vertices;
  std::vector<Quad> quads;

  /// World position of vertex i, i < vertices.size().
  Vec3d world(std::uint32_t i) const { return grid.world(vertices[i]); }
  /// Two triangles for each quad, split along the shorter diagonal in world space (the first when equal).
  std::vector<Triangle> triangles() const;
  /// Unit normal per vertex in world space, pointing outside: the area-weighted mean of its triangles'
  /// normals; (0, 0, 0) for a vertex without a triangle.
  std::vector<std::array<float, 3>> normals() const;
};

/// OK when the mesh is closed except at the grid's border: each edge between two cells is passed as often one
/// way as the other, unless both cells lie at the same side of the grid. Otherwise the first place where it
/// is not. For full surfaces: at a coarser octree level, cells at the border are wider than this knows.
Status checkClosed(const Surface& surface);

/// XXH3-64 of the vertices (three 32-bit little-endian integers each) followed by the quads (four each): the
/// surface hash of spec codec 7.
std::uint64_t surfaceHash(const Surface& surface);

}  // namespace isoreel
