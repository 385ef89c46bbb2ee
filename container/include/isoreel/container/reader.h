// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/base/packet.h>
#include <isoreel/container/byte_source.h>

#include <array>
#include <memory>
#include <string>
#include <vector>

namespace isoreel {

/// Facts about a whole file (spec container 2, 5 and 6).
struct FileInfo {
  std::array<std::uint8_t, 16> uuid{};
  std::uint8_t version = 0;  // 0: the signature is damaged, and so the UUID is lost
  std::uint8_t minor = 0;
  TimeBase time_base;
  std::string track_name;
  Bytes configuration;      // the codec's configuration record, opaque here
  std::string tags;         // a JSON object, "{}" when there are none
  bool indexed = false;     // false: found by scanning, as in a .part file or a damaged one
  std::uint64_t bytes = 0;  // of the file, 0 when not known
  std::vector<std::string>
      damage;  // what a scan had to leave out, a line each; for a .part its unfinished end
};

/// Random access to the frames of an `.isr` file. With an index: one read for the tail of the file (two when
/// the index is above 64 KiB), one per frame. Without (a `.part` file, a cut or damaged one): the whole file
/// is read once, every whole frame is there and `info().damage` tells what is not. A file's first track is
/// read; frames of others are passed over. Safe for untrusted input. Not thread-safe; readers share nothing.
class Reader final : public PacketSource {
 public:
  /// The file as long as it is now: frames that a writer adds later need a new reader.
  /// kBadData when it is no `.isr` file, kUnsupported for a later version, kIo when it cannot be read.
  static Result<std::unique_ptr<Reader>> open(const std::filesystem::path& path);
  /// The source must be seekable (kInvalidArgument). The reader owns it.
  static Result<std::unique_ptr<Reader>> open(std::unique_ptr<ByteSource> source);
  ~Reader() override;

  const FileInfo& info() const;
  std::uint64_t frameCount() const override;
  const FrameHeader& header(std::uint64_t position) const override;
  /// One read. kNotFound at or above frameCount(); kBadData or kTruncated when the chunk is damaged or is not
  /// what the index says; the message names frame and byte. Other frames stay readable.
  Result<Bytes> packet(std::uint64_t position) override;
  /// Where the frame's chunk starts in the file, and its whole length; `position` < frameCount().
  std::uint64_t chunkOffset(std::uint64_t position) const;
  std::uint64_t chunkBytes(std::uint64_t position) const;

 private:
  struct State;
  explicit Reader(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Plays a file forward without its index, from a pipe for one, and checks every byte of it: any flipped bit
/// of any chunk is an error, which names byte and frame. Needs memory for one packet. Reads no further than
/// the frame it gives. Safe for untrusted input. Not thread-safe.
class StreamReader {
 public:
  /// Reads up to the track record. The reader owns the source.
  static Result<std::unique_ptr<StreamReader>> open(std::unique_ptr<ByteSource> source);
  ~StreamReader();

  /// Complete but for the tags when they stand behind the track record: they come as next() passes them.
  const FileInfo& info() const;
  /// The next frame; nothing at the end of the file. A file without a footer, cut or still being written,
  /// gives all its whole frames and then kTruncated. After an error there is no going on: it comes again.
  Result<std::optional<Packet>> next();

 private:
  struct State;
  explicit StreamReader(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace isoreel
