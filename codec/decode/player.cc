// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/codec/player.h>

#include <vector>

#include "decode/surface_cache.h"

namespace isoreel {

/// What to keep on the way to a frame, for going back from there.
struct Player::Plan {
  std::uint64_t surfaces = 0;           // those from here on
  std::vector<std::uint64_t> decoders;  // after these packets, rising
};

Player::Player(PacketSource& source, std::uint64_t cache_bytes, ParallelFor parallel)
    : source_(&source), decoder_(std::move(parallel)), cache_(std::make_unique<SurfaceCache>(cache_bytes)) {}
Player::Player(Player&&) noexcept = default;
Player::~Player() = default;

Result<Surface> Player::frame(std::uint64_t position, const DecodeOptions& options) {
  if (position >= frameCount()) {
    return {ErrorCode::kNotFound,
            "no frame " + std::to_string(position) + ": the sequence has " + std::to_string(frameCount())};
  }
  const std::uint64_t wanted = source_->entryOf(position);
  if (options != options_) cache_->clearSurfaces();
  options_ = options;
  if (const Surface* kept = cache_->find(wanted); kept != nullptr && options.motion == nullptr) return *kept;
  ISOREEL_ASSIGN(const std::uint64_t key, keyEntry(*source_, position));
  return walk(key, wanted, options);
}

// As many of the last surfaces as fit. Where those are fewer than a quarter, a decoder half-way saves more
// than the surfaces that it takes the place of, half as many or fewer.
Player::Plan Player::plan(std::uint64_t key, std::uint64_t next, std::uint64_t wanted) const {
  const std::uint64_t taken = cache_->decoderBytes(key, next);
  std::uint64_t room = cache_->limit() - std::min(cache_->limit(), taken);
  const auto bytes = [&](std::uint64_t entry) {
    const FrameHeader& header = source_->entryHeader(entry);
    return surfaceBytes(header.vertices, header.faces);
  };
  std::uint64_t all = 0;
  for (std::uint64_t i = next; i <= wanted; ++i) all += bytes(i);
  Plan result{next, {}};
  while (all > room && result.surfaces < wanted) {
    const std::uint64_t middle = result.surfaces + (wanted - result.surfaces) / 2;
    const std::uint64_t decoder = decoder_.bytes(source_->entryHeader(middle).vertices);
    const bool halve = all / 4 > room && decoder + bytes(wanted) <= room;
    const std::uint64_t end = halve ? middle + 1 : result.surfaces + 1;
    if (halve) result.decoders.push_back(middle);
    if (halve) room -= decoder;
    for (; result.surfaces < end; ++result.surfaces) all -= bytes(result.surfaces);
  }
  return result;
}

Result<Surface> Player::walk(std::uint64_t key, std::uint64_t wanted, const DecodeOptions& options) {
  std::uint64_t next = key;
  if (last_ && *last_ >= next && *last_ < wanted) next = *last_ + 1;
  if (const auto* kept = cache_->decoderBefore(next, wanted)) {
    decoder_ = kept->second;
    last_ = kept->first;
    next = kept->first + 1;
  }
  const Plan keep = plan(key, next, wanted);
  cache_->want(key, keep.surfaces, wanted);
  source_->willRead(next, wanted + 1);
  DecodeOptions whole = options;
  whole.allow_prefix = false;
  for (auto decoder = keep.decoders.begin(); next < wanted; ++next) {
    Result<Surface> before = decode(next, whole);
    if (!before)
      return before.status().at("frame " + std::to_string(source_->entryHeader(wanted).number) + " needs");
    if (next >= keep.surfaces && !options.allow_prefix) cache_->put(next, *std::move(before));
    if (decoder == keep.decoders.end() || *decoder != next) continue;
    cache_->put(next, decoder_);
    ++decoder;
  }
  Result<Surface> surface = decode(wanted, options);
  if (surface.ok() && !options.allow_prefix) cache_->put(wanted, *surface);
  return surface;
}

Result<Surface> Player::decode(std::uint64_t entry, const DecodeOptions& options) {
  last_.reset();
  const FrameHeader& header = source_->entryHeader(entry);
  const std::string place =
      (header.hidden() ? "the hidden packet before frame " : "frame ") + std::to_string(header.number);
  Result<Bytes> packet = source_->entryPacket(entry);
  if (!packet) return packet.status();
  Result<Surface> surface = decoder_.decode(*packet, options).at(place);
  if (surface.ok() && !options.allow_prefix) last_ = entry;
  return surface;
}

}  // namespace isoreel
