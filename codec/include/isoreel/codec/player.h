// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/base/packet.h>
#include <isoreel/codec/decoder.h>

#include <memory>

namespace isoreel {

class SurfaceCache;

/// Frames of a sequence by number, forward, backward and at random, whatever carries its packets. Surfaces
/// that were decoded are kept, up to a bound of bytes, so that
/// - forward playback decodes each frame once,
/// - backward playback does so too, where the surfaces of one GOP fit the bound. Where a quarter of them
/// does,
///   no packet is decoded more than four times. Of a longer GOP, decoders are kept half-way, half of the rest
///   of the way and so on, and no packet is decoded more than 4 + log2(frames of the GOP) times, as long as
///   that many decoders fit (Decoder::bytes) beside a few surfaces.
/// Not thread-safe; players share nothing.
class Player {
 public:
  static constexpr std::uint64_t kCacheBytes = std::uint64_t{256} << 20;

  /// `source` must outlive the player. `cache_bytes` bounds what is kept beyond the surface that is given and
  /// the decoder at work; 0 keeps nothing. `parallel`: as Decoder takes it.
  explicit Player(PacketSource& source, std::uint64_t cache_bytes = kCacheBytes,
                  ParallelFor parallel = serialFor);
  Player(Player&&) noexcept;
  ~Player();

  std::uint64_t frameCount() const { return source_->frameCount(); }
  /// The surface at `position` < frameCount(); kNotFound above. What it needs is decoded before it, from its
  /// key or the nearest kept decoder on. `options` are for the frame itself. Errors name the frame.
  Result<Surface> frame(std::uint64_t position, const DecodeOptions& options = {});

 private:
  struct Plan;
  // All positions are those of entries.
  Plan plan(std::uint64_t key, std::uint64_t next, std::uint64_t wanted) const;
  Result<Surface> walk(std::uint64_t key, std::uint64_t wanted, const DecodeOptions& options);
  Result<Surface> decode(std::uint64_t entry, const DecodeOptions& options);

  PacketSource* source_;
  Decoder decoder_;
  std::optional<std::uint64_t> last_;  // entry of what the decoder can go on from
  DecodeOptions options_;              // of the surfaces in the cache
  std::unique_ptr<SurfaceCache> cache_;
};

}  // namespace isoreel
