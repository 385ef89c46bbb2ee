// SPDX-License-Identifier: BSD-3-Clause
// The bytes of a file in order, inflated on the way when they are deflated.
#pragma once

#include <isoreel/base/status.h>

#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace isoreel::io {

enum class Coding {
  kPlain,
  kDeflated,  // gzip, of one or more members, or zlib: their bytes tell which
};

/// The most that deflate shrinks by: a match of 258 bytes takes two bits at least (zlib's technical notes).
inline constexpr std::uint64_t kMaxInflation = 1032;

/// Not thread-safe. Errors name the file: kTruncated when it ends early, kBadData for deflated data that are
/// broken or fail their checksum, kIo.
class ByteStream {
 public:
  /// Starts at byte `offset` of the file.
  static Result<std::unique_ptr<ByteStream>> open(const std::string& path, std::uint64_t offset,
                                                  Coding coding);
  virtual ~ByteStream() = default;
  /// Another one at the same place, that goes on by itself.
  virtual Result<std::unique_ptr<ByteStream>> copy() = 0;

  /// Up to out.size() > 0 bytes; 0 only at the end, which is past the checksum of deflated data.
  virtual Result<std::size_t> readSome(std::span<std::uint8_t> out) = 0;
  /// Exactly out.size() bytes.
  Status read(std::span<std::uint8_t> out);
  Status skip(std::uint64_t bytes);
  /// An error when there are more bytes. Only this checks the checksum of deflated data.
  Status expectEnd();

 protected:
  explicit ByteStream(std::string path) : path_(std::move(path)) {}
  std::string path_;
};

/// Whether `head`, the start of a file, is gzip's.
bool startsAsGzip(std::string_view head);

}  // namespace isoreel::io
