// SPDX-License-Identifier: BSD-3-Clause
// Where the signs alone put the vertices, and which way the surface looks there (spec codec 11.2, 11.3).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "lattice/surroundings.h"

namespace isoreel {

/// Four lanes of 16 bits: x, y, z and one more.
struct alignas(8) Lanes {
  std::array<std::int16_t, 4> v{};
};

/// Inputs of the height's prediction, in 1/16384 of a cell or a like unit, and how bent the surface is.
struct alignas(16) SignInputs {
  static constexpr std::size_t kCount = 6;
  std::array<std::int16_t, kCount> v{};
  std::int16_t bend = 0;  // 0 to 15
};

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
             const std::array<std::uint32_t, 3>& nodes);
  /// Memory beyond the object itself, and what build() takes.
  std::uint64_t bytes() const;
  static std::uint64_t bytesFor(std::size_t cells) {
    return cells * (4 * sizeof(Lanes) + sizeof(SignInputs));
  }

 private:
  SignInputs inputsOf(std::size_t i, const Surroundings& around) const;

  std::vector<Lanes> start_, other_;
};

}  // namespace isoreel
