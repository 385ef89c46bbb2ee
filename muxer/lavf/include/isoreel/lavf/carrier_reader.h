// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/base/packet.h>
#include <isoreel/container/byte_source.h>
#include <isoreel/container/file_info.h>
#include <isoreel/lavf/carrier.h>

#include <memory>
#include <string>

namespace isoreel::lavf {

/// Random access to the frames of one ISRL track of a NUT, MOV, MP4, Matroska or AVI file, whatever stands
/// beside it there. Such files have no index of facts, so opening reads all of it once. The packets are
/// trusted for what they say themselves: type, counts, hash, and exact times where the carrier rounded them
/// (spec mappings 4). Facts that no packet has (box, area, volume, components, Euler characteristic, errors)
/// come from the carrier's tags when they are there, and are 0 when they are not. Not thread-safe.
///
/// Safe for untrusted input, as far as libavformat is: it takes the memory that a file's tables claim (two
/// indices of 1.4 GB each for a MOV of 1,895 bytes) before it looks whether the file holds as much. Its only
/// bound is the process's, and so the program's to set: av_max_alloc() (libavutil/mem.h), before open(), to 8
/// bytes for each of the file's and 8 MiB, which no table in a whole file needs more than.
class CarrierReader final : public PacketSource {
 public:
  /// The reader owns the source. From one that is not seekable, packets are kept in memory. `track`: the name
  /// or number of the ISRL track, from 0 among those of the file; "" for the first.
  /// kUnsupported when the file is in none of these containers; kBadData when it is damaged in its head or
  /// carries no ISRL track, or that track no frame; kNotFound when there is no such track; kIo.
  static Result<std::unique_ptr<CarrierReader>> open(std::unique_ptr<ByteSource> source,
                                                     const std::string& track = "");
  ~CarrierReader() override;

  /// Version and minor are those of the first configuration record; there is no UUID; `damage` names packets
  /// that had to be left out.
  const FileInfo& info() const;
  Carrier carrier() const;

  std::uint64_t frameCount() const override;
  const FrameHeader& header(std::uint64_t frame) const override;
  /// Errors (kIo, kBadData when the file is not as it was when it was opened) name file and frame.
  Result<Bytes> packet(std::uint64_t frame) override;
  std::uint64_t entryCount() const override;
  std::uint64_t entryOf(std::uint64_t frame) const override;
  const FrameHeader& entryHeader(std::uint64_t entry) const override;
  Result<Bytes> entryPacket(std::uint64_t entry) override;
  std::uint64_t entryBytes(std::uint64_t entry) const override;

  /// An attachment's content (Matroska). kNotFound when there is none of that name.
  Result<std::unique_ptr<ByteSource>> openAttachment(const std::string& name);

 private:
  struct State;
  explicit CarrierReader(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace isoreel::lavf
