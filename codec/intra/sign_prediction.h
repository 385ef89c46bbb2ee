// SPDX-License-Identifier: BSD-3-Clause
// Where the signs alone put the vertices, and which way the surface looks there (spec codec 11.2, 11.3).
#pragma once

#include <span>
#include <vector>

#include "intra/sign_lanes.h"
#include "lattice/surroundings.h"

namespace isoreel {

/// What signs predict of each vertex.
struct SignPrediction {
  static constexpr int kPointBits = 11;
  /// Position in the cell, 1/2048 of a cell from its corner 0, 0 to 2048. Lane 3: 0.
  std::vector<Lanes> points;
  /// Unit normal towards the outside, 1/16384. Lane 3: the weighted balance of the 4×4×4 signs, outside minus
  /// inside, -896 to 896.
  std::vector<Lanes> normals;
  /// What may tell more of each vertex's height above its point.
  std::vector<SignInputs> inputs;

  /// `nodes`: of the grid. Keeps its memory from call to call.
  void build(std::span<const Cell> cells, const Surroundings& around,
             const std::array<std::uint32_t, 3>& nodes, const ParallelFor& parallel = serialFor);
  /// Memory beyond the object itself, and the most that build() takes: of a list of cells at the border,
  /// which doubles as it grows, the old and the new one are there at once.
  std::uint64_t bytes() const;
  static std::uint64_t bytesFor(std::size_t cells) {
    return cells * (2 * sizeof(Lanes) + sizeof(SignInputs) + 3 * sizeof(std::uint32_t));
  }

 private:
  std::vector<std::vector<std::uint32_t>> at_border_;  // by run
};

}  // namespace isoreel
