// SPDX-License-Identifier: BSD-3-Clause
// Frames as people name them: by number, or by time with a unit. Bad text is a CLI::ValidationError.
#pragma once

#include <isoreel/base/packet.h>

#include <cstdint>
#include <functional>
#include <string>

namespace isoreel::cli {

/// For --help, wherever frames are chosen.
inline constexpr const char* kFramesHelp =
    "Only the frames A:B (half-open), A:, :B or A, counted from 0; or those that begin in the times A:B, "
    "with a "
    "unit: 2.5s:4s, 40ms: (default: all)";

/// Half-open range of frames.
struct FrameRange {
  std::uint64_t begin = 0;
  std::uint64_t end = 0;
  std::uint64_t size() const { return end - begin; }
};

/// How many frames there are, and when each begins.
struct Timeline {
  std::uint64_t count = 0;
  TimeBase base;
  std::function<std::int64_t(std::uint64_t)>
      time;  // of a frame, in ticks; none where times are not known yet
};
Timeline timelineOf(const PacketSource& source, TimeBase base);

/// "A:B" (half-open), "A:", ":B" or a single "A"; "" for all. A and B are numbers, or times with the unit s,
/// ms, us or min, as exact as they are typed: frames that begin at A or later and before B, and for a single
/// A the frame that is shown then.
FrameRange parseFrames(const std::string& text, const Timeline& timeline);
/// The same from two options, --from and --to, either of which may be "".
FrameRange parseFromTo(const std::string& from, const std::string& to, const Timeline& timeline);

}  // namespace isoreel::cli
