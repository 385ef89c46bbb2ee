// SPDX-License-Identifier: BSD-3-Clause
// Morton (Z) order: the order of cells in every level of the octree, x lowest (spec codec 4.1).
#pragma once

#include <cstdint>

namespace isoreel {

/// Spreads 16 bits so that two zero bits follow each.
constexpr std::uint64_t spreadBits(std::uint32_t value) {
  std::uint64_t v = value & 0xFFFF;
  v = (v | v << 16) & 0x0000FF0000FFull;
  v = (v | v << 8) & 0x00F00F00F00Full;
  v = (v | v << 4) & 0x0C30C30C30C3ull;
  v = (v | v << 2) & 0x249249249249ull;
  return v;
}
constexpr std::uint32_t gatherBits(std::uint64_t v) {
  v &= 0x249249249249ull;
  v = (v | v >> 2) & 0x0C30C30C30C3ull;
  v = (v | v >> 4) & 0x00F00F00F00Full;
  v = (v | v >> 8) & 0x0000FF0000FFull;
  v = (v | v >> 16) & 0xFFFF;
  return static_cast<std::uint32_t>(v);
}
/// Coordinates below 65536.
constexpr std::uint64_t mortonCode(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  return spreadBits(x) | spreadBits(y) << 1 | spreadBits(z) << 2;
}

}  // namespace isoreel
