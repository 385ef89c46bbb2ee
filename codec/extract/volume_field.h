// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/codec/volume.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "extract/coarser.h"
#include "lattice/cell_index.h"

namespace isoreel {

using Vec3f = std::array<float, 3>;
inline float dot(const Vec3f& a, const Vec3f& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// The trilinear interpolant of a volume, less the isovalue, inside negative, seen on a lattice.
/// Encoder only; floating point.
class VolumeField {
 public:
  struct Sample {
    float value = 0;
    Vec3f gradient{};  // within the cell, for each cell
  };

  /// `volume` must outlive it; `isovalue` counts as the nearest float. Places are in cells of `lattice`,
  /// which is in the same box as the volume. `cells`: the active ones of it; samples that are not finite are
  /// taken as far outside as theirs are in the mean.
  VolumeField(const Volume& volume, double isovalue, Inside inside, const Grid& lattice,
              std::span<const Cell> cells)
      : volume_(volume),
        isovalue_(static_cast<float>(isovalue)),
        sign_(inside == Inside::kBelow ? 1.0f : -1.0f),
        row_(volume.grid.nodes[0]),
        slab_(row_ * volume.grid.nodes[1]) {
    const Vec3d scale = cellsPerCell(volume.grid, lattice);
    for (std::size_t k = 0; k < 3; ++k) {
      scale_[k] = static_cast<float>(scale[k]);
      slope_[k] = sign_ * scale_[k];
      last_[k] = static_cast<float>(volume.grid.nodes[k] - 1);
      last_cell_[k] = static_cast<std::int32_t>(volume.grid.nodes[k] - 2);
    }
    double sum = 0, count = 0;
    for (const Cell& cell : cells) {
      const auto node = [&](std::size_t k, std::uint16_t of) {
        return static_cast<std::uint32_t>(scale[k] * of);
      };
      const float sample = volume.at(node(0, cell.x), node(1, cell.y), node(2, cell.z));
      if (!std::isfinite(sample)) continue;
      sum += std::abs(static_cast<double>(sample) - isovalue);
      ++count;
    }
    outside_ = count > 0 && sum > 0 ? static_cast<float>(sum / count) : 1.0f;
  }

  /// At a place; those outside the grid are moved to its border.
  Sample at(const Vec3f& place) const {
    std::array<std::size_t, 3> low;
    Vec3f t;
    for (std::size_t k = 0; k < 3; ++k) {
      const float p = std::min(std::max(0.0f, place[k] * scale_[k]), last_[k]);  // not a number: 0
      const std::int32_t cell = std::min(static_cast<std::int32_t>(p), last_cell_[k]);
      low[k] = static_cast<std::size_t>(cell);
      t[k] = p - static_cast<float>(cell);
    }
    const float* const v = volume_.samples.data() + low[0] + low[1] * row_ + low[2] * slab_;
    const float* const w = v + slab_;
    const Sample result =
        between(Four{v[0], v[row_], w[0], w[row_]}, Four{v[1], v[row_ + 1], w[1], w[row_ + 1]}, t);
    // A sample that is not finite leaves nothing finite.
    if (result.value - result.value == 0.0f) [[likely]]
      return result;
    return between(Four{finite(v[0]), finite(v[row_]), finite(w[0]), finite(w[row_])},
                   Four{finite(v[1]), finite(v[row_ + 1]), finite(w[1]), finite(w[row_ + 1])}, t);
  }

 private:
  using Four = float __attribute__((vector_size(16)));

  /// From the samples at the lower and the upper ends of a cell's four edges along x.
  Sample between(const Four& lower, const Four& upper, const Vec3f& t) const {
    const Four start = lower - isovalue_, step_x = (upper - isovalue_) - start;
    const Four along_x = start + t[0] * step_x;
    const float low_y = along_x[0] + t[1] * (along_x[1] - along_x[0]),
                high_y = along_x[2] + t[1] * (along_x[3] - along_x[2]);
    Sample result;
    result.value = sign_ * (low_y + t[2] * (high_y - low_y));
    result.gradient[2] = slope_[2] * (high_y - low_y);
    result.gradient[1] =
        slope_[1] * ((along_x[1] - along_x[0]) * (1 - t[2]) + (along_x[3] - along_x[2]) * t[2]);
    result.gradient[0] = slope_[0] * ((step_x[0] + t[1] * (step_x[1] - step_x[0])) * (1 - t[2]) +
                                      (step_x[2] + t[1] * (step_x[3] - step_x[2])) * t[2]);
    return result;
  }
  float finite(float sample) const {
    const float value = sample - isovalue_;
    return value - value == 0.0f ? sample : isovalue_ + sign_ * outside_;
  }

  const Volume& volume_;
  float isovalue_, sign_;
  float outside_ = 1;
  std::size_t row_, slab_;  // from a node to the next along y and z
  Vec3f scale_;             // the volume's cells to one of the lattice
  Vec3f slope_;             // the same with the sign
  Vec3f last_;              // nodes
  std::array<std::int32_t, 3> last_cell_;
};

}  // namespace isoreel
