// SPDX-License-Identifier: BSD-3-Clause
#include "frame_range.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <charconv>
#include <limits>
#include <optional>

#include "options.h"

namespace isoreel::cli {
namespace {

struct Unit {
  std::string_view name;
  std::int64_t numerator, denominator;  // of a second
};
constexpr std::array<Unit, 4> kUnits{{{"ms", 1, 1000}, {"us", 1, 1'000'000}, {"min", 60, 1}, {"s", 1, 1}}};

[[noreturn]] void refuse(const std::string& option, const std::string& text, const std::string& why) {
  throw CLI::ValidationError(option, fmt::format("'{}' {}", text, why));
}

/// The first frame that begins later than `time`; the count when none does.
std::uint64_t firstAfter(const Timeline& timeline, std::int64_t time) {
  std::uint64_t low = 0, high = timeline.count;
  while (low < high) {
    const std::uint64_t middle = low + (high - low) / 2;
    if (timeline.time(middle) <= time) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return low;
}

/// A frame as typed: its number, or the first that begins at a time or later. `shown`: the frame that is
/// shown at that time instead.
std::uint64_t parsePlace(const std::string& option, const std::string& text, const Timeline& timeline,
                         bool shown = false) {
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error == std::errc() && end == text.data() + text.size()) return number;
  for (const Unit& unit : kUnits) {
    if (!text.ends_with(unit.name)) continue;
    if (!timeline.time)
      refuse(option, text, "is a time, and those of a pipe are not known before it ends: give frame numbers");
    const Fraction value = parseFraction(option, text.substr(0, text.size() - unit.name.size()));
    std::int64_t numerator = 0, denominator = 0;
    if (__builtin_mul_overflow(value.numerator, unit.numerator, &numerator) ||
        __builtin_mul_overflow(value.denominator, unit.denominator, &denominator) ||
        numerator == std::numeric_limits<std::int64_t>::min()) {
      refuse(option, text, "has too many digits");
    }
    if (shown) {
      const std::uint64_t after = firstAfter(timeline, timeline.base.tickAt(numerator, denominator));
      return after == 0 ? timeline.count : after - 1;
    }
    // The tick before the first at or later than that time: ~x is -x - 1, and rounding -t down rounds t up.
    return firstAfter(timeline, ~timeline.base.tickAt(-numerator, denominator));
  }
  refuse(option, text, "is neither a frame (17) nor a time with its unit (2.5s, 40ms)");
}

FrameRange checked(const std::string& option, const std::string& text, FrameRange range,
                   const Timeline& timeline) {
  if (range.begin >= range.end) refuse(option, text, "holds no frame");
  if (range.end > timeline.count) {
    refuse(option, text, fmt::format("ends behind the last of {} frames", timeline.count));
  }
  return range;
}

}  // namespace

Timeline timelineOf(const PacketSource& source, TimeBase base) {
  return {source.frameCount(), base, [&source](std::uint64_t frame) { return source.header(frame).time; }};
}

FrameRange parseFrames(const std::string& text, const Timeline& timeline) {
  const std::string option = "--frames";
  if (text.empty()) return {0, timeline.count};
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos) {
    const std::uint64_t frame = parsePlace(option, text, timeline, true);
    return checked(option, text, {frame, frame + 1}, timeline);
  }
  FrameRange range{0, timeline.count};
  const std::string from = text.substr(0, colon), to = text.substr(colon + 1);
  if (!from.empty()) range.begin = parsePlace(option, from, timeline);
  if (!to.empty()) range.end = parsePlace(option, to, timeline);
  return checked(option, text, range, timeline);
}

FrameRange parseFromTo(const std::string& from, const std::string& to, const Timeline& timeline) {
  FrameRange range{0, timeline.count};
  if (!from.empty()) range.begin = parsePlace("--from", from, timeline);
  if (!to.empty()) range.end = parsePlace("--to", to, timeline);
  return checked("--from, --to", from + ":" + to, range, timeline);
}

}  // namespace isoreel::cli
