// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace isoreel {

/// A cell between eight nodes. Corner j lies at (x + (j & 1), y + (j >> 1 & 1), z + (j >> 2)); bit j of
/// `corners` is set when it is inside.
struct Cell {
  std::uint16_t x = 0;
  std::uint16_t y = 0;
  std::uint16_t z = 0;
  std::uint8_t corners = 0;
};

}  // namespace isoreel
