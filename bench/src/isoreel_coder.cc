// SPDX-License-Identifier: BSD-3-Clause
#include "isoreel_coder.h"

#include <isoreel/codec/decoder.h>

namespace isoreel::bench {

Status IsoreelCoder::encode(std::span<const Frame> frames) {
  packets_.clear();
  parts_ = {};
  ISOREEL_ASSIGN(Encoder encoder, Encoder::create(settings_));
  for (std::size_t i = 0; i < frames.size(); ++i) {
    FrameTiming timing;
    timing.number = i;
    timing.time = static_cast<std::int64_t>(i);
    timing.isovalue = frames[i].isovalue;
    PacketSizes sizes;
    ISOREEL_ASSIGN(Packet packet, encoder.encode(frames[i].volume, timing, &sizes));
    packets_.push_back(std::move(packet.data));
    parts_.signs += sizes.signs;
    parts_.motion += sizes.motion;
    parts_.vertices += sizes.vertices;
    parts_.other += sizes.other;
  }
  return {};
}

Status IsoreelCoder::decode(const std::function<void(std::size_t, const Surface&)>& visit) const {
  Decoder decoder;
  for (std::size_t i = 0; i < packets_.size(); ++i) {
    ISOREEL_ASSIGN(const Surface surface, decoder.decode(packets_[i]));
    if (visit) {
      visit(i, surface);
    } else {
      const auto triangles =
          surface.triangles();  // the others give triangles, so ours have to be made as well
      if (triangles.size() != 2 * surface.quads.size()) return {ErrorCode::kBadData, "triangles are missing"};
    }
  }
  return {};
}

std::size_t IsoreelCoder::bytes() const {
  std::size_t sum = 0;
  for (const Bytes& packet : packets_) sum += packet.size();
  return sum;
}

}  // namespace isoreel::bench
