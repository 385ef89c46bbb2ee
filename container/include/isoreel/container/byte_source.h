// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/base/bytes.h>
#include <isoreel/base/status.h>

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

namespace isoreel {

/// Bytes by offset. The contract, for sources that callers bring:
/// - read(offset, out) fills `out` from the front and returns how many bytes it filled. Fewer than asked
/// means the end
///   was reached, and only that; 0 at or past the end. An error is for failures, not for the end.
/// - size() is the number of bytes when it is known; nothing for a pipe.
/// - A source that cannot go back (`seekable()` false) is asked for rising offsets only, without gaps skipped
/// twice.
/// - Called from one thread at a time. `out` belongs to the caller and is not kept.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  virtual Result<std::size_t> read(std::uint64_t offset, std::span<std::uint8_t> out) = 0;
  virtual std::optional<std::uint64_t> size() const = 0;
  virtual bool seekable() const { return size().has_value(); }
  /// For messages: a path, "-", or what the caller likes.
  virtual std::string name() const = 0;
};

/// A file, or standard input when `path` is "-". Regular files are seekable, pipes and terminals are not.
/// kNotFound when it is not there, kIo when it cannot be opened or is a directory.
Result<std::unique_ptr<ByteSource>> openFile(const std::filesystem::path& path);

/// A file that another process may still be writing, front to back as a pipe. Where it ends for now, read()
/// waits for more; the end is where it ends once no writer holds it locked (flock), finished or killed.
/// PATH.part is taken where PATH is not there. `stopped` is asked while it waits: when true, reading fails
/// (kIo).
Result<std::unique_ptr<ByteSource>> followFile(const std::filesystem::path& path,
                                               std::function<bool()> stopped);

/// Bytes in memory, owned by the source.
std::unique_ptr<ByteSource> openMemory(Bytes bytes, std::string name = "memory");

}  // namespace isoreel
