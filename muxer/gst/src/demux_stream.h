// SPDX-License-Identifier: BSD-3-Clause
// A track of the file that isoreeldemux reads, and its pad.
#pragma once

#include <isoreel/container/reader.h>

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "cursor.h"
#include "timeline.h"

namespace isoreel::gst {

/// Packets of one track, from a reader with an index or from a stream that goes by once.
struct DemuxStream {
  GstPad* pad = nullptr;
  TimeBase base;
  std::int64_t shift = 0;  // ticks that are added to times
  bool jumps = true;       // the next buffer does not follow the one before it
  bool ended = false;      // nothing comes any more before the next seek
  bool eos_sent = false;

  // One of these two.
  std::unique_ptr<Reader> reader;
  std::unique_ptr<StreamReader> stream;

  std::optional<Cursor> cursor;  // of the reader
  Timeline timeline;
  std::optional<Packet> pending;  // of the stream

  const FileInfo& info() const { return reader ? reader->info() : stream->info(); }
  /// The packet that comes next: its header, or null at the end.
  const FrameHeader* next();
  /// A buffer of it. Errors (a damaged packet) take nothing.
  Result<GstBuffer*> take();
  /// Shows frames from `begin` on and before `end`, times in the segment's.
  void play(std::uint64_t begin, std::uint64_t end, bool backward, bool keys_only);
};

/// All tracks of a seekable file, front to back, each with a reader of its own over a source that `open`
/// gives. Errors as of Reader::open(); a file without a track that can be told apart is one track.
Result<std::vector<std::unique_ptr<DemuxStream>>> openTracks(
    const std::function<std::unique_ptr<ByteSource>()>& open);

/// The same for a stream that is read once: up to its first packets.
Result<std::vector<std::unique_ptr<DemuxStream>>> openStream(
    const std::function<std::unique_ptr<ByteSource>()>& open);

/// The configuration of a track: of its record, or where that is lost of its first packet.
Result<Bytes> configurationOf(DemuxStream& stream);

/// Sets base, shift and timeline: times of all tracks are moved alike where the first shown one is below 0.
void setTimes(std::vector<std::unique_ptr<DemuxStream>>& streams);

}  // namespace isoreel::gst
