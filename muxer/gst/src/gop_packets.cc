// SPDX-License-Identifier: BSD-3-Clause
#include "gop_packets.h"

#include <isoreel/codec/packet_header.h>

#include "frame_meta.h"

namespace isoreel::gst {

TimedPacket packetOf(GstBuffer* buffer, Configuration& configuration) {
  // matroskademux tells when such packets are decoded, which is the order in which they are shown.
  TimedPacket result{{{}, bytesOf(buffer)},
                     GST_BUFFER_PTS_IS_VALID(buffer) ? GST_BUFFER_PTS(buffer) : GST_BUFFER_DTS(buffer),
                     GST_BUFFER_DURATION(buffer)};
  FrameHeader& header = result.packet.header;
  if (GST_BUFFER_FLAG_IS_SET(buffer, GST_BUFFER_FLAG_DELTA_UNIT)) header.type = PacketType::kPredicted;
  if (const Result<PacketHeader> head = readPacketHeader(result.packet.data)) {
    header.number = head->number;
    header.type = head->type;
    header.isovalue = head->isovalue;
    header.vertices = head->vertices;
    header.faces = head->faces;
    header.surface_hash = head->surface_hash;
    if (head->type == PacketType::kIntra) {
      if (const auto record = readConfiguration(head->configuration)) configuration = *record;
    }
    if (!GST_CLOCK_TIME_IS_VALID(result.duration) && head->duration <= G_MAXINT64)
      result.duration = toClockTime(static_cast<std::int64_t>(head->duration), configuration.time_base);
  }
  if (const FrameHeader* known = frameHeader(buffer)) header = *known;
  result.shown = !GST_BUFFER_FLAG_IS_SET(buffer, GST_BUFFER_FLAG_DECODE_ONLY);
  return result;
}

std::string placeOf(const FrameHeader& header) {
  return (header.hidden() ? "the hidden packet before frame " : "frame ") + std::to_string(header.number);
}

void GopPackets::add(TimedPacket timed) {
  FrameHeader& header = timed.packet.header;
  header.position = entries_.size();
  header.back = header.type == PacketType::kIntra ? 0 : last().packet.header.back + 1;
  if (timed.shown) frames_.push_back(entries_.size());
  entries_.push_back(std::move(timed));
}

void GopPackets::clear() {
  entries_.clear();
  frames_.clear();
}

}  // namespace isoreel::gst
