// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/base/packet.h>

#include <optional>
#include <span>
#include <vector>

namespace isoreel::lavf {

/// What a packet and its carrier say about when it is shown.
struct Timing {
  std::int64_t own = 0;                 // ticks of the configuration record's time base
  std::uint64_t own_duration = 0;       // the same
  std::optional<std::int64_t> carrier;  // units of the carrier
  std::int64_t carrier_duration = 0;    // the same; 0: not told
};

/// Times of a track: those of the packets, moved by whole ticks where a cut or a join moved them, if they
/// tell no other time than the carrier to within its unit; else the carrier's (spec mappings 4). They rise.
struct TrackTimes {
  TimeBase base;
  std::vector<std::int64_t> times;
  std::vector<std::uint64_t> durations;
};
TrackTimes reconcileTimes(std::span<const Timing> timings, TimeBase own, TimeBase unit);

}  // namespace isoreel::lavf
