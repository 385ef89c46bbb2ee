// SPDX-License-Identifier: BSD-3-Clause
// When the frames of a track are shown, as GStreamer counts time, and where a seek goes.
#pragma once

#include <isoreel/base/packet.h>

#include <vector>

#include "common.h"

namespace isoreel::gst {

/// Times of the shown frames of one track. A value: other threads may have their own.
class Timeline {
 public:
  Timeline() = default;
  /// `shift` ticks are added to times, so that none of a shown frame is below 0.
  Timeline(const PacketSource& source, const TimeBase& base, std::int64_t shift);

  std::uint64_t frames() const { return starts_.size(); }
  /// Of a frame; behind the last one, the end.
  GstClockTime start(std::uint64_t frame) const {
    return frame < starts_.size() ? starts_[static_cast<std::size_t>(frame)] : end_;
  }
  GstClockTime end() const { return end_; }
  /// The frame that is shown at a time; the first, before it.
  std::uint64_t frameAt(GstClockTime time) const;
  /// The first frame that starts at a time or later; frames() when there is none.
  std::uint64_t frameFrom(GstClockTime time) const;
  /// The key frame where a seek to `time` with the flag KEY_UNIT lands, by SNAP_BEFORE and SNAP_AFTER;
  /// frames() without KEY_UNIT: the time itself is meant.
  std::uint64_t snapped(GstClockTime time, GstSeekFlags flags) const;
  /// Seconds a frame, where all last equally long; nothing where they do not.
  std::optional<TimeBase> frame() const { return frame_; }

 private:
  std::vector<GstClockTime> starts_;
  std::vector<bool> keys_;
  GstClockTime end_ = 0;
  std::optional<TimeBase> frame_;
};

}  // namespace isoreel::gst
