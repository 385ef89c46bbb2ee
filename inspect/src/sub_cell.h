// SPDX-License-Identifier: BSD-3-Clause
// The surface inside one cube of eight values, as loops over the cube's edges (marching cubes without a
// table).
#pragma once

#include <array>
#include <cstdint>

namespace isoreel::inspect {

// Corner c lies at (c & 1, c >> 1 & 1, c >> 2); edge e runs along axis e / 4 from corner kEdgeStart[e].
inline constexpr std::array<std::uint8_t, 12> kEdgeStart{0, 2, 4, 6, 0, 1, 4, 5, 0, 1, 2, 3};

/// A positive value is inside. Loops run counter-clockwise seen from outside; a loop has at least three
/// edges.
struct SubCellLoops {
  int count = 0;
  std::array<std::uint8_t, 4> sizes{};
  std::array<std::uint8_t, 12> edges{};  // loop after loop
};

/// On each face the curve separates or joins the two inside corners as the bilinear interpolant of that face
/// does, so neighbouring cubes agree and the surface is closed.
SubCellLoops subCellLoops(const std::array<double, 8>& values);

}  // namespace isoreel::inspect
