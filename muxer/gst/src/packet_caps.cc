// SPDX-License-Identifier: BSD-3-Clause
#include "packet_caps.h"

#include "frame_meta.h"

namespace isoreel::gst {
namespace {

void setFraction(GstCaps* caps, const char* field, std::uint32_t numerator, std::uint32_t denominator) {
  if (numerator > G_MAXINT || denominator > G_MAXINT) return;  // no fraction of GStreamer's
  gst_caps_set_simple(caps, field, GST_TYPE_FRACTION, static_cast<gint>(numerator),
                      static_cast<gint>(denominator), nullptr);
}

}  // namespace

GstCaps* packetCaps(const Configuration& configuration, const Bytes& record, const TimeBase& base,
                    std::optional<TimeBase> frame) {
  const auto& nodes = configuration.grid.nodes;
  GstCaps* caps = gst_caps_new_simple("video/x-isoreel", "stream-format", G_TYPE_STRING, "packet", "width",
                                      G_TYPE_INT, static_cast<gint>(nodes[0]), "height", G_TYPE_INT,
                                      static_cast<gint>(nodes[1]), nullptr);
  if (frame) setFraction(caps, "framerate", frame->denominator, frame->numerator);
  setFraction(caps, "time-base", base.numerator, base.denominator);
  if (!record.empty()) {
    GstBuffer* data = bufferOf(record);
    gst_caps_set_simple(caps, "codec_data", GST_TYPE_BUFFER, data, nullptr);
    gst_buffer_unref(data);
  }
  return caps;
}

GstBuffer* packetBuffer(Packet packet, const TimeBase& base, std::int64_t shift) {
  const FrameHeader& header = packet.header;
  GstBuffer* buffer = bufferOf(std::move(packet.data));
  std::int64_t start = 0, end = 0;
  const bool exact = !__builtin_add_overflow(header.time, shift, &start) &&
                     !__builtin_add_overflow(start, header.duration, &end);
  if (exact && start >= 0) {
    GST_BUFFER_PTS(buffer) = GST_BUFFER_DTS(buffer) = toClockTime(start, base);
    GST_BUFFER_DURATION(buffer) = toClockTime(end, base) - GST_BUFFER_PTS(buffer);
  }
  GST_BUFFER_OFFSET(buffer) = header.number;
  GST_BUFFER_OFFSET_END(buffer) = header.number + 1;
  if (header.type != PacketType::kIntra) GST_BUFFER_FLAG_SET(buffer, GST_BUFFER_FLAG_DELTA_UNIT);
  if (header.hidden()) GST_BUFFER_FLAG_SET(buffer, GST_BUFFER_FLAG_DECODE_ONLY);
  addFrameHeader(buffer, header);
  return buffer;
}

}  // namespace isoreel::gst
