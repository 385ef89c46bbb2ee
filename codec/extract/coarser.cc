// SPDX-License-Identifier: BSD-3-Clause
#include "extract/coarser.h"

#include <isoreel/codec/encoder.h>

#include <cmath>

namespace isoreel {
namespace {

/// Between which two nodes of the finer grid a node lies, and how far from the first to the second.
struct Between {
  std::size_t first, second;
  float t;
};

std::vector<Between> placesOf(std::uint32_t nodes, std::uint32_t coarser_nodes) {
  std::vector<Between> result;
  for (std::uint64_t i = 0; i < coarser_nodes; ++i) {
    const std::uint64_t product = i * (nodes - 1), cells = coarser_nodes - 1;
    const std::size_t first = product / cells;
    const auto rest = static_cast<float>(product % cells) / static_cast<float>(cells);
    result.push_back({first, first + (rest > 0), rest});
  }
  return result;
}

float lerp(float a, float b, float t) { return t == 0 ? a : a + t * (b - a); }

}  // namespace

Grid coarserGrid(const Grid& grid, double cell) {
  Grid result = grid;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint32_t cells = grid.nodes[k] - 1;
    const auto fewer = static_cast<std::uint32_t>(std::ceil(cells / std::max(1.0, cell) - 1e-9));
    result.nodes[k] = std::max(1u, fewer) + 1;
    if (result.nodes[k] != grid.nodes[k]) result.spacing[k] = grid.spacing[k] * cells / (result.nodes[k] - 1);
  }
  return result;
}

Volume resampled(const Volume& volume, const Grid& grid, const ParallelFor& parallel) {
  std::array<std::vector<Between>, 3> places;
  for (std::size_t k = 0; k < 3; ++k) places[k] = placesOf(volume.grid.nodes[k], grid.nodes[k]);
  std::vector<float> samples(grid.nodeCount());
  const std::size_t row = volume.grid.nodes[0], slab = row * volume.grid.nodes[1];
  parallel(grid.nodes[2], [&](std::size_t k) {
    const Between z = places[2][k];
    float* to = samples.data() + k * grid.nodes[0] * grid.nodes[1];
    for (const Between& y : places[1]) {
      const float* const from = volume.samples.data();
      const std::array<const float*, 4> rows{
          from + y.first * row + z.first * slab, from + y.second * row + z.first * slab,
          from + y.first * row + z.second * slab, from + y.second * row + z.second * slab};
      for (const Between& x : places[0]) {
        const auto along_x = [&](const float* samples_of_row) {
          return lerp(samples_of_row[x.first], samples_of_row[x.second], x.t);
        };
        *to++ = lerp(lerp(along_x(rows[0]), along_x(rows[1]), y.t),
                     lerp(along_x(rows[2]), along_x(rows[3]), y.t), z.t);
      }
    }
  });
  return Volume::own(grid, std::move(samples));
}

}  // namespace isoreel
