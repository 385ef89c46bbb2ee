// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/base/status.h>

#include <charconv>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

namespace isoreel::gst {

/// "V,V,..." as a property has it: kInvalidArgument, naming the property, for anything else.
inline Result<std::vector<double>> numbersIn(const std::string& property, std::string_view text) {
  std::vector<double> numbers;
  const char* at = text.data();
  const char* const end = at + text.size();
  for (;;) {
    double number = 0;
    const auto [stop, error] = std::from_chars(at, end, number);
    if (error != std::errc() || !std::isfinite(number) || (stop != end && *stop != ',')) {
      return {ErrorCode::kInvalidArgument,
              property + ": '" + std::string(text) + "' is not a list of numbers, V or V,V,..."};
    }
    numbers.push_back(number);
    if (stop == end) return numbers;
    at = stop + 1;
  }
}

}  // namespace isoreel::gst
