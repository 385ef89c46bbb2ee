// SPDX-License-Identifier: BSD-3-Clause
// What the signs of a cell's eight corners say of the surface inside it: the tables of spec codec 5.1.
#pragma once

#include <array>
#include <cstdint>

namespace isoreel {

/// The local frame of a sign configuration (paper, section 2; Lee, Desbrun, Schröder 2003): the vertex that
/// signs of ±1 give, and the axes in which its residual is coded. Positions in 1/16384 of a cell from corner
/// 0, axes in 1/16384.
struct LocalFrame {
  std::array<std::int32_t, 3> vertex{};
  std::array<std::int32_t, 3> normal{};  // towards the outside
  std::array<std::int32_t, 3> tangent1{};
  std::array<std::int32_t, 3> tangent2{};
};

/// One frame for each of the 256 configurations; bit j of the index is set when corner j is inside.
extern const std::array<LocalFrame, 256> kLocalFrames;

}  // namespace isoreel
