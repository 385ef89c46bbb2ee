// SPDX-License-Identifier: BSD-3-Clause
#include "cursor.h"

#include <algorithm>

namespace isoreel::gst {

std::uint64_t Cursor::keyOf(std::uint64_t entry) const {
  while (entry > 0 && !key(entry)) --entry;
  return entry;
}

// Positions of packets count up by one where none is missing.
bool Cursor::complete(std::uint64_t entry) const {
  const FrameHeader& header = source_->entryHeader(entry);
  return header.back <= entry &&
         source_->entryHeader(entry - header.back).position + header.back == header.position;
}

void Cursor::play(std::uint64_t begin, std::uint64_t end, bool backward, bool keys_only) {
  backward_ = backward;
  keys_only_ = keys_only;
  jumps_ = true;
  at_ = run_end_ = run_start_ = bottom_ = 0;
  end = std::min(end, source_->frameCount());
  if (begin >= end) return;
  shown_from_ = source_->entryOf(begin);
  bottom_ = keyOf(shown_from_);
  run_start_ = run_end_ = source_->entryOf(end - 1) + 1;
  if (backward_) {
    previousRun();
  } else {
    at_ = bottom_;
  }
}

void Cursor::extend(const PacketSource& source, std::uint64_t end) {
  source_ = &source;
  end = std::min(end, source.frameCount());
  if (end > 0) run_end_ = std::max(run_end_, source.entryOf(end - 1) + 1);
}

bool Cursor::previousRun() {
  if (run_start_ <= bottom_) return false;
  run_end_ = run_start_;
  at_ = run_start_ = keyOf(run_end_ - 1);
  jumps_ = true;
  return true;
}

std::optional<Cursor::Step> Cursor::peek() {
  for (;;) {
    if (at_ >= run_end_) {
      if (!backward_ || !previousRun()) return {};
    } else if ((keys_only_ && !key(at_)) || !complete(at_)) {
      ++at_;
      jumps_ = true;
    } else {
      const bool early = at_ < shown_from_ && !keys_only_;
      return Step{at_, jumps_, early || source_->entryHeader(at_).hidden()};
    }
  }
}

void Cursor::take() {
  ++at_;
  jumps_ = false;
}

void Cursor::skipToKey() {
  do ++at_;
  while (at_ < run_end_ && !key(at_));
  jumps_ = true;
}

}  // namespace isoreel::gst
