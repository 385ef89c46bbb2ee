// SPDX-License-Identifier: BSD-3-Clause
// What a reader holds of a file, found by index or by scan, and the boundary where exceptions end.
#pragma once

#include <isoreel/container/file_info.h>

#include <exception>
#include <string>
#include <vector>

#include "src/format.h"

namespace isoreel::container {

struct FrameEntry {
  FrameHeader header;
  std::uint64_t offset = 0;  // of the chunk
  std::uint64_t bytes = 0;   // of the whole chunk
};

struct TrackContents {
  TrackRecord record;
  bool has_record = false;  // false: lost, only frames of this id were found
  std::vector<FrameEntry> entries;
  std::vector<std::uint64_t> shown;  // the entry of each frame

  void add(const FrameEntry& entry) {
    if (!entry.header.hidden()) shown.push_back(entries.size());
    entries.push_back(entry);
  }
  TrackInfo info() const {
    return {record.id, record.name, record.time_base, record.configuration, shown.size()};
  }
};

/// All tracks. `info` is filled but for what belongs to one of them: choose() does that.
struct Contents {
  FileInfo info;
  std::vector<TrackContents> tracks;
  std::uint64_t end = 0;  // of the last whole chunk

  /// The track of that id, added when there is none.
  TrackContents& track(std::uint64_t id);
  /// Completes `info` for the track of that name or id, the first for "", and returns its place in `tracks`.
  /// kNotFound when there is none. A file without any track is given an empty one.
  Result<std::size_t> choose(const std::string& track);
};

/// Whether `text`, not empty, is the name of the track, or the id in decimal.
bool isTrack(const TrackRecord& record, const std::string& text);

/// The parts of attachments as they come, in the file's order (spec container 6.3).
class AttachmentList {
 public:
  /// `list` gets those that are whole and not removed; it outlives this.
  explicit AttachmentList(std::vector<Attachment>& list) : list_(list) {}
  /// An ATCH chunk at `offset`: its payload is the part's head and `content_bytes` after it. kBadData when it
  /// is not the next part of the one that is open.
  Status add(const AttachmentPart& part, std::uint64_t content_bytes, std::uint64_t offset,
             std::uint64_t chunk_bytes);

 private:
  void remove(const std::string& name);

  std::vector<Attachment>& list_;
  Attachment open_;
  std::uint64_t next_part_ = 0;  // of open_; 0: none is
};

struct PartFacts {
  AttachmentPart part;
  Bytes content;
};
/// An ATCH payload taken apart, its content decompressed (at most kMaxPartContent bytes).
Result<PartFacts> readPart(ByteSpan payload);

/// The content of a CHAP payload, decompressed, and back.
Result<std::vector<Chapter>> readChapters(ByteSpan content);
Result<Bytes> writeChapters(const std::vector<Chapter>& chapters);

/// "frame 17 at byte 48213"
std::string framePlace(const FrameHeader& header, std::uint64_t offset);

/// Runs `body` and turns what libraries and callers' sources throw, out of memory for one, into an error.
template <class Body>
auto withoutThrowing(Body body) -> decltype(body()) {
  try {
    return body();
  } catch (const std::exception& e) {
    return Error{ErrorCode::kLimit, std::string("failed: ") + e.what()};
  }
}

}  // namespace isoreel::container
