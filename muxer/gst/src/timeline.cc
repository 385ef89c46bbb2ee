// SPDX-License-Identifier: BSD-3-Clause
#include "timeline.h"

#include <algorithm>
#include <numeric>

namespace isoreel::gst {

Timeline::Timeline(const PacketSource& source, const TimeBase& base, std::int64_t shift) {
  const std::uint64_t frames = source.frameCount();
  bool even = frames > 0;
  for (std::uint64_t i = 0; i < frames; ++i) {
    const FrameHeader& header = source.header(i);
    std::int64_t ticks = 0;
    if (__builtin_add_overflow(header.time, shift, &ticks)) ticks = 0;
    starts_.push_back(toClockTime(std::max<std::int64_t>(ticks, 0), base));
    keys_.push_back(header.type == PacketType::kIntra || i == 0);
    std::int64_t end = 0;
    if (__builtin_add_overflow(ticks, header.duration, &end)) end = ticks;
    even = even && header.duration == source.header(0).duration &&
           (i + 1 == frames || source.header(i + 1).time == end - shift);
    end_ = std::max(end_, toClockTime(std::max<std::int64_t>(end, 0), base));
  }
  if (!even) return;
  const std::uint64_t duration = source.header(0).duration;
  if (duration == 0 || duration > G_MAXINT) return;
  const std::uint64_t numerator = duration * base.numerator;
  const std::uint64_t common = std::gcd(numerator, std::uint64_t{base.denominator});
  if (numerator / common > G_MAXINT || base.denominator / common > G_MAXINT) return;
  frame_ = TimeBase{static_cast<std::uint32_t>(numerator / common),
                    static_cast<std::uint32_t>(base.denominator / common)};
}

std::uint64_t Timeline::frameFrom(GstClockTime time) const {
  return static_cast<std::uint64_t>(std::lower_bound(starts_.begin(), starts_.end(), time) - starts_.begin());
}

std::uint64_t Timeline::frameAt(GstClockTime time) const {
  const std::uint64_t later =
      static_cast<std::uint64_t>(std::upper_bound(starts_.begin(), starts_.end(), time) - starts_.begin());
  return later > 0 ? later - 1 : 0;
}

std::uint64_t Timeline::snapped(GstClockTime time, GstSeekFlags flags) const {
  const bool after = (flags & GST_SEEK_FLAG_SNAP_AFTER) != 0;
  const bool before = (flags & GST_SEEK_FLAG_SNAP_BEFORE) != 0 || !after;
  if (frames() == 0 || (flags & GST_SEEK_FLAG_KEY_UNIT) == 0) return frames();
  const auto lands = [&](std::uint64_t frame) { return bool{keys_[static_cast<std::size_t>(frame)]}; };
  std::uint64_t low = frameAt(time), high = frameFrom(time);
  while (!lands(low)) --low;  // the first frame is one, hidden packets in front of it or not
  while (high < frames() && !lands(high)) ++high;
  if (!after || high == frames()) return low;
  if (!before) return high;
  return start(high) - time < time - std::min(time, start(low)) ? high : low;
}

}  // namespace isoreel::gst
