// SPDX-License-Identifier: BSD-3-Clause
// What a player keeps of what it decoded: surfaces, and decoders to go on from, within a bound of bytes.
#pragma once

#include <isoreel/codec/decoder.h>

#include <map>

namespace isoreel {

/// Bytes that a full surface of so many vertices and quads takes.
std::uint64_t surfaceBytes(std::uint64_t vertices, std::uint64_t faces);

/// Surfaces and decoders by position. Never holds more than its limit.
class SurfaceCache {
 public:
  explicit SurfaceCache(std::uint64_t limit) : limit_(limit) {}

  const Surface* find(std::uint64_t position) const;
  /// The last decoder kept in [key, position): the position of its last packet, and itself; or null.
  const std::pair<const std::uint64_t, Decoder>* decoderBefore(std::uint64_t key,
                                                               std::uint64_t position) const;

  /// What is worth keeping from now on: surfaces at [begin, position], decoders at [key, position). The rest
  /// goes when room is needed, the farthest from `position` first.
  void want(std::uint64_t key, std::uint64_t begin, std::uint64_t position);
  /// Keeps what there is room for beside what is wanted.
  void put(std::uint64_t position, Surface surface);
  void put(std::uint64_t position, const Decoder& decoder);
  void clearSurfaces();

  std::uint64_t limit() const { return limit_; }
  /// Of the decoders in [key, end).
  std::uint64_t decoderBytes(std::uint64_t key, std::uint64_t end) const;

 private:
  bool makeRoom(std::uint64_t bytes);
  void drop(std::map<std::uint64_t, Surface>::iterator surface);

  const std::uint64_t limit_;
  std::uint64_t bytes_ = 0;
  std::map<std::uint64_t, Surface> surfaces_;
  std::map<std::uint64_t, Decoder> decoders_;
  std::uint64_t key_ = 0, begin_ = 0, position_ = 0;  // see want()
};

}  // namespace isoreel
