// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/codec/volume.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "lattice/cell_index.h"

namespace isoreel {

using Vec3f = std::array<float, 3>;
inline float dot(const Vec3f& a, const Vec3f& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// The trilinear interpolant of a volume, less the isovalue, inside negative. Encoder only; floating point.
class VolumeField {
 public:
  struct Sample {
    float value = 0;
    Vec3f gradient{};  // within the cell, for each cell
  };

  /// `volume` must outlive it. `cells`: the active ones; samples that are not finite are taken as far outside
  /// as theirs are in the mean.
  VolumeField(const Volume& volume, double isovalue, Inside inside, std::span<const Cell> cells)
      : volume_(volume), isovalue_(isovalue), sign_(inside == Inside::kBelow ? 1.0f : -1.0f) {
    double sum = 0, count = 0;
    for (const Cell& cell : cells) {
      const float sample = volume.at(cell.x, cell.y, cell.z);
      if (!std::isfinite(sample)) continue;
      sum += std::abs(static_cast<double>(sample) - isovalue);
      ++count;
    }
    outside_ = count > 0 && sum > 0 ? static_cast<float>(sum / count) : 1.0f;
  }

  /// At a place in cells; places outside the grid are moved to its border.
  Sample at(const Vec3f& place) const {
    std::array<std::uint32_t, 3> low;
    Vec3f t;
    for (std::size_t k = 0; k < 3; ++k) {
      const float last = static_cast<float>(volume_.grid.nodes[k] - 1);
      const float p = std::clamp(place[k], 0.0f, last);
      low[k] = std::min(static_cast<std::uint32_t>(p), volume_.grid.nodes[k] - 2);
      t[k] = p - static_cast<float>(low[k]);
    }
    std::array<float, 8> v;
    const std::size_t first = volume_.grid.nodeIndex(low[0], low[1], low[2]);
    const std::size_t row = volume_.grid.nodes[0], slab = row * volume_.grid.nodes[1];
    for (std::size_t j = 0; j < 8; ++j) v[j] = node(first + (j & 1) + (j >> 1 & 1) * row + (j >> 2) * slab);
    std::array<float, 4> along_x, step_x;
    for (std::size_t j = 0; j < 4; ++j) {
      step_x[j] = v[2 * j + 1] - v[2 * j];
      along_x[j] = v[2 * j] + t[0] * step_x[j];
    }
    const float low_y = along_x[0] + t[1] * (along_x[1] - along_x[0]),
                high_y = along_x[2] + t[1] * (along_x[3] - along_x[2]);
    Sample result;
    result.value = low_y + t[2] * (high_y - low_y);
    result.gradient[2] = high_y - low_y;
    result.gradient[1] = (along_x[1] - along_x[0]) * (1 - t[2]) + (along_x[3] - along_x[2]) * t[2];
    result.gradient[0] = (step_x[0] + t[1] * (step_x[1] - step_x[0])) * (1 - t[2]) +
                         (step_x[2] + t[1] * (step_x[3] - step_x[2])) * t[2];
    return result;
  }

 private:
  float node(std::size_t index) const {
    const float value = sign_ * static_cast<float>(static_cast<double>(volume_.samples[index]) - isovalue_);
    return value - value == 0.0f ? value : outside_;
  }

  const Volume& volume_;
  double isovalue_;
  float sign_;
  float outside_ = 1;
};

}  // namespace isoreel
