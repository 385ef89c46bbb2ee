// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/base/packet.h>

#include <filesystem>
#include <memory>
#include <string>

namespace isoreel {

struct WriterSettings {
  TimeBase time_base;
  std::string track_name;   // UTF-8, at most 1024 bytes
  Bytes configuration;      // the codec's configuration record, at most 64 KiB
  std::string tags = "{}";  // a JSON object, at most 1 MiB; stored as it is
  bool overwrite = false;   // replace a file that is there already
};

/// Writes an `.isr` file: to `PATH.part` while it grows, each frame whole before the next, renamed to PATH by
/// finish(). Readers open the part as well. A writer that goes away before finish() leaves the part as it is.
/// The same frames and settings give the same bytes, UUID included.
class Writer {
 public:
  /// Fails (kIo) when the path cannot be written; when PATH or PATH.part exists and `overwrite` is false;
  /// and, whatever `overwrite` says, when another writer is at work on PATH.part. kInvalidArgument for
  /// settings above their limits.
  static Result<std::unique_ptr<Writer>> create(const std::filesystem::path& path, WriterSettings settings);
  ~Writer();

  /// Appends a frame. Numbers must count up by one from 0, times must rise, packets have 1 byte to
  /// kMaxPacketBytes: kBadData for a frame that breaks a rule, which leaves the file as it was. kIo when the
  /// disk refuses (full, say): the part then keeps the frames before, and every later call fails the same
  /// way.
  Status write(const Packet& packet);
  /// Writes index and footer, flushes to disk and renames. The writer takes nothing afterwards. Fails (kIo),
  /// keeping the part, when PATH has come to exist meanwhile and `overwrite` is false.
  Status finish();
  /// Removes the part. For callers that give up and want nothing kept.
  void discard();
  std::uint64_t bytesWritten() const;

 private:
  struct State;
  explicit Writer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace isoreel
