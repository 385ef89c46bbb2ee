// SPDX-License-Identifier: BSD-3-Clause
// Values as people type them on the command line. Everything here throws CLI::ValidationError on bad text.
#pragma once

#include <isoreel/base/packet.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace isoreel::cli {

/// An exact fraction, denominator above 0.
struct Fraction {
  std::int64_t numerator = 0;
  std::int64_t denominator = 1;
  double value() const { return static_cast<double>(numerator) / static_cast<double>(denominator); }
};
/// "25", "30000/1001", "0.04", "-1.5": exact. `option` is for the message.
Fraction parseFraction(const std::string& option, const std::string& text);

/// "0.1,0.2,0.3".
std::vector<double> parseNumbers(const std::string& option, const std::string& text);

/// Times of frames in ticks of a common base, and their durations.
struct FrameTimes {
  TimeBase base;
  std::vector<std::int64_t> times;
  std::vector<std::uint64_t> durations;
};
/// Frame i at i / fps.
FrameTimes constantRate(const std::string& fps, std::size_t frames);
/// One time in seconds a line (a fraction or a decimal), rising, as many as frames; empty lines and #
/// comments are skipped. A last frame lasts as long as the one before it.
FrameTimes timesFromFile(const std::string& path, std::size_t frames);
/// Frame i at seconds[i], to the nanosecond; nothing when there is a single one, or when they do not rise or
/// lie beyond a century. A last frame lasts as long as the one before it.
std::optional<FrameTimes> timesInSeconds(const std::vector<double>& seconds);

/// Whether an output name counts its frames (holds %d, %05d …), and the name of one frame.
bool countsFrames(const std::string& pattern);
std::string frameName(const std::string& pattern, std::uint64_t number);

}  // namespace isoreel::cli
