// SPDX-License-Identifier: BSD-3-Clause
#include "src/window.h"

#include <algorithm>

namespace isoreel::container {

ByteSpan Window::at(std::uint64_t offset, std::size_t count) {
  const std::uint64_t left = size_ - std::min(size_, offset);
  const std::size_t wanted = static_cast<std::size_t>(std::min<std::uint64_t>(count, left));
  if (offset < start_ || offset - start_ > bytes_.size() || bytes_.size() - (offset - start_) < wanted) {
    bytes_.resize(static_cast<std::size_t>(std::min<std::uint64_t>(kStep, left)));
    start_ = offset;
    const Result<std::size_t> got = source_.read(offset, bytes_);
    if (!got.ok()) status_ = got.status();
    bytes_.resize(got.ok() ? std::min(*got, bytes_.size()) : 0);
  }
  return ByteSpan(bytes_).subspan(static_cast<std::size_t>(offset - start_));
}

std::uint64_t Window::nextHeader(std::uint64_t position) {
  constexpr auto& kSync = ChunkHeader::kSync;
  while (position + ChunkHeader::kBytes <= size_) {
    const ByteSpan bytes = at(position, ChunkHeader::kBytes);
    if (bytes.size() < ChunkHeader::kBytes) break;
    const auto found = std::search(bytes.begin(), bytes.end(), kSync.begin(), kSync.end());
    const std::size_t passed = static_cast<std::size_t>(found - bytes.begin());
    if (found == bytes.end()) {
      position += passed - (kSync.size() - 1);  // a marker may be half in this window
    } else if (startsChunk(at(position + passed, ChunkHeader::kBytes))) {
      return position + passed;
    } else {
      position += passed + 1;
    }
  }
  return size_;
}

}  // namespace isoreel::container
