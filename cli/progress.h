// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

namespace isoreel::cli {

/// A line on stderr with count, rate and time left, redrawn a few times a second. Nothing when stderr is no
/// terminal.
class Progress {
 public:
  /// `total` may be unknown (a pipe).
  Progress(std::string what, std::optional<std::uint64_t> total);
  ~Progress();
  void advance();
  /// Wipes the line, before something else is printed.
  void clear();

 private:
  void draw();

  using Clock = std::chrono::steady_clock;
  std::string what_;
  std::optional<std::uint64_t> total_;
  bool shown_;
  bool on_screen_ = false;
  std::uint64_t done_ = 0;
  Clock::time_point start_ = Clock::now();
  Clock::time_point drawn_ = start_;
};

/// Seconds since construction.
class Stopwatch {
 public:
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace isoreel::cli
