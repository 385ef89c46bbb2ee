// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/codec/player.h>

namespace isoreel {

Result<Surface> Player::frame(std::uint64_t position, const DecodeOptions& options) {
  if (position >= frameCount()) {
    return {ErrorCode::kNotFound,
            "no frame " + std::to_string(position) + ": the sequence has " + std::to_string(frameCount())};
  }
  const std::uint64_t wanted = source_.entryOf(position);
  ISOREEL_ASSIGN(std::uint64_t next, keyEntry(source_, position));
  if (last_ && *last_ >= next && *last_ < wanted) next = *last_ + 1;
  DecodeOptions whole;
  whole.max_vertices = options.max_vertices;
  for (; next < wanted; ++next) {
    const Result<Surface> before = decode(next, whole);
    if (!before.ok())
      return before.status().at("frame " + std::to_string(source_.header(position).number) + " needs");
  }
  return decode(wanted, options);
}

Result<Surface> Player::decode(std::uint64_t entry, const DecodeOptions& options) {
  last_.reset();
  const FrameHeader& header = source_.entryHeader(entry);
  const std::string place =
      (header.hidden() ? "the hidden packet before frame " : "frame ") + std::to_string(header.number);
  Result<Bytes> packet = source_.entryPacket(entry);
  if (!packet) return packet.status();
  Result<Surface> surface = decoder_.decode(*packet, options).at(place);
  if (surface.ok() && !options.allow_prefix) last_ = entry;
  return surface;
}

}  // namespace isoreel
