// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/container/byte_source.h>

#include "src/chunk.h"

namespace isoreel::container {

/// A part of a source in memory, moved along as it is asked for.
class Window {
 public:
  static constexpr std::size_t kStep = std::size_t{1} << 18;

  Window(ByteSource& source, std::uint64_t size) : source_(source), size_(size) {}

  /// Bytes from `offset` on: at least `count` (at most kStep) unless the file ends before. Good until the
  /// next call. Empty with status() set when reading failed.
  ByteSpan at(std::uint64_t offset, std::size_t count);
  /// The next place from `position` on where a chunk header with a good CRC stands; the end when there is
  /// none.
  std::uint64_t nextHeader(std::uint64_t position);
  const Status& status() const { return status_; }

 private:
  ByteSource& source_;
  const std::uint64_t size_;
  std::uint64_t start_ = 0;
  Bytes bytes_;
  Status status_;
};

}  // namespace isoreel::container
