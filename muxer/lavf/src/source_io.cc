// SPDX-License-Identifier: BSD-3-Clause
#include "source_io.h"

#include <new>

namespace isoreel::lavf {
namespace {

constexpr int kBufferBytes = 32768;

}  // namespace

SourceIo::SourceIo(ByteSource& source) : source_(source) {
  auto* buffer = static_cast<unsigned char*>(av_malloc(kBufferBytes));
  if (buffer != nullptr) {
    context_ = avio_alloc_context(buffer, kBufferBytes, 0, this, readSome, nullptr,
                                  source.seekable() ? seek : nullptr);
  }
  if (context_ == nullptr) {
    av_free(buffer);
    throw std::bad_alloc();
  }
}

SourceIo::~SourceIo() {
  av_freep(&context_->buffer);  // by now another one than at first, if libavformat liked
  avio_context_free(&context_);
}

int SourceIo::readSome(void* self, std::uint8_t* buffer, int size) {
  auto& io = *static_cast<SourceIo*>(self);
  const Result<std::size_t> got =
      io.source_.read(io.position_, std::span(buffer, static_cast<std::size_t>(size)));
  if (!got.ok()) {
    if (io.status_.ok()) io.status_ = got.status();
    return AVERROR(EIO);
  }
  io.position_ += *got;
  return *got == 0 ? AVERROR_EOF : static_cast<int>(*got);
}

std::int64_t SourceIo::seek(void* self, std::int64_t offset, int whence) {
  auto& io = *static_cast<SourceIo*>(self);
  const auto size = static_cast<std::int64_t>(io.source_.size().value_or(0));
  switch (whence & ~AVSEEK_FORCE) {
    case AVSEEK_SIZE:
      return size;
    case SEEK_SET:
      break;
    case SEEK_CUR:
      offset += static_cast<std::int64_t>(io.position_);
      break;
    case SEEK_END:
      offset += size;
      break;
    default:
      return AVERROR(EINVAL);
  }
  if (offset < 0) return AVERROR(EINVAL);
  io.position_ = static_cast<std::uint64_t>(offset);
  return offset;
}

}  // namespace isoreel::lavf
