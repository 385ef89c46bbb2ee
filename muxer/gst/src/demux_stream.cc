// SPDX-License-Identifier: BSD-3-Clause
#include "demux_stream.h"

#include <isoreel/codec/packet_header.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "packet_caps.h"

namespace isoreel::gst {
namespace {

using Streams = std::vector<std::unique_ptr<DemuxStream>>;

// How a reader is told which track is meant: by its number, unless another has that as its name.
std::string selector(const std::vector<TrackInfo>& tracks, std::size_t index) {
  std::string id = std::to_string(tracks[index].id);
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    if (i != index && tracks[i].name == id) return tracks[index].name;
  }
  return id;
}

Status fetch(DemuxStream& stream) {
  if (stream.pending || stream.ended) return {};
  ISOREEL_ASSIGN(stream.pending, stream.stream->next());
  stream.ended = !stream.pending.has_value();
  return {};
}

}  // namespace

const FrameHeader* DemuxStream::next() {
  if (!reader) return pending ? &pending->header : nullptr;
  const auto step = cursor->peek();
  return step ? &reader->entryHeader(step->entry) : nullptr;
}

Result<GstBuffer*> DemuxStream::take() {
  bool decode_only = false;
  Packet packet;
  if (reader) {
    const Cursor::Step step = *cursor->peek();
    ISOREEL_ASSIGN(packet.data, reader->entryPacket(step.entry));
    packet.header = reader->entryHeader(step.entry);
    jumps = jumps || step.jumps;
    decode_only = step.decode_only;
    cursor->take();
  } else {
    packet = *std::exchange(pending, std::nullopt);
  }
  GstBuffer* buffer = packetBuffer(std::move(packet), base, shift);
  if (decode_only) GST_BUFFER_FLAG_SET(buffer, GST_BUFFER_FLAG_DECODE_ONLY);
  if (std::exchange(jumps, false)) GST_BUFFER_FLAG_SET(buffer, GST_BUFFER_FLAG_DISCONT);
  return buffer;
}

void DemuxStream::play(std::uint64_t begin, std::uint64_t end, bool backward, bool keys_only) {
  cursor->play(begin, end, backward, keys_only);
  jumps = true;
  ended = eos_sent = false;
}

Result<Streams> openTracks(const std::function<std::unique_ptr<ByteSource>()>& open) {
  Streams streams;
  ISOREEL_ASSIGN(std::unique_ptr<Reader> first, Reader::open(open()));
  const std::vector<TrackInfo> tracks = first->info().tracks;
  const std::uint64_t first_id = first->info().track_id;
  for (std::size_t i = 0; i < std::max<std::size_t>(tracks.size(), 1); ++i) {
    auto& stream = streams.emplace_back(std::make_unique<DemuxStream>());
    if (tracks.empty() || tracks[i].id == first_id) {
      stream->reader = std::move(first);
    } else {
      ISOREEL_ASSIGN(stream->reader, Reader::open(open(), selector(tracks, i)));
    }
    stream->cursor.emplace(*stream->reader);
  }
  return streams;
}

Result<Streams> openStream(const std::function<std::unique_ptr<ByteSource>()>& open) {
  Streams streams;
  auto& first = streams.emplace_back(std::make_unique<DemuxStream>());
  ISOREEL_ASSIGN(first->stream, StreamReader::open(open()));
  // Records of tracks stand in front of the first packet.
  const Status begun = fetch(*first);
  if (!begun.ok() && begun.error().code != ErrorCode::kTruncated) return begun;
  const std::vector<TrackInfo> tracks = first->info().tracks;
  for (std::size_t i = 1; i < tracks.size(); ++i) {
    auto& stream = streams.emplace_back(std::make_unique<DemuxStream>());
    ISOREEL_ASSIGN(stream->stream, StreamReader::open(open(), selector(tracks, i)));
  }
  return streams;
}

Result<Bytes> configurationOf(DemuxStream& stream) {
  if (!stream.info().configuration.empty()) return stream.info().configuration;
  if (stream.reader && stream.reader->entryCount() > 0) {
    ISOREEL_ASSIGN(const Bytes packet, stream.reader->entryPacket(0));
    ISOREEL_ASSIGN(PacketHeader header, readPacketHeader(packet));
    if (!header.configuration.empty()) return std::move(header.configuration);
  }
  return {ErrorCode::kBadData, "the track's configuration is lost"};
}

void setTimes(Streams& streams) {
  const DemuxStream* earliest = nullptr;
  double seconds = 0;
  for (const auto& stream : streams) {
    stream->base = stream->info().time_base;
    const FrameHeader* header = nullptr;
    if (stream->reader && stream->reader->frameCount() > 0) header = &stream->reader->header(0);
    if (!stream->reader && stream->pending && !stream->pending->header.hidden())
      header = &stream->pending->header;
    if (header == nullptr || stream->base.seconds(header->time) >= seconds) continue;
    earliest = stream.get();
    seconds = stream->base.seconds(header->time);
    stream->shift = -std::max(header->time, -std::numeric_limits<std::int64_t>::max());
  }
  for (const auto& stream : streams) {
    if (earliest != nullptr && stream.get() != earliest) {
      const TimeBase& base = stream->base;
      stream->shift = base == earliest->base ? earliest->shift : std::llround(-seconds / base.seconds(1));
    }
    if (stream->reader) stream->timeline = Timeline(*stream->reader, stream->base, stream->shift);
  }
}

}  // namespace isoreel::gst
