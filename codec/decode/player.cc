// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/codec/player.h>

namespace isoreel {

Result<Surface> Player::frame(std::uint64_t position, const DecodeOptions& options) {
  if (position >= frameCount()) {
    return {ErrorCode::kNotFound,
            "no frame " + std::to_string(position) + ": the sequence has " + std::to_string(frameCount())};
  }
  const std::string place = "frame " + std::to_string(source_.header(position).number);
  Result<Bytes> packet = source_.packet(position);
  if (!packet) return packet.status();
  return decoder_.decode(*packet, options).at(place);
}

}  // namespace isoreel
