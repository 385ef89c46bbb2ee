// SPDX-License-Identifier: BSD-3-Clause
// Chunks and frame chunks in memory: made, and taken apart again with every check (spec container 3 and 4).
#pragma once

#include <isoreel/base/status.h>

#include <optional>
#include <string>

#include "src/format.h"

namespace isoreel::container {

/// Appends a chunk whose payload is `first` and then `second`. Cannot fail but by lack of memory.
Status appendChunk(Bytes& out, ChunkType type, ByteSpan first, ByteSpan second = {});

/// The header at the front of `bytes`, which are ChunkHeader::kBytes or more: marker and CRC are right.
Result<ChunkHeader> readChunkHeader(ByteSpan bytes);

/// The same question without the words, for searches. False when `bytes` are fewer.
bool startsChunk(ByteSpan bytes);

/// The payload of the chunk that fills `bytes`: type and both CRCs are right.
Result<ByteSpan> readChunk(ByteSpan bytes, ChunkType type);

/// kBadData when `crc` is not what stands in `stored`, the four bytes behind a payload.
Status checkPayloadCrc(std::uint32_t crc, ByteSpan stored);

/// kLimit when the payload is above the limit for its type. Unknown types have none: they are passed over.
Status checkPayloadLength(const ChunkHeader& header);

/// For messages: four letters, '?' for what is none.
std::string typeName(ChunkType type);

/// What stands before the packet in a FRAM payload: appended to `out`.
Status appendFrameStart(Bytes& out, std::uint64_t track, const FrameHeader& header,
                        std::uint64_t packet_bytes);

struct FrameFacts {
  std::uint64_t track = 0;
  FrameHeader header;
  std::size_t packet_start = 0;  // in the payload
  std::size_t packet_bytes = 0;
};
/// Reads what stands before the packet. `front` are the first min(kMaxFrameStart, payload_bytes) bytes of the
/// payload or more of it.
Result<FrameFacts> readFrameStart(ByteSpan front, std::uint64_t payload_bytes);

/// The order of a track's frames (spec container 4.3).
class FrameOrder {
 public:
  /// kBadData when `header` may not come next: positions, and numbers of shown frames, count up by one from
  /// 0; times of shown frames rise; what is no key follows the packet it needs.
  Status check(const FrameHeader& header) const;
  /// The same for files with holes: what came before does not come again.
  Status checkRising(const FrameHeader& header) const;
  void passed(const FrameHeader& header) {
    last_ = header;
    if (!header.hidden()) last_shown_time_ = header.time;
  }

  std::uint64_t duePosition() const { return last_ ? last_->position + 1 : 0; }

 private:
  std::uint64_t due() const { return last_ ? last_->number + (last_->hidden() ? 0 : 1) : 0; }

  std::optional<FrameHeader> last_;
  std::optional<std::int64_t> last_shown_time_;
};

}  // namespace isoreel::container
