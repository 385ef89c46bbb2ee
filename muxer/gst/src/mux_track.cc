// SPDX-License-Identifier: BSD-3-Clause
#include "mux_track.h"

#include <isoreel/codec/configuration.h>

#include <algorithm>
#include <utility>

#include "frame_meta.h"

namespace isoreel::gst {

std::string trackName(const std::vector<TrackInfo>& others, const std::string& names,
                      const std::string& title) {
  std::size_t start = 0;
  for (std::size_t i = 0; i < others.size() && start < names.size(); ++i)
    start = std::min(names.find(',', start), names.size() - 1) + 1;
  std::string name = names.substr(start, names.find(',', start) - start);
  if (name.empty()) name = title;
  const auto taken = [&](const std::string& wanted) {
    return std::any_of(others.begin(), others.end(), [&](const TrackInfo& t) { return t.name == wanted; });
  };
  const std::string stem = name.empty() ? "track" : name;
  for (std::size_t i = 2; taken(name); ++i) name = stem + " " + std::to_string(i);
  return name;
}

// When a packet is shown, in ticks, or that it is not.
struct MuxTrack::Moment {
  std::int64_t time = 0;
  std::uint64_t duration = 1;
  bool hidden = false;
  bool beyond = false;  // behind the segment's end
};

void MuxTrack::takeCaps(const GstCaps* caps) {
  const GstStructure* structure = gst_caps_get_structure(caps, 0);
  gint numerator = 0, denominator = 0;
  if (gst_structure_get_fraction(structure, "time-base", &numerator, &denominator) && numerator > 0 &&
      denominator > 0)
    caps_base = {static_cast<std::uint32_t>(numerator), static_cast<std::uint32_t>(denominator)};
  const GValue* data = gst_structure_get_value(structure, "codec_data");
  if (data != nullptr && GST_VALUE_HOLDS_BUFFER(data)) caps_record = bytesOf(gst_value_get_buffer(data));
}

Status MuxTrack::know(GstBuffer* first) {
  const Bytes bytes = bytesOf(first);
  ISOREEL_ASSIGN(const PacketHeader own, readPacketHeader(bytes));
  if (own.type != PacketType::kIntra) return {};
  ISOREEL_ASSIGN(const Configuration configuration, readConfiguration(own.configuration));
  configuration_ = own.configuration;
  base_ = caps_base.value_or(configuration.time_base);
  return {};
}

void MuxTrack::knowByCaps() {
  const Result<Configuration> configuration = readConfiguration(caps_record);
  if (known() || !configuration) return;
  configuration_ = caps_record;
  base_ = caps_base.value_or(configuration->time_base);
}

Result<MuxTrack::Moment> MuxTrack::moment(GstBuffer* buffer, const GstSegment& segment, MuxTimes times,
                                          const PacketHeader& own) const {
  Moment moment;
  const FrameHeader* header = frameHeader(buffer);
  // The two are one; matroskademux gives DTS alone.
  const GstClockTime start = GST_BUFFER_DTS_OR_PTS(buffer);
  const GstClockTime length = GST_BUFFER_DURATION(buffer);
  moment.duration = header != nullptr ? header->duration : own.duration;
  if (start == GST_CLOCK_TIME_NONE) {
    moment.hidden = GST_BUFFER_FLAG_IS_SET(buffer, GST_BUFFER_FLAG_DECODE_ONLY);
    if (!moment.hidden) return {ErrorCode::kInvalidArgument, "the buffer has no time"};
    moment.time = header != nullptr ? header->time : own.time;
    return moment;
  }
  if (segment.format != GST_FORMAT_TIME)
    return {ErrorCode::kInvalidArgument, "the stream does not go by time, and so packets have none"};
  const GstClockTime end = length != GST_CLOCK_TIME_NONE ? start + length : start + 1;
  if (length != GST_CLOCK_TIME_NONE) {
    const std::int64_t ticks = toTicks(end, base_) - toTicks(start, base_);
    moment.duration = static_cast<std::uint64_t>(std::max<std::int64_t>(ticks, 1));
  }
  moment.beyond = segment.stop != GST_CLOCK_TIME_NONE && start >= segment.stop;
  moment.hidden = GST_BUFFER_FLAG_IS_SET(buffer, GST_BUFFER_FLAG_DECODE_ONLY) || end <= segment.start;
  guint64 time = 0;
  const gint sign = times == MuxTimes::kStream
                        ? gst_segment_to_stream_time_full(&segment, GST_FORMAT_TIME, start, &time)
                        : gst_segment_to_running_time_full(&segment, GST_FORMAT_TIME, start, &time);
  if (sign == 0) return {ErrorCode::kInvalidArgument, "the buffer's time cannot be told in its segment"};
  moment.time = sign * toTicks(time, base_);
  return moment;
}

Result<std::vector<Packet>> MuxTrack::take(GstBuffer* buffer, const GstSegment& segment, MuxTimes times,
                                           Status& warning) {
  Packet packet;
  packet.data = bytesOf(buffer);
  ISOREEL_ASSIGN(const PacketHeader own, readPacketHeader(packet.data));
  const bool key = own.type == PacketType::kIntra;
  const bool follows = known() && (key || (last_own_ && own.number - own.references.front() == *last_own_));
  if (!follows) {
    if (!std::exchange(gap_told_, true)) {
      warning = Status(ErrorCode::kBadData,
                       "packet " + std::to_string(own.number) +
                           ": the packet before it, which it needs, did not come; left out up to "
                           "the next key (spec mappings 4)");
    }
    last_own_.reset();
    return std::vector<Packet>{};
  }
  ISOREEL_ASSIGN(const Moment when, moment(buffer, segment, times, own));
  if (when.beyond) {
    last_own_.reset();
    gap_told_ = true;  // by whoever set the segment's end
    return std::vector<Packet>{};
  }
  gap_told_ = false;
  last_own_ = own.number;
  if (key) {
    hidden_.clear();
    back_ = 0;
  }
  FrameHeader& header = packet.header;
  const FrameHeader* known_header = frameHeader(buffer);
  if (known_header != nullptr && known_header->surface_hash == own.surface_hash) header = *known_header;
  header.type = own.type;
  header.isovalue = own.isovalue;
  header.vertices = own.vertices;
  header.faces = own.faces;
  header.surface_hash = own.surface_hash;
  header.number = number_;
  header.time = when.time;
  header.duration = when.duration;
  header.flags = when.hidden ? FrameHeader::kHidden : 0;
  header.back = back_++;
  hidden_.push_back(std::move(packet));
  if (when.hidden) return std::vector<Packet>{};
  ++number_;
  return std::exchange(hidden_, {});
}

}  // namespace isoreel::gst
