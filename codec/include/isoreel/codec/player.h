// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/base/packet.h>
#include <isoreel/codec/decoder.h>

namespace isoreel {

/// Frames of a sequence by number, whatever carries its packets. Not thread-safe; players share nothing.
class Player {
 public:
  /// `source` must outlive the player.
  explicit Player(PacketSource& source) : source_(source) {}

  std::uint64_t frameCount() const { return source_.frameCount(); }
  /// The surface at `position` < frameCount(); kNotFound above. Errors name the frame.
  Result<Surface> frame(std::uint64_t position, const DecodeOptions& options = {});

 private:
  PacketSource& source_;
  Decoder decoder_;
};

}  // namespace isoreel
