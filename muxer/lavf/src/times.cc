// SPDX-License-Identifier: BSD-3-Clause
#include "times.h"

#include <algorithm>

namespace isoreel::lavf {
namespace {

__extension__ using Wide = __int128;
constexpr std::int64_t kMost = std::int64_t{1} << 61;  // products with two 32-bit numbers then fit into Wide

bool beyond(std::int64_t ticks) { return ticks > kMost || ticks < -kMost; }

Wide divideRounded(Wide a, Wide b) {  // b > 0
  const Wide half = a >= 0 ? b / 2 : -(b / 2);
  return (a + half) / b;
}

/// Nothing when they disagree with the carrier.
std::optional<TrackTimes> ownTimes(std::span<const Timing> timings, TimeBase own, TimeBase unit) {
  // In parts of a second that both are multiples of.
  const Wide tick = Wide{own.numerator} * unit.denominator;
  const Wide one = Wide{unit.numerator} * own.denominator;
  TrackTimes result{own, {}, {}};
  Wide shift = 0;  // ticks
  for (const Timing& t : timings) {
    if (t.own_duration > static_cast<std::uint64_t>(kMost)) return std::nullopt;
    if (beyond(t.own) || (t.carrier && beyond(*t.carrier))) return std::nullopt;
    if (t.carrier) {
      const Wide at = *t.carrier * one;
      const auto agrees = [&] {
        const Wide difference = at - (t.own + shift) * tick;
        return difference == 0 || (-one < difference && difference < one);
      };
      if (!agrees()) shift = divideRounded(at - t.own * tick, tick);
      if (!agrees() || shift > kMost || shift < -kMost) return std::nullopt;
    }
    result.times.push_back(static_cast<std::int64_t>(t.own + shift));
    result.durations.push_back(t.own_duration);
  }
  return result;
}

TrackTimes carrierTimes(std::span<const Timing> timings, TimeBase unit) {
  TrackTimes result{unit, {}, {}};
  std::int64_t next = 0;  // for those that have none
  for (const Timing& t : timings) {
    result.times.push_back(std::clamp(t.carrier.value_or(next), -kMost, kMost));
    next = result.times.back() + std::clamp<std::int64_t>(t.carrier_duration, 1, kMost);
  }
  for (std::size_t i = 0; i < timings.size(); ++i) {
    std::int64_t duration = timings[i].carrier_duration;
    if (duration <= 0 && i + 1 < timings.size()) duration = result.times[i + 1] - result.times[i];
    if (duration <= 0 && i > 0) duration = static_cast<std::int64_t>(result.durations.back());
    result.durations.push_back(static_cast<std::uint64_t>(std::max<std::int64_t>(duration, 1)));
  }
  return result;
}

}  // namespace

/// Behind a join, a carrier that does not know how long a frame lasts may have two at one time.
void makeRising(TrackTimes& times) {
  for (std::size_t i = 1; i < times.times.size(); ++i) {
    const std::int64_t before = times.times[i - 1];
    if (times.times[i] > before) continue;
    const std::uint64_t room = before < kMost ? static_cast<std::uint64_t>(kMost) : 1;
    times.times[i] =
        before + static_cast<std::int64_t>(std::clamp<std::uint64_t>(times.durations[i - 1], 1, room));
  }
}

TrackTimes reconcileTimes(std::span<const Timing> timings, TimeBase own, TimeBase unit) {
  std::optional<TrackTimes> times = ownTimes(timings, own, unit);
  if (!times) times = carrierTimes(timings, unit);
  makeRising(*times);
  return *std::move(times);
}

}  // namespace isoreel::lavf
