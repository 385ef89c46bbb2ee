// SPDX-License-Identifier: BSD-3-Clause
// Numbers on a surface's vertices, and the colours they are shown in.
#pragma once

#include <isoreel/inspect/distance.h>

#include <array>
#include <string>

namespace isoreel::inspect {

enum class Palette { kSequential, kDiverging };

/// Values from low to high run through the palette; those beyond take the colour of its end.
struct ColourScale {
  Palette palette = Palette::kSequential;
  double low = 0;
  double high = 1;
  std::string label;  // what is shown, with its unit
};

/// One value for each vertex of a surface; none when it is not coloured.
struct Attribute {
  std::vector<float> values;
  ColourScale scale;
};

/// sRGB of a value. Diverging: blue to red through light grey; sequential: dark violet to light yellow. Not a
/// number counts as low.
std::array<std::uint8_t, 3> colourOf(const ColourScale& scale, double value);

/// Mean curvature of each vertex in 1/cells, in grid space: half the divergence of the normal, above 0 where
/// the surface is convex seen from outside (a ball of radius r cells has 1/r). By the cotangent formula
/// (Desbrun et al., Implicit Fairing, 1999) over a quarter of the area of the vertex's quads, so that it does
/// not depend on which diagonal splits them. 0 for a vertex without a triangle and at the surface's open
/// border.
std::vector<float> meanCurvature(const Surface& surface);

/// Exact distance of each point of `mesh` to the nearest point of `reference`, in cells; 0 when `reference`
/// has no triangle.
std::vector<float> vertexDistance(const Mesh& mesh, const Mesh& reference,
                                  const ParallelFor& parallel = serialFor);

}  // namespace isoreel::inspect
