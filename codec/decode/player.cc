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

Player::Player(PacketSource& source, std::uint64_t cache_bytes)
    : source_(&source), cache_(std::make_unique<SurfaceCache>(cache_bytes)) {}
Player::Player(Player&&) noexcept = default;
Player::~Player() = default;

Result<Surface> Player::frame(std::uint64_t position, const DecodeOptions& options) {
  if (position >= frameCount()) {
    return {ErrorCode::kNotFound,
            "no frame " + std::to_string(position) + ": the sequence has " + std::to_string(frameCount())};
  }
  const FrameHeader& wanted = source_->header(position);
  const std::uint64_t back = wanted.number - wanted.key;
  if (back > position || source_->header(position - back).number != wanted.key) {
    return {ErrorCode::kNotFound, "frame " + std::to_string(wanted.number) + ": its key, frame " +
                                      std::to_string(wanted.key) + ", is not there"};
  }
  if (options != options_) cache_->clearSurfaces();
  options_ = options;
  if (const Surface* kept = cache_->find(position)) return *kept;
  return walk(position - back, position, options);
}

// As many of the last surfaces as fit. Where those are fewer than a quarter, a decoder half-way saves more
// than the surfaces that it takes the place of, half as many or fewer.
Player::Plan Player::plan(std::uint64_t key, std::uint64_t next, std::uint64_t position) const {
  const std::uint64_t taken = cache_->decoderBytes(key, next);
  std::uint64_t room = cache_->limit() - std::min(cache_->limit(), taken);
  const auto bytes = [&](std::uint64_t at) {
    const FrameHeader& header = source_->header(at);
    return surfaceBytes(header.vertices, header.faces);
  };
  std::uint64_t all = 0;
  for (std::uint64_t i = next; i <= position; ++i) all += bytes(i);
  Plan result{next, {}};
  while (all > room && result.surfaces < position) {
    const std::uint64_t middle = result.surfaces + (position - result.surfaces) / 2;
    const std::uint64_t decoder = decoder_.bytes(source_->header(middle).vertices);
    const bool halve = all / 4 > room && decoder + bytes(position) <= room;
    const std::uint64_t end = halve ? middle + 1 : result.surfaces + 1;
    if (halve) result.decoders.push_back(middle);
    if (halve) room -= decoder;
    for (; result.surfaces < end; ++result.surfaces) all -= bytes(result.surfaces);
  }
  return result;
}

Result<Surface> Player::walk(std::uint64_t key, std::uint64_t position, const DecodeOptions& options) {
  std::uint64_t next = key;
  if (last_ && *last_ >= next && *last_ < position) next = *last_ + 1;
  if (const auto* kept = cache_->decoderBefore(next, position)) {
    decoder_ = kept->second;
    last_ = kept->first;
    next = kept->first + 1;
  }
  const Plan keep = plan(key, next, position);
  cache_->want(key, keep.surfaces, position);
  DecodeOptions whole = options;
  whole.allow_prefix = false;
  for (auto decoder = keep.decoders.begin(); next < position; ++next) {
    Result<Surface> before = decode(next, whole);
    if (!before)
      return before.status().at("frame " + std::to_string(source_->header(position).number) + " needs");
    if (next >= keep.surfaces && !options.allow_prefix) cache_->put(next, *std::move(before));
    if (decoder == keep.decoders.end() || *decoder != next) continue;
    cache_->put(next, decoder_);
    ++decoder;
  }
  Result<Surface> surface = decode(position, options);
  if (surface.ok() && !options.allow_prefix) cache_->put(position, *surface);
  return surface;
}

Result<Surface> Player::decode(std::uint64_t position, const DecodeOptions& options) {
  last_.reset();
  const std::string place = "frame " + std::to_string(source_->header(position).number);
  Result<Bytes> packet = source_->packet(position);
  if (!packet) return packet.status();
  Result<Surface> surface = decoder_.decode(*packet, options).at(place);
  if (surface.ok() && !options.allow_prefix) last_ = position;
  return surface;
}

}  // namespace isoreel
