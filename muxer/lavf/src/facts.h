// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/base/packet.h>

#include <map>
#include <string>
#include <utility>

namespace isoreel::lavf {

/// What a frame header has and the packet has not (spec mappings 5.2), as text for a carrier's tag, and back.
/// Frames are found by what the packet says of itself, so that cuts and joins by tools that know nothing of
/// them do no harm.
class FactList {
 public:
  /// `number`: the packet's own.
  void add(std::uint64_t number, const FrameHeader& header);
  std::string text() const;

  /// Of text that breaks a rule, what comes before is taken.
  static FactList parse(const std::string& text);
  /// Fills in what is known of a frame; whether anything is.
  bool fill(std::uint64_t number, FrameHeader& header) const;

 private:
  std::map<std::pair<std::uint64_t, std::uint64_t>, FrameHeader> facts_;  // by own number and hash
};

}  // namespace isoreel::lavf
