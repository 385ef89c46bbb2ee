// SPDX-License-Identifier: BSD-3-Clause
// What an element that can do less leaves out when the sink says that frames come late.
#pragma once

#include <gst/gst.h>

#include <algorithm>

namespace isoreel::gst {

/// From QoS events to how much to leave out: 0 is nothing. A late frame takes it one step up. After a while
/// without any it goes one step down; if that proves wrong, it waits twice as long the next time. Times are
/// running times. Not thread-safe.
class Lateness {
 public:
  /// A QoS event: `late` (below 0: early) is how much the frame of `time` was; `most` is the last step up.
  /// Returns whether it is answered by another step, or is about a frame from before the last one: then
  /// nobody else has to do anything.
  bool report(GstClockTime time, GstClockTimeDiff late, int most) {
    if (!GST_CLOCK_TIME_IS_VALID(time)) return false;
    if (since_ == GST_CLOCK_TIME_NONE || time < since_) return true;
    earliest_ = 0;
    if (late <= 0) {
      if (degree_ > 0 && time - since_ > patience_) change(-1);
      return false;
    }
    if (degree_ >= most) {
      since_ = time;
      earliest_ = time + 2 * static_cast<GstClockTime>(late);  // it will take a while to catch up
      return false;
    }
    if (went_down_) patience_ = std::min(2 * patience_, kMostPatience);
    change(1);
    return true;
  }

  /// How much to leave out of the frame of `time`, which comes next.
  int degree(GstClockTime time) {
    if (since_ == GST_CLOCK_TIME_NONE) since_ = time;
    return degree_;
  }
  /// That frame would come too late even with all left out that can be.
  bool hopeless(GstClockTime time, int most) const { return degree_ >= most && time < earliest_; }

 private:
  static constexpr GstClockTime kMostPatience = 32 * GST_SECOND;

  void change(int by) {
    degree_ += by;
    went_down_ = by < 0;
    since_ = GST_CLOCK_TIME_NONE;
  }

  int degree_ = 0;
  bool went_down_ = false;
  GstClockTime since_ = 0;  // the first frame of this degree, or the last late one; none yet: not valid
  GstClockTime patience_ = GST_SECOND;
  GstClockTime earliest_ = 0;  // with all left out: what is before comes too late even so
};

}  // namespace isoreel::gst
