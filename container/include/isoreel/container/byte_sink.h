// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/base/bytes.h>
#include <isoreel/base/status.h>
#include <isoreel/container/byte_source.h>

#include <filesystem>
#include <memory>
#include <string>

namespace isoreel {

/// Where a file's bytes go, front to back. The contract, for sinks that callers bring:
/// - append(bytes) takes all of them or fails; after a failure nothing more is appended, and the sink ends
/// where
///   it ended before the call if it can see to that. `bytes` are the caller's and are not kept.
/// - sync() returns when what was appended survives a loss of power; sinks that cannot do that do nothing.
/// - commit() is the last call for a file that is whole; discard() for one that is not wanted. When neither
/// comes, what
///   was appended stays as it is: a file that grows as PATH.part stays that.
/// - Called from one thread at a time.
class ByteSink {
 public:
  virtual ~ByteSink() = default;
  virtual Status append(ByteSpan bytes) = 0;
  virtual Status sync() { return {}; }
  virtual Status commit() = 0;
  virtual void discard() = 0;
  /// For messages: a path, "standard output", or what the caller likes.
  virtual std::string name() const = 0;
};

/// A file that grows as PATH.part, locked while it is open (flock), and becomes PATH by commit(): flushed to
/// disk, then renamed in one step, then the folder flushed. Fails (kIo) when the path cannot be written; when
/// PATH or PATH.part exists and `overwrite` is false; and, whatever `overwrite` says, when another writer is
/// at work on PATH.part.
Result<std::unique_ptr<ByteSink>> createFile(const std::filesystem::path& path, bool overwrite);

/// Appends all of `source`, a mebibyte at a time, and commits; when something fails, discards.
Status copyAll(ByteSource& source, ByteSink& sink);

/// Standard output. A reader that has gone away is an error (kIo) if SIGPIPE is ignored.
std::unique_ptr<ByteSink> openStandardOutput();

/// Bytes in memory: `bytes` grows, and must outlive the sink. discard() empties it.
std::unique_ptr<ByteSink> openMemorySink(Bytes& bytes);

}  // namespace isoreel
