// SPDX-License-Identifier: BSD-3-Clause
// The surface that a P packet is predicted from, and what it says of a place near it (spec codec 8.4).
#pragma once

#include <isoreel/codec/surface.h>

#include <span>

#include "inter/neighbours.h"
#include "lattice/sign_tables.h"

namespace isoreel {

/// Sums over the planes of the previous surface's vertices around a place: the moved previous surface's
/// distance field there, as a plane.
struct PlaneSums {
  std::int32_t weight = 0;               // of all planes; 0: the surface is not near
  std::int64_t distance = 0;             // weight × signed distance, 1/16384 of a cell, outside positive
  std::int64_t squares = 0;              // weight × squared distance, 1/1024 of a cell squared
  std::array<std::int64_t, 3> normal{};  // weight × unit normal, 1/4096
};

/// The decoded surface of the packet before, with a unit normal per vertex, findable by cell.
class Reference {
 public:
  /// Takes `index`, that of the surface's cells in the order of its vertices, and leaves another in its
  /// place.
  void build(const Surface& surface, std::span<const Cell> cells, CellIndex& index);

  /// The planes of vertices around `at` (grid space, 1/16384 of a cell; anywhere) that lie in the likelihood
  /// ellipsoid of `frame` and look the same way, weighted by how deep inside it they are. `neighbours`: of
  /// this reference's index.
  PlaneSums planesAround(const std::array<std::int32_t, 3>& at, const LocalFrame& frame,
                         Neighbours& neighbours) const;

  std::uint32_t size() const { return static_cast<std::uint32_t>(samples_.size()); }
  const CellIndex& index() const { return index_; }
  /// Memory beyond the object itself.
  std::uint64_t bytes() const { return samples_.capacity() * sizeof(Sample) + index_.bytes(); }
  /// For the encoder's search, in cells.
  std::array<float, 3> position(std::uint32_t i) const { return scaled(samples_[i].position, kCell); }
  std::array<float, 3> normal(std::uint32_t i) const { return scaled(samples_[i].normal, 4096); }

 private:
  static std::array<float, 3> scaled(const std::array<std::int32_t, 3>& v, std::int32_t unit) {
    const float scale = 1.0f / static_cast<float>(unit);
    return {static_cast<float>(v[0]) * scale, static_cast<float>(v[1]) * scale,
            static_cast<float>(v[2]) * scale};
  }
  struct Sample {
    GridPosition position;
    std::array<std::int32_t, 3> normal;  // 1/4096, outside
  };
  std::vector<Sample> samples_;
  CellIndex index_;
};

}  // namespace isoreel
