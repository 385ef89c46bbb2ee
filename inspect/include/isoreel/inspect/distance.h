// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/base/parallel.h>
#include <isoreel/codec/surface.h>
#include <isoreel/codec/volume.h>

#include <algorithm>

namespace isoreel::inspect {

/// Triangles in cells (grid space, floating point): what distances are measured between.
struct Mesh {
  std::vector<std::array<float, 3>> points;
  std::vector<Triangle> triangles;
};

/// The surface's triangles (shorter diagonal) with positions in cells.
Mesh meshOf(const Surface& surface);
/// The same in cells of another grid, which has its first and its last nodes where the surface's has them.
Mesh meshOf(const Surface& surface, const Grid& grid);

/// The volume's own isosurface: the trilinear interpolant of the samples, tessellated `refinement` times
/// finer than the grid in each active cell (1 to 16; other values are brought into that range). Closed except
/// at the grid's border; triangles run counter-clockwise seen from outside, in grid space. Samples equal to
/// the isovalue are outside, and the surface goes through their nodes. A sample that is not finite is
/// outside; it stands for minus the mean of the inside samples around it, which puts the surface in the
/// middle between it and a lone inside neighbour. Needs memory for the mesh and for two slices of the refined
/// grid.
Mesh volumeIsosurface(const Volume& volume, double isovalue, Inside inside, int refinement = 4);

/// Distances in cells.
struct Distance {
  double rms = 0;
  double max = 0;
};

struct SurfaceDistance {
  Distance forward;    // from samples of a to b
  Distance backward;   // from samples of b to a
  Distance symmetric;  // rms: root of the mean of both directions' mean squares; max: the larger
  std::size_t samples = 0;
};

/// What `isoreel compare` and `isoreel encode` sample unless they are told otherwise.
inline constexpr std::size_t kSamples = 200'000;
/// The same for small meshes, where more would tell nothing new: at most 64 for each triangle of the mesh
/// that has fewer.
inline std::size_t samplesFor(const Mesh& a, const Mesh& b) {
  return std::min(kSamples, 64 * std::min(a.triangles.size(), b.triangles.size()));
}

/// Exact nearest-point distances between uniform area-weighted samples of two meshes, both ways. Sampling is
/// deterministic (a fixed low-discrepancy sequence, `samples` each way, at least 1), and every vertex of a
/// triangle counts for the maximum too. Two meshes without triangles are at distance 0; if only one has none,
/// every figure is infinite. Less than 1e-9 cells is what rounding leaves, and counts as 0: identical meshes
/// are at distance 0. The same for every `parallel`.
SurfaceDistance distance(const Mesh& a, const Mesh& b, std::size_t samples = kSamples,
                         const ParallelFor& parallel = serialFor);

}  // namespace isoreel::inspect
