// SPDX-License-Identifier: BSD-3-Clause
// How a small signed integer is coded (spec codec 6.3): zero flag, sign, exponent in unary, mantissa.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "entropy/range_coder.h"

namespace isoreel {

/// The models of a magnitude from 1 on.
struct MagnitudeModels {
  static constexpr int kMaxExponent = 15;   // magnitudes 1 to 65535
  std::array<BitModel, kMaxExponent> more;  // whether the exponent is above i
  std::array<std::array<BitModel, 8>, kMaxExponent>
      mantissa;  // by exponent - 1: the three highest bits, as a tree
};

/// The models of one residual in one context.
struct ResidualModels {
  BitModel zero;
  BitModel negative;
  MagnitudeModels magnitude;
};

/// Puts or gets a magnitude, 1 to 65535.
template <class Coder>
std::uint32_t codeMagnitude(Coder& coder, MagnitudeModels& models, std::uint32_t magnitude) {
  const int target = Coder::kPuts ? static_cast<int>(std::bit_width(magnitude)) - 1 : 0;
  int exponent = 0;
  while (exponent < MagnitudeModels::kMaxExponent &&
         coder.code(models.more[static_cast<std::size_t>(exponent)], target > exponent)) {
    ++exponent;
  }
  std::uint32_t result = 1;
  int left = exponent;
  for (; left > 0 && exponent - left < 3; --left) {
    BitModel& model = models.mantissa[static_cast<std::size_t>(exponent - 1)][result & 7];
    result = result << 1 | std::uint32_t{coder.code(model, (magnitude >> (left - 1)) & 1)};
  }
  if (left > 0) result = result << left | coder.raw(left, magnitude & ((1u << left) - 1));
  return result;
}

/// Puts or gets a residual, |value| <= 65535.
template <class Coder>
std::int32_t codeResidual(Coder& coder, ResidualModels& models, std::int32_t value) {
  if (coder.code(models.zero, value == 0)) return 0;
  const bool negative = coder.code(models.negative, value < 0);
  const auto result = static_cast<std::int32_t>(
      codeMagnitude(coder, models.magnitude, static_cast<std::uint32_t>(value < 0 ? -value : value)));
  return negative ? -result : result;
}

}  // namespace isoreel
