// SPDX-License-Identifier: BSD-3-Clause
#include "sequence.h"

#include <isoreel/codec/encoder.h>

#include <cmath>

namespace isoreel::gst {
namespace {

struct Coded {
  std::vector<Packet> packets;
  Bytes record;
};

const Coded& ball() {
  static const Coded coded = [] {
    Coded result;
    EncoderSettings settings;
    settings.configuration.inside = Inside::kBelow;
    settings.configuration.grid.nodes = {21, 19, 17};
    settings.configuration.grid.origin = {-10, -9, -8};
    settings.frame_types = FrameTypes::kAuto;
    settings.gop = kGop;
    auto encoder = Encoder::create(settings);
    const Grid& grid = settings.configuration.grid;
    for (std::uint64_t i = 0; i < kFrames; ++i) {
      std::vector<float> distance;
      const double t = static_cast<double>(i);
      for (std::uint32_t n = 0; n < grid.nodeCount(); ++n) {
        const auto [x, y, z] = grid.world(Vec3d{double(n % 21), double(n / 21 % 19), double(n / 21 / 19)});
        distance.push_back(static_cast<float>(std::hypot(x - 0.1 * t, y, z + 0.05 * t) - 4 - 0.08 * t));
      }
      result.packets.push_back(*encoder->encode(Volume::own(grid, std::move(distance)),
                                                {.number = i, .time = static_cast<std::int64_t>(i)}));
    }
    result.record = encoder->configurationRecord();
    return result;
  }();
  return coded;
}

}  // namespace

const std::vector<Packet>& ballPackets() { return ball().packets; }

const Bytes& ballRecord() { return ball().record; }

Surface ballSurface(std::size_t i) {
  Decoder decoder;
  for (std::size_t k = i - i % kGop; k < i; ++k) static_cast<void>(decoder.decode(ballPackets()[k].data));
  return *decoder.decode(ballPackets()[i].data);
}

GstBuffer* bufferFor(const Packet& packet) {
  GstBuffer* buffer = gst_buffer_new_memdup(packet.data.data(), packet.data.size());
  GST_BUFFER_PTS(buffer) = static_cast<GstClockTime>(packet.header.time) * kFrameTime;
  GST_BUFFER_DURATION(buffer) = kFrameTime;
  if (packet.header.type == PacketType::kPredicted) GST_BUFFER_FLAG_SET(buffer, GST_BUFFER_FLAG_DELTA_UNIT);
  return buffer;
}

}  // namespace isoreel::gst
