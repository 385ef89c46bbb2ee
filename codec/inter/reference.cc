// SPDX-License-Identifier: BSD-3-Clause
#include "inter/reference.h"

#include <algorithm>
#include <cmath>

#include "lattice/runs.h"
#include "lattice/sign_tables.h"

namespace isoreel {
namespace {

std::int64_t floorSqrt(std::int64_t square) {
  auto root = static_cast<std::int64_t>(std::sqrt(static_cast<double>(square)));
  while (root * root > square) --root;  // the double may have been rounded up
  while ((root + 1) * (root + 1) <= square) ++root;
  return root;
}

std::array<std::int32_t, 3> unitNormal(const std::array<std::int32_t, 3>& sum, const LocalFrame& frame) {
  std::int64_t square = 0;
  for (const std::int32_t s : sum) square += std::int64_t{s} * s;
  std::array<std::int32_t, 3> unit{};
  if (square == 0) {
    for (std::size_t k = 0; k < 3; ++k) unit[k] = frame.normal[k] >> 2;
    return unit;
  }
  // Both are whole and below 2^53, so that a double's quotient is never rounded up to the next whole number.
  const auto scale = static_cast<std::int64_t>(static_cast<double>(std::int64_t{1} << 38) /
                                               static_cast<double>(floorSqrt(square)));
  for (std::size_t k = 0; k < 3; ++k) unit[k] = static_cast<std::int32_t>((sum[k] * scale) >> 26);
  return unit;
}

}  // namespace

// Adds the normal of a quad, as long as the quad's area, to the planes at those of its corners that
// chosen(corner) is for.
template <class Chosen>
void Reference::addNormal(const Surface& surface, const Quad& quad, const Chosen& chosen) {
  std::array<std::int32_t, 3> a{}, b{};
  for (std::size_t k = 0; k < 3; ++k) {
    a[k] = (surface.vertices[quad[2]][k] - surface.vertices[quad[0]][k]) >> 6;
    b[k] = (surface.vertices[quad[3]][k] - surface.vertices[quad[1]][k]) >> 6;
  }
  const std::array<std::int32_t, 3> cross{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                                          a[0] * b[1] - a[1] * b[0]};
  for (const std::uint32_t corner : quad) {
    if (!chosen(corner)) continue;
    for (std::size_t k = 0; k < 3; ++k) planes_[corner].normal[k] += cross[k];
  }
}

void Reference::setPlanes(const Surface& surface, std::span<const Cell> cells, const ParallelFor& parallel) {
  setSize(planes_, surface.vertices.size());
  const std::size_t runs = runCount(planes_.size(), 4096);
  // A run has the quads whose first corner is among its vertices, and some more, should these not be in
  // order.
  std::vector<std::size_t> first_quads{0};
  for (std::size_t n = 1; n < runs; ++n) {
    const std::size_t first = runStart(n, runs, planes_.size());
    const auto found =
        std::partition_point(surface.quads.begin() + static_cast<std::ptrdiff_t>(first_quads.back()),
                             surface.quads.end(), [&](const Quad& quad) { return quad[0] < first; });
    first_quads.push_back(static_cast<std::size_t>(found - surface.quads.begin()));
  }
  first_quads.push_back(surface.quads.size());
  // To the normals of a run's own vertices its quads add at once, to others when all runs have.
  parallel(runs, [&](std::size_t n) {
    const std::size_t first = runStart(n, runs, planes_.size()), end = runStart(n + 1, runs, planes_.size());
    for (std::size_t i = first; i < end; ++i) planes_[i] = {surface.vertices[i], {}};
    for (std::size_t q = first_quads[n]; q < first_quads[n + 1]; ++q)
      addNormal(surface, surface.quads[q],
                [&](std::uint32_t corner) { return corner - first < end - first; });
  });
  for (std::size_t n = 0; n < (runs > 1 ? runs : 0); ++n) {
    const std::size_t first = runStart(n, runs, planes_.size()), end = runStart(n + 1, runs, planes_.size());
    const auto foreign = [&](std::uint32_t corner) { return corner - first >= end - first; };
    for (std::size_t q = first_quads[n]; q < first_quads[n + 1]; ++q) {
      const Quad& quad = surface.quads[q];
      if (foreign(quad[0]) || foreign(quad[1]) || foreign(quad[2]) || foreign(quad[3]))
        addNormal(surface, quad, foreign);
    }
  }
  forRuns(parallel, planes_.size(), 4096, [&](std::size_t first, std::size_t end) {
    for (std::size_t i = first; i < end; ++i)
      planes_[i].normal = unitNormal(planes_[i].normal, kLocalFrames[cells[i].corners]);
  });
  field_.clear();
}

}  // namespace isoreel
