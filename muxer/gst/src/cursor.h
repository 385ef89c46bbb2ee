// SPDX-License-Identifier: BSD-3-Clause
// Which packets to send, in which order: forward, backward, keys only.
#pragma once

#include <isoreel/base/packet.h>

#include <optional>

namespace isoreel::gst {

/// Walks the entries of a source that are needed to show a range of frames. Backward it gives GOPs from the
/// last to the first, each front to back. Entries whose key or whose predecessors are missing, as in a
/// damaged file, are left out.
class Cursor {
 public:
  struct Step {
    std::uint64_t entry = 0;
    bool jumps = false;        // it does not follow the step before it
    bool decode_only = false;  // not to be shown
  };

  /// `source` must outlive the cursor, or be replaced by extend().
  explicit Cursor(const PacketSource& source) : source_(&source) {}

  /// Frames [begin, end) are to be shown; `keys_only` shows those of their I frames, and the one before them.
  void play(std::uint64_t begin, std::uint64_t end, bool backward, bool keys_only);
  /// `source` has what the source before had and more: goes on, forward, up to frame `end`.
  void extend(const PacketSource& source, std::uint64_t end);

  /// The next step, without taking it; nothing when the range is done.
  std::optional<Step> peek();
  void take();
  /// The rest of the GOP is of no use.
  void skipToKey();

 private:
  std::uint64_t keyOf(std::uint64_t entry) const;
  bool complete(std::uint64_t entry) const;
  bool key(std::uint64_t entry) const { return source_->entryHeader(entry).type == PacketType::kIntra; }
  bool previousRun();

  const PacketSource* source_;
  std::uint64_t shown_from_ = 0;        // entry of the first frame to be shown
  std::uint64_t bottom_ = 0;            // its key
  std::uint64_t at_ = 0, run_end_ = 0;  // what is being walked
  std::uint64_t run_start_ = 0;
  bool backward_ = false, keys_only_ = false, jumps_ = true;
};

}  // namespace isoreel::gst
