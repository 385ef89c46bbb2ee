// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/container/byte_source.h>

#include "av.h"

namespace isoreel::lavf {

/// A ByteSource as libavformat reads it. The source must outlive this.
class SourceIo {
 public:
  explicit SourceIo(ByteSource& source);
  SourceIo(const SourceIo&) = delete;
  SourceIo& operator=(const SourceIo&) = delete;
  ~SourceIo();

  AVIOContext* context() { return context_; }
  /// The source's first error, which says more than libavformat's code for it.
  const Status& status() const { return status_; }

 private:
  static int readSome(void* self, std::uint8_t* buffer, int size);
  static std::int64_t seek(void* self, std::int64_t offset, int whence);

  ByteSource& source_;
  std::uint64_t position_ = 0;
  Status status_;
  AVIOContext* context_ = nullptr;
};

}  // namespace isoreel::lavf
