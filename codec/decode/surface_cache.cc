// SPDX-License-Identifier: BSD-3-Clause
#include "decode/surface_cache.h"

namespace isoreel {
namespace {

std::uint64_t bytesOf(const Surface& surface) {
  return surfaceBytes(surface.vertices.capacity(), surface.quads.capacity());
}

}  // namespace

std::uint64_t surfaceBytes(std::uint64_t vertices, std::uint64_t faces) {
  constexpr std::uint64_t kNode = 64;  // of the map
  return kNode + sizeof(Surface) + vertices * sizeof(GridPosition) + faces * sizeof(Quad);
}

const Surface* SurfaceCache::find(std::uint64_t position) const {
  const auto found = surfaces_.find(position);
  return found == surfaces_.end() ? nullptr : &found->second;
}

const std::pair<const std::uint64_t, Decoder>* SurfaceCache::decoderBefore(std::uint64_t key,
                                                                           std::uint64_t position) const {
  const auto after = decoders_.lower_bound(position);
  if (after == decoders_.begin()) return nullptr;
  const auto found = std::prev(after);
  return found->first < key ? nullptr : &*found;
}

void SurfaceCache::want(std::uint64_t key, std::uint64_t begin, std::uint64_t position) {
  key_ = key;
  begin_ = begin;
  position_ = position;
  for (auto i = decoders_.begin(); i != decoders_.end();) {
    const bool useful = i->first >= key_ && i->first < position_;
    if (!useful) bytes_ -= i->second.bytes();
    i = useful ? std::next(i) : decoders_.erase(i);
  }
}

void SurfaceCache::put(std::uint64_t position, Surface surface) {
  surface.quads.shrink_to_fit();
  const std::uint64_t bytes = bytesOf(surface);
  if (surfaces_.contains(position) || !makeRoom(bytes)) return;
  surfaces_.emplace(position, std::move(surface));
  bytes_ += bytes;
}

void SurfaceCache::put(std::uint64_t position, const Decoder& decoder) {
  if (decoders_.contains(position)) return;
  Decoder copy = decoder;  // takes less than what was decoded with, and that is counted when it goes
  const std::uint64_t bytes = copy.bytes();
  if (!makeRoom(bytes)) return;
  decoders_.emplace(position, std::move(copy));
  bytes_ += bytes;
}

void SurfaceCache::clearSurfaces() {
  while (!surfaces_.empty()) drop(surfaces_.begin());
}

std::uint64_t SurfaceCache::decoderBytes(std::uint64_t key, std::uint64_t end) const {
  std::uint64_t bytes = 0;
  for (auto i = decoders_.lower_bound(key); i != decoders_.end() && i->first < end; ++i)
    bytes += i->second.bytes();
  return bytes;
}

bool SurfaceCache::makeRoom(std::uint64_t bytes) {
  while (bytes > limit_ - bytes_) {
    if (surfaces_.empty()) return false;
    const auto first = surfaces_.begin(), last = std::prev(surfaces_.end());
    const std::uint64_t below = first->first < begin_ ? position_ - first->first : 0;
    const std::uint64_t above = last->first > position_ ? last->first - position_ : 0;
    if (below == 0 && above == 0) return false;
    drop(below > above ? first : last);
  }
  return true;
}

void SurfaceCache::drop(std::map<std::uint64_t, Surface>::iterator surface) {
  bytes_ -= bytesOf(surface->second);
  surfaces_.erase(surface);
}

}  // namespace isoreel
