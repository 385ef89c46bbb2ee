// SPDX-License-Identifier: BSD-3-Clause
// Small volumes made of arbitrary bytes, encoded and decoded: the decoder takes every packet that the encoder
// writes, at any level, and gives the surface that the encoder says.
#include <isoreel/codec/decoder.h>
#include <isoreel/codec/encoder.h>

#include <algorithm>
#include <cstdlib>

namespace {

using isoreel::ByteReader;

constexpr int kFrames = 3;

/// The samples of one frame, from as many bytes as there are; then the bytes of the frame before, moved by a
/// node.
std::vector<float> samples(ByteReader& in, const std::array<std::uint32_t, 3>& nodes,
                           const std::vector<float>& before) {
  std::vector<float> result(std::size_t{nodes[0]} * nodes[1] * nodes[2]);
  for (std::size_t i = 0; i < result.size(); ++i) {
    if (in.left() > 0) {
      result[i] = static_cast<float>(in.fixed<std::uint8_t>()) - 127.5f;
    } else {
      result[i] = before.empty() ? static_cast<float>(i % 7) - 3.5f : before[i == 0 ? 0 : i - 1];
    }
  }
  return result;
}

void need(bool good) {
  if (!good) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ByteReader in(isoreel::ByteSpan(data, size));
  if (size < 8) return 0;
  isoreel::EncoderSettings settings;
  isoreel::Configuration& configuration = settings.configuration;
  for (std::uint32_t& n : configuration.grid.nodes) n = 2 + in.fixed<std::uint8_t>() % 20;
  const std::uint32_t flags = in.fixed<std::uint8_t>();
  configuration.profile = flags & 1 ? isoreel::Profile::kMain : isoreel::Profile::kClassic;
  configuration.inside = flags & 2 ? isoreel::Inside::kBelow : isoreel::Inside::kAbove;
  configuration.step = 1u << (4 + in.fixed<std::uint8_t>() % 11);
  settings.frame_types = flags & 4 ? isoreel::FrameTypes::kAuto : isoreel::FrameTypes::kIntra;
  settings.motion.block_log2 = 2 + (flags >> 3 & 3);
  settings.motion.registration = (flags & 32) != 0;
  settings.motion.range = flags >> 6;
  settings.placement = flags & 128 ? isoreel::VertexPlacement::kQef : isoreel::VertexPlacement::kCentroid;
  const std::uint32_t level = in.fixed<std::uint8_t>() % 6, isovalue = in.fixed<std::uint8_t>();

  auto encoder = isoreel::Encoder::create(settings);
  need(encoder.ok());
  isoreel::Decoder decoder;
  std::vector<float> frame;
  for (int i = 0; i < kFrames; ++i) {
    frame = samples(in, configuration.grid.nodes, frame);
    const isoreel::FrameTiming timing{static_cast<std::uint64_t>(i), i, 1,
                                      static_cast<double>(isovalue) - 128};
    const auto packet =
        encoder->encode(isoreel::Volume::own(configuration.grid, std::vector<float>(frame)), timing);
    need(packet.ok());
    const isoreel::Decoder before = decoder;
    const auto surface = decoder.decode(packet->data);
    need(surface.ok() && isoreel::surfaceHash(*surface) == packet->header.surface_hash);
    isoreel::Decoder other = before;
    isoreel::DecodeOptions options;
    options.level = level;
    need(other.decode(packet->data, options).ok());
    options.allow_prefix = true;
    const std::size_t cut = packet->data.size() - packet->data.size() * level / 8;
    isoreel::Decoder third = before;
    static_cast<void>(third.decode(isoreel::ByteSpan(packet->data).first(cut), options));
  }
  return 0;
}
