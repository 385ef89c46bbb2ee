// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/codec/player.h>

namespace isoreel {

Result<Surface> Player::frame(std::uint64_t position, const DecodeOptions& options) {
  if (position >= frameCount()) {
    return {ErrorCode::kNotFound,
            "no frame " + std::to_string(position) + ": the sequence has " + std::to_string(frameCount())};
  }
  const FrameHeader& wanted = source_.header(position);
  const std::uint64_t back = wanted.number - wanted.key;
  if (back > position || source_.header(position - back).number != wanted.key) {
    return {ErrorCode::kNotFound, "frame " + std::to_string(wanted.number) + ": its key, frame " +
                                      std::to_string(wanted.key) + ", is not there"};
  }
  std::uint64_t next = position - back;
  if (last_ && *last_ >= next && *last_ < position) next = *last_ + 1;
  DecodeOptions whole;
  whole.max_vertices = options.max_vertices;
  for (; next < position; ++next) {
    const Result<Surface> before = decode(next, whole);
    if (!before.ok()) return before.status().at("frame " + std::to_string(wanted.number) + " needs");
  }
  return decode(position, options);
}

Result<Surface> Player::decode(std::uint64_t position, const DecodeOptions& options) {
  last_.reset();
  const std::string place = "frame " + std::to_string(source_.header(position).number);
  Result<Bytes> packet = source_.packet(position);
  if (!packet) return packet.status();
  Result<Surface> surface = decoder_.decode(*packet, options).at(place);
  if (surface.ok() && !options.allow_prefix) last_ = position;
  return surface;
}

}  // namespace isoreel
