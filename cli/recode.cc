// SPDX-License-Identifier: BSD-3-Clause
#include "recode.h"

#include <fmt/format.h>
#include <isoreel/codec/decoder.h>
#include <isoreel/codec/encoder.h>

#include <algorithm>
#include <cmath>

#include "decoding.h"
#include "parallel.h"

namespace isoreel::cli {
namespace {

/// With the settings of the GOP that starts with `key`.
Result<Encoder> encoderLike(ByteSpan key, std::uint64_t frames) {
  ISOREEL_ASSIGN(const PacketHeader header, readPacketHeader(key));
  EncoderSettings settings;
  ISOREEL_ASSIGN(settings.configuration, readConfiguration(header.configuration));
  settings.configuration.step = header.step;
  settings.heights.neighbours = (settings.configuration.tools & kToolNeighbours) != 0;
  settings.heights.mixed_signs = (settings.configuration.tools & kToolMixedSigns) != 0;
  settings.heights.sheets = (settings.configuration.tools & kToolSheets) != 0;
  settings.frame_types =
      (settings.configuration.tools & kToolPrediction) != 0 ? FrameTypes::kAuto : FrameTypes::kIntra;
  settings.gop = static_cast<std::uint32_t>(std::clamp<std::uint64_t>(frames, 2, 1 << 20));
  settings.parallel = parallelFor;
  return Encoder::create(std::move(settings));
}

struct Deviation {
  double squares = 0, largest = 0;
  std::uint64_t vertices = 0;

  void add(const Surface& a, const Surface& b) {
    vertices += a.vertices.size();
    for (std::size_t i = 0; i < a.vertices.size(); ++i) {
      double square = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const double difference = static_cast<double>(a.vertices[i][k] - b.vertices[i][k]) / kCell;
        square += difference * difference;
      }
      squares += square;
      largest = std::max(largest, square);
    }
  }
};

}  // namespace

Result<Recoded> recode(PacketSource& packets, const Cut& cut) {
  Recoded result;
  if (cut.begin == cut.shown) return result;
  std::uint64_t end = cut.begin + 1;
  while (end < cut.end && packets.entryHeader(end).back != 0) ++end;
  std::optional<Encoder> encoder;
  Decoder decoder(parallelWithin), check(parallelWithin);
  Deviation deviation;
  packets.willRead(cut.begin, end);
  for (std::uint64_t entry = cut.begin; entry < end; ++entry) {
    if (interrupted) return {ErrorCode::kIo, "interrupted"};
    const FrameHeader& header = packets.entryHeader(entry);
    const std::string place = fmt::format("frame {}", header.number);
    ISOREEL_ASSIGN(const Bytes data, packets.entryPacket(entry));
    ISOREEL_ASSIGN(const Surface surface, decoder.decode(data, decodeOptions()).at(place));
    if (!encoder) {
      ISOREEL_ASSIGN(encoder, encoderLike(data, end - cut.shown));
    }
    if (entry < cut.shown) continue;
    ISOREEL_ASSIGN(const PacketHeader coded, readPacketHeader(data));
    ISOREEL_ASSIGN(Packet packet,
                   encoder
                       ->encodeAgain(surface, decoder.cells(), header.volume > 0,
                                     {coded.number, coded.time, coded.duration, coded.isovalue})
                       .at(place));
    ISOREEL_ASSIGN(const Surface moved, check.decode(packet.data).at(place));
    deviation.add(surface, moved);
    packet.header.time = header.time;
    packet.header.duration = header.duration;
    packet.header.position = packet.header.number = header.number;  // the writer counts anew
    result.packets.emplace(entry, std::move(packet));
  }
  if (deviation.vertices > 0)
    result.rms = std::sqrt(deviation.squares / static_cast<double>(deviation.vertices));
  result.max = std::sqrt(deviation.largest);
  return result;
}

}  // namespace isoreel::cli
