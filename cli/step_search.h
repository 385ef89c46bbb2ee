// SPDX-License-Identifier: BSD-3-Clause
// The step at which something that follows from it, a distance or a length, has a wanted value.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>

namespace isoreel::cli {

/// Looks for a step at which low ≤ y ≤ high, where y rises or falls with the step throughout: false position
/// and halving in the logarithms. Ask next() and tell it what came of it by add(), until it has no more to
/// ask.
class StepSearch {
 public:
  static constexpr std::uint32_t kFinest = 16, kCoarsest = 16384;  // 1/1024 of a cell, and a cell

  /// `slope`: how log y goes with log step, about; its sign says whether y rises.
  StepSearch(double low, double high, double slope) : low_(low), high_(high), slope_(slope) {}

  std::optional<std::uint32_t> next() const {
    if (tried_.empty()) return kCoarsest / 8;
    if (tried_.size() >= kMostTries || (best() && tried_.at(*best()) >= low_)) return {};
    // The steps tried next to the place where y passes the middle.
    const auto above = std::find_if(tried_.begin(), tried_.end(),
                                    [&](const auto& t) { return (slope_ > 0) == (t.second > middle()); });
    const auto log_y = [](const auto& t) { return std::log(std::max(t->second, 1e-12)); };
    const auto log_step = [](const auto& t) { return std::log(static_cast<double>(t->first)); };
    if (above != tried_.begin() && above != tried_.end()) {
      const auto below = std::prev(above);
      if (above->first - below->first <= 1) return {};
      // Every third time half-way, since y may be flat at one end.
      const double part =
          tried_.size() % 3 == 0 ? 0.5 : (std::log(middle()) - log_y(below)) / (log_y(above) - log_y(below));
      const double place =
          log_step(below) + std::clamp(part, 0.05, 0.95) * (log_step(above) - log_step(below));
      return std::clamp(rounded(place), below->first + 1, above->first - 1);
    }
    const auto nearest = above == tried_.end() ? std::prev(above) : above;
    // Farther each time, since y may be flat here.
    const double way = (std::log(middle()) - log_y(nearest)) / slope_;
    const double least = 0.35 * static_cast<double>(tried_.size());
    const double place =
        log_step(nearest) + std::copysign(std::clamp(std::abs(way), std::min(least, 2.0), 2.0), way);
    const std::uint32_t step = std::clamp(rounded(place), kFinest, kCoarsest);
    if (tried_.contains(step)) return {};
    return step;
  }

  void add(std::uint32_t step, double y) { tried_[step] = y; }

  /// Of the steps tried, the one whose y is largest and not above `high`; none: there is no such.
  std::optional<std::uint32_t> best() const {
    std::optional<std::uint32_t> result;
    for (const auto& [step, y] : tried_) {
      if (y <= high_ && (!result || y > tried_.at(*result))) result = step;
    }
    return result;
  }

 private:
  static constexpr std::size_t kMostTries = 10;

  double middle() const { return (low_ + high_) / 2; }
  static std::uint32_t rounded(double log_step) {
    return static_cast<std::uint32_t>(std::lround(std::exp(log_step)));
  }

  double low_, high_, slope_;
  std::map<std::uint32_t, double> tried_;  // y by step
};

}  // namespace isoreel::cli
