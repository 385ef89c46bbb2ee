// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/base/packet.h>
#include <isoreel/container/byte_sink.h>
#include <isoreel/container/byte_source.h>
#include <isoreel/container/file_info.h>

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace isoreel {

/// Makes PRTY chunks for a run of bytes that they will stand right behind: whole chunks, ready to be written.
/// See reedSolomonParity() in <isoreel/container/parity.h>.
using ParityMaker = std::function<Result<Bytes>(ByteSpan)>;

struct TrackSettings {
  TimeBase time_base;
  std::string name;     // UTF-8, at most 1024 bytes; differs from those of other tracks
  Bytes configuration;  // the codec's configuration record, at most 64 KiB
};

/// How a file is written, whatever is in it.
struct WriterOptions {
  bool sync = false;   // flush to disk after each GOP
  ParityMaker parity;  // for each GOP; none: no parity
};

struct WriterSettings {
  TimeBase time_base;  // these three are the first track's, as in TrackSettings; its id is 0
  std::string track_name;
  Bytes configuration;
  std::string tags = "{}";  // a JSON object, at most 1 MiB; stored as it is
  bool overwrite = false;   // replace a file that is there already
  WriterOptions options{};
};

/// Writes an `.isr` file: to `PATH.part` while it grows, each frame whole before the next, renamed to PATH by
/// finish(). Readers open the part as well. A writer that goes away before finish() leaves the part as it is.
/// The same frames and settings give the same bytes, UUID included.
///
/// Errors of the disk (kIo) are for good: the file then keeps what came before, and every later call fails
/// the same way. Errors of other kinds leave the file as it was.
class Writer {
 public:
  /// Fails (kIo) as createFile() does; kInvalidArgument for settings above their limits.
  static Result<std::unique_ptr<Writer>> create(const std::filesystem::path& path, WriterSettings settings);
  /// To a sink of the caller's, which the writer owns: a pipe, say. Nothing is ever written twice.
  static Result<std::unique_ptr<Writer>> create(std::unique_ptr<ByteSink> sink, WriterSettings settings);
  /// Continues a file that is there. Nothing of it is written over: until finish() has written a new index
  /// behind what was appended, readers find all old and new frames by scan. An unfinished end, which a killed
  /// writer left, is cut off first. kBadData when the file is damaged (repair it first), kIo when it cannot
  /// be written or another writer is at work on it.
  static Result<std::unique_ptr<Writer>> append(const std::filesystem::path& path,
                                                WriterOptions options = {});
  ~Writer();

  /// Another sequence of frames; its id. kInvalidArgument for settings above their limits, or a name that
  /// another track has.
  Result<std::uint64_t> addTrack(TrackSettings settings);
  /// Appends a frame. In each track the numbers of shown frames count up by one from 0 and their times rise;
  /// a hidden frame has the number of the next one shown; a packet that is no key follows those it needs;
  /// packets have 1 byte to kMaxPacketBytes: kBadData for a frame that breaks a rule. The header's `position`
  /// is filled in here.
  Status write(const Packet& packet, std::uint64_t track = 0);
  /// Says that a GOP ends here: its parity is written, and what was written is flushed if that was asked for.
  /// An I frame that comes without this call makes up for the parity.
  Status endGop();

  /// Replaces the tags (a JSON object) or the chapters.
  Status setTags(std::string tags);
  Status setChapters(std::vector<Chapter> chapters);
  /// Copies `content` into the file; replaces an attachment of that name. Call it behind the first frame: the
  /// UUID is made of what comes first. When reading fails the attachment is not there.
  Status attach(const std::string& name, const std::string& media_type, ByteSource& content);
  /// kNotFound when there is none of that name.
  Status removeAttachment(const std::string& name);

  /// What the file holds by now; `info().tracks` and so on.
  const FileInfo& info() const;
  /// The header of the last frame of a track, if it has one: where an appended one goes on.
  const FrameHeader* lastFrame(std::uint64_t track = 0) const;

  /// Writes index and footer, and commits. The writer takes nothing afterwards. Fails (kIo), keeping the
  /// part, when PATH has come to exist meanwhile and `overwrite` is false.
  Status finish();
  /// Removes the part, or what was appended to a file. For callers that give up and want nothing kept.
  void discard();
  /// The length of the file.
  std::uint64_t bytesWritten() const;

 private:
  struct State;
  explicit Writer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace isoreel
