// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/codec/grid.h>

#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace isoreel {

/// A grid of scalar samples, x fastest. `samples` has grid.nodeCount() values and stays good as long as
/// `storage`, which may be a vector, a mapped file, or empty when the caller keeps the samples alive. Copies
/// share the samples.
struct Volume {
  Grid grid;
  std::span<const float> samples;
  std::shared_ptr<const void> storage;

  static Volume own(const Grid& grid, std::vector<float> values) {
    auto kept = std::make_shared<const std::vector<float>>(std::move(values));
    return {grid, std::span<const float>(*kept), kept};
  }
  float at(std::uint32_t x, std::uint32_t y, std::uint32_t z) const {
    return samples[grid.nodeIndex(x, y, z)];
  }
};

/// Which side of the isovalue is inside. A sample equal to the isovalue is outside under either rule.
enum class Inside : std::uint8_t {
  kBelow = 0,  // sample < isovalue: level sets
  kAbove = 1,  // sample > isovalue: densities, CT
};

/// Whether a sample is inside. Not-a-number and infinities are never inside.
inline bool isInside(float sample, double isovalue, Inside inside) {
  const double value = static_cast<double>(sample);
  return value - value == 0.0 && (inside == Inside::kBelow ? value < isovalue : value > isovalue);
}

}  // namespace isoreel
