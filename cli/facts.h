// SPDX-License-Identifier: BSD-3-Clause
// What the headers of frames tell about a sequence, without decoding.
#pragma once

#include <isoreel/inspect/chart.h>

#include <cstdint>
#include <string>
#include <vector>

#include "input.h"
#include "metadata.h"

namespace isoreel::cli {

/// A frame that has more or fewer pieces of surface than the one before it.
struct Event {
  /// Counts alone do not tell a piece that split off from one that appeared, unless there was none before.
  enum class Kind { kAppear, kVanish, kSplitOrAppear, kMergeOrVanish };
  std::uint64_t frame = 0;  // its place among the frames, which in a damaged file may not be its number
  Kind kind = Kind::kAppear;
  std::uint32_t before = 0, after = 0;  // pieces
};
/// "appear", "vanish", "split or appear", "merge or vanish".
const char* kindName(Event::Kind kind);

/// In the order of frames. A split and a merge in one frame, or any two changes that cancel out, leave the
/// count as it was and so no event.
std::vector<Event> findEvents(const PacketSource& packets);

/// How far a frame is from what, as its header says.
Json errorJson(ErrorKind kind, double rms, double max);

/// Bytes by type of frame, area, enclosed volume and pieces over time, events marked.
inspect::Chart chartOfFacts(const Input& input, const std::string& title);

}  // namespace isoreel::cli
