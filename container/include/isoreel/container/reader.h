// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/base/packet.h>
#include <isoreel/container/byte_source.h>
#include <isoreel/container/file_info.h>

#include <memory>
#include <string>

namespace isoreel {

/// Random access to the frames of an `.isr` file. With an index: one read for the tail of the file (two when
/// the index is above 64 KiB), one per frame. Without (a `.part` file, a cut or damaged one): the whole file
/// is read once, every whole frame is there and `info().damage` tells what is not. One track is read, the
/// first unless another is asked for by its name or its id. Safe for untrusted input. Not thread-safe;
/// readers share nothing.
class Reader final : public PacketSource {
 public:
  /// The file as long as it is now: frames that a writer adds later need a new reader.
  /// kBadData when it is no `.isr` file, kUnsupported for a later version, kIo when it cannot be read,
  /// kNotFound when there is no such track.
  static Result<std::unique_ptr<Reader>> open(const std::filesystem::path& path,
                                              const std::string& track = "");
  /// The source must be seekable (kInvalidArgument). The reader owns it.
  static Result<std::unique_ptr<Reader>> open(std::unique_ptr<ByteSource> source,
                                              const std::string& track = "");
  ~Reader() override;

  const FileInfo& info() const;
  std::uint64_t frameCount() const override;
  const FrameHeader& header(std::uint64_t frame) const override;
  /// One read. kNotFound at or above frameCount(); kBadData or kTruncated when the chunk is damaged or is not
  /// what the index says; the message names frame and byte. Other frames stay readable.
  Result<Bytes> packet(std::uint64_t frame) override;
  std::uint64_t entryCount() const override;
  std::uint64_t entryOf(std::uint64_t frame) const override;
  const FrameHeader& entryHeader(std::uint64_t entry) const override;
  Result<Bytes> entryPacket(std::uint64_t entry) override;
  std::uint64_t entryBytes(std::uint64_t entry) const override;
  /// Packets that stand near each other are then fetched by one read, up to 16 MiB.
  void willRead(std::uint64_t begin, std::uint64_t end) override;
  /// Where the entry's chunk starts in the file, and its whole length; `entry` < entryCount().
  std::uint64_t chunkOffset(std::uint64_t entry) const;
  std::uint64_t chunkBytes(std::uint64_t entry) const;

  /// An attachment's content, checked as it is read, a part in memory at a time: read it front to back.
  /// kNotFound when there is none of that name. Not to outlive the reader.
  Result<std::unique_ptr<ByteSource>> openAttachment(const std::string& name);

 private:
  struct State;
  explicit Reader(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// What a file holds when its index is not believed: every chunk is looked at, and `damage` lists what has to
/// be left out. The source must be seekable. Errors as of Reader::open().
Result<FileInfo> scanFile(ByteSource& source);

/// Plays one track forward without the index, from a pipe for one, and checks every byte of the file: any
/// flipped bit of any chunk is an error, which names byte and frame. Needs memory for one packet. Reads no
/// further than the frame it gives. Safe for untrusted input. Not thread-safe.
class StreamReader {
 public:
  /// Reads up to the record of the track that has this name or id, or of the first. The reader owns the
  /// source.
  static Result<std::unique_ptr<StreamReader>> open(std::unique_ptr<ByteSource> source,
                                                    const std::string& track = "");
  ~StreamReader();

  /// Complete but for what stands behind the track record, as attachments do: it comes as next() passes it.
  const FileInfo& info() const;
  /// The next packet, hidden ones too: decode them and show nothing. Nothing at the end of the file. A file
  /// without a footer, cut or still being written, gives all its whole frames and then kTruncated. After an
  /// error there is no going on: it comes again.
  Result<std::optional<Packet>> next();

 private:
  struct State;
  explicit StreamReader(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace isoreel
