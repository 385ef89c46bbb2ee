// SPDX-License-Identifier: BSD-3-Clause
// What pipelines show of a file of balls.
#pragma once

#include "support.h"

namespace isoreel::gst {

inline constexpr std::uint64_t kFrames = 24;
inline constexpr GstClockTime kFrameTime = GST_SECOND / 25;
inline constexpr char kSmallSink[] =
    "capsfilter caps=video/x-raw,width=16,height=12 ! fakesink name=shown sync=false enable-last-sample=true";

/// As gst-play-1.0 and other players do it: nothing but the file's name is given.
std::string playerOf(const std::string& path);

/// Waits until the sink has what it waits for.
bool settled(Pipeline& pipeline);

/// Seeks, and waits until the frame is there.
bool seekTo(Pipeline& pipeline, GstClockTime time);

/// Frame and surface hash of the picture that the sink has.
std::pair<guint64, guint64> shown(const Pipeline& pipeline);

/// Seeks to random multiples of `grain`; each time the frame of that time is shown, its surface the right
/// one.
void seekAtRandom(Pipeline& pipeline, int seeks, GstClockTime grain = 1);

/// Numbers of all frames from now to the end, in order.
std::vector<guint64> playToTheEnd(Pipeline& pipeline);

std::vector<guint64> numbersFrom(guint64 first);

}  // namespace isoreel::gst
