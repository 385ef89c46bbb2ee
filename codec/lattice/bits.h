// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace isoreel {

/// Number of bits set. std::popcount is a call into libgcc on the baseline x86-64, which has no such
/// instruction; this is a dozen operations in place. Compilers turn it into the instruction where there is
/// one.
constexpr std::uint32_t countBits(std::uint64_t v) {
  v -= v >> 1 & 0x5555555555555555;
  v = (v & 0x3333333333333333) + (v >> 2 & 0x3333333333333333);
  v = (v + (v >> 4)) & 0x0F0F0F0F0F0F0F0F;
  return static_cast<std::uint32_t>((v * 0x0101010101010101) >> 56);
}

}  // namespace isoreel
