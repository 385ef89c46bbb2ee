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
  /// The surface at `position` < frameCount(); kNotFound above. A P frame is decoded from its key on, or from
  /// the frame that was asked for last where that is nearer: forward playback decodes each frame once.
  /// `options` are for the frame itself; those before it are decoded whole. Errors name the frame.
  Result<Surface> frame(std::uint64_t position, const DecodeOptions& options = {});

 private:
  Result<Surface> decode(std::uint64_t entry, const DecodeOptions& options);

  PacketSource& source_;
  Decoder decoder_;
  std::optional<std::uint64_t> last_;  // entry of what the decoder can go on from
};

}  // namespace isoreel
