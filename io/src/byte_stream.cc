// SPDX-License-Identifier: BSD-3-Clause
#include "src/byte_stream.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <vector>

namespace isoreel::io {
namespace {

class PlainStream : public ByteStream {
 public:
  PlainStream(const std::string& path, std::ifstream file, std::uint64_t position)
      : ByteStream(path), file_(std::move(file)), position_(position) {}
  Result<std::unique_ptr<ByteStream>> copy() override { return open(path_, position_, Coding::kPlain); }
  Result<std::size_t> readSome(std::span<std::uint8_t> out) override {
    file_.read(reinterpret_cast<char*>(out.data()), static_cast<std::streamsize>(out.size()));
    if (file_.bad()) return {ErrorCode::kIo, path_ + ": cannot be read"};
    const auto count = static_cast<std::size_t>(file_.gcount());
    position_ += count;
    return count;
  }

 private:
  std::ifstream file_;
  std::uint64_t position_;
};

class InflatedStream : public ByteStream {
 public:
  InflatedStream(const std::string& path, std::unique_ptr<ByteStream> packed)
      : ByteStream(path), packed_(std::move(packed)) {
    ready_ = inflateInit2(&z_, 15 + 32) == Z_OK;  // 32: gzip or zlib, whichever it is
  }
  InflatedStream(const InflatedStream&) = delete;
  InflatedStream& operator=(const InflatedStream&) = delete;
  ~InflatedStream() override { inflateEnd(&z_); }

  Result<std::unique_ptr<ByteStream>> copy() override {
    ISOREEL_ASSIGN(std::unique_ptr<ByteStream> packed, packed_->copy());
    auto other = std::unique_ptr<InflatedStream>(new InflatedStream(path_));
    other->packed_ = std::move(packed);
    other->ready_ = ready_ && inflateCopy(&other->z_, &z_) == Z_OK;
    other->gzip_ = gzip_;
    other->ended_ = ended_;
    std::copy_n(z_.next_in, z_.avail_in, other->buffer_.begin());
    other->z_.next_in = other->buffer_.data();
    return std::unique_ptr<ByteStream>(std::move(other));
  }

  Result<std::size_t> readSome(std::span<std::uint8_t> out) override {
    if (!ready_) return {ErrorCode::kLimit, path_ + ": no memory to inflate it"};
    z_.next_out = out.data();
    z_.avail_out = static_cast<uInt>(std::min(out.size(), kBuffer));
    const uInt asked = z_.avail_out;
    while (!ended_ && z_.avail_out == asked) {
      ISOREEL_TRY(fill());
      if (z_.avail_in == 0) return {ErrorCode::kTruncated, path_ + ": the compressed data end early"};
      gzip_ = gzip_ || (z_.total_in == 0 && *z_.next_in == 0x1f);
      const int code = inflate(&z_, Z_NO_FLUSH);
      if (code == Z_STREAM_END) {
        // gzip files may go on with another member; anything else behind the end is padding.
        ISOREEL_TRY(fill());
        ended_ = !gzip_ || z_.avail_in == 0 || *z_.next_in != 0x1f;
        if (!ended_) inflateReset(&z_);
      } else if (code != Z_OK && code != Z_BUF_ERROR) {
        return {ErrorCode::kBadData,
                fmt::format("{}: broken compressed data: {}", path_, z_.msg != nullptr ? z_.msg : "unknown")};
      }
    }
    return std::size_t{asked} - z_.avail_out;
  }

 private:
  static constexpr std::size_t kBuffer = 1u << 16;
  explicit InflatedStream(const std::string& path) : ByteStream(path) {}

  // Packed bytes, unless there are some or none are left.
  Status fill() {
    if (z_.avail_in > 0) return {};
    ISOREEL_ASSIGN(const std::size_t count, packed_->readSome(buffer_));
    z_.next_in = buffer_.data();
    z_.avail_in = static_cast<uInt>(count);
    return {};
  }

  std::unique_ptr<ByteStream> packed_;
  std::vector<std::uint8_t> buffer_ = std::vector<std::uint8_t>(kBuffer);
  z_stream z_{};
  bool ready_ = false, gzip_ = false, ended_ = false;
};

}  // namespace

Result<std::unique_ptr<ByteStream>> ByteStream::open(const std::string& path, std::uint64_t offset,
                                                     Coding coding) {
  std::ifstream file(path, std::ios::binary);
  file.seekg(static_cast<std::streamoff>(offset));
  if (!file) return {ErrorCode::kIo, path + ": cannot be read"};
  std::unique_ptr<ByteStream> stream = std::make_unique<PlainStream>(path, std::move(file), offset);
  if (coding == Coding::kDeflated) stream = std::make_unique<InflatedStream>(path, std::move(stream));
  return stream;
}

Status ByteStream::read(std::span<std::uint8_t> out) {
  while (!out.empty()) {
    ISOREEL_ASSIGN(const std::size_t count, readSome(out));
    if (count == 0) return {ErrorCode::kTruncated, path_ + ": the file ends before its last sample"};
    out = out.subspan(count);
  }
  return {};
}

Status ByteStream::skip(std::uint64_t bytes) {
  std::array<std::uint8_t, 4096> ignored;
  while (bytes > 0) {
    const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(bytes, ignored.size()));
    ISOREEL_TRY(read(std::span(ignored).first(count)));
    bytes -= count;
  }
  return {};
}

Status ByteStream::expectEnd() {
  std::array<std::uint8_t, 1> more;
  ISOREEL_ASSIGN(const std::size_t count, readSome(more));
  if (count == 0) return {};
  return {ErrorCode::kBadData, path_ + ": holds more samples than its header says"};
}

bool startsAsGzip(std::string_view head) { return head.starts_with("\x1f\x8b"); }

}  // namespace isoreel::io
