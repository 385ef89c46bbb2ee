// SPDX-License-Identifier: BSD-3-Clause
#include "src/sub_cell.h"

#include <cstddef>

namespace isoreel::inspect {
namespace {

// Corners of each face, counter-clockwise seen from outside the cube.
constexpr std::array<std::array<std::uint8_t, 4>, 6> kFaces{
    {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};

constexpr std::uint8_t edgeBetween(std::uint8_t a, std::uint8_t b) {
  const int axis = (a ^ b) >> 1;  // 1, 2, 4 → 0, 1, 2
  const int start = a < b ? a : b;
  for (int e = 4 * axis; e < 4 * axis + 4; ++e) {
    if (kEdgeStart[static_cast<std::size_t>(e)] == start) return static_cast<std::uint8_t>(e);
  }
  return 0;
}

// kFaceEdges[f][i] joins corners i and i + 1 of face f.
constexpr auto kFaceEdges = [] {
  std::array<std::array<std::uint8_t, 4>, 6> edges{};
  for (std::size_t f = 0; f < 6; ++f) {
    for (std::size_t i = 0; i < 4; ++i) edges[f][i] = edgeBetween(kFaces[f][i], kFaces[f][(i + 1) % 4]);
  }
  return edges;
}();

}  // namespace

SubCellLoops subCellLoops(const std::array<double, 8>& values) {
  // Round a face, the surface's curve goes from the edge on which we enter the inside to the one on which we
  // leave it. An edge that is entered on one face is left on its other one: so `next` visits each crossed
  // edge once.
  constexpr std::uint8_t kNone = 255;
  std::array<std::uint8_t, 12> next;
  next.fill(kNone);
  for (std::size_t f = 0; f < 6; ++f) {
    std::array<double, 4> v;
    for (std::size_t i = 0; i < 4; ++i) v[i] = values[kFaces[f][i]];
    const auto inside = [&](std::size_t i) { return v[i % 4] > 0; };
    const bool ambiguous = inside(0) == inside(2) && inside(1) == inside(3) && inside(0) != inside(1);
    // The sign of the bilinear interpolant at its saddle.
    const bool joined = ambiguous && (inside(0) ? v[0] * v[2] > v[1] * v[3] : v[1] * v[3] > v[0] * v[2]);
    for (std::size_t i = 0; i < 4; ++i) {
      if (inside(i) || !inside(i + 1)) continue;  // not entered here
      std::size_t leave = joined ? i + 3 : i + 1;
      while (!joined && inside(leave + 1)) ++leave;
      next[kFaceEdges[f][i]] = kFaceEdges[f][leave % 4];
    }
  }

  SubCellLoops loops;
  std::size_t used = 0;
  for (std::size_t first = 0; first < 12; ++first) {
    if (next[first] == kNone) continue;
    std::uint8_t size = 0;
    for (std::size_t edge = first; next[edge] != kNone; ++size) {
      loops.edges[used++] = static_cast<std::uint8_t>(edge);
      const std::size_t after = next[edge];
      next[edge] = kNone;
      edge = after;
    }
    loops.sizes[static_cast<std::size_t>(loops.count++)] = size;
  }
  return loops;
}

}  // namespace isoreel::inspect
