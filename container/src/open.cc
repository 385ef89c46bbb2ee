// SPDX-License-Identifier: BSD-3-Clause
#include "src/open.h"

#include <algorithm>

#include "src/chunk.h"
#include "src/index.h"
#include "src/scan.h"

namespace isoreel::container {

Result<Bytes> readExactly(ByteSource& source, std::uint64_t offset, std::uint64_t count) {
  Bytes bytes(static_cast<std::size_t>(count));
  ISOREEL_ASSIGN(const std::size_t got, source.read(offset, bytes));
  if (got != bytes.size()) {
    return {ErrorCode::kTruncated,
            "ends at byte " + std::to_string(offset + got) + ", inside what is listed there"};
  }
  return bytes;
}

namespace {

constexpr std::uint64_t kTailBytes = 65536;

// Fills `contents` from the index when there is one, with one read of the file's tail and, for a long index,
// one more. False when there is none, or a bad one, which is noted as damage: then the chunks have to be
// scanned.
Result<bool> openByIndex(ByteSource& source, std::uint64_t size, Contents& contents) {
  if (size < Signature::kBytes + Footer::kChunkBytes) return false;
  const std::uint64_t tail_offset = size - std::min(size, kTailBytes);
  ISOREEL_ASSIGN(const Bytes tail, readExactly(source, tail_offset, size - tail_offset));
  const Result<Footer> footer = readFooter(ByteSpan(tail).last(Footer::kChunkBytes), size);
  if (!footer.ok()) return false;

  Bytes apart;
  ByteSpan chunk;
  if (footer->index_offset >= tail_offset) {
    chunk = ByteSpan(tail).subspan(static_cast<std::size_t>(footer->index_offset - tail_offset),
                                   static_cast<std::size_t>(footer->index_length));
  } else {
    ISOREEL_ASSIGN(apart, readExactly(source, footer->index_offset, footer->index_length));
    chunk = apart;
  }
  Contents found;
  found.info = contents.info;
  if (Status status = readIndex(chunk, *footer, found); !status.ok()) {
    if (status.error().code == ErrorCode::kUnsupported) return status;
    contents.info.damage.push_back("index at byte " + std::to_string(footer->index_offset) + ": " +
                                   std::string(status.message()));
    return false;
  }
  contents = std::move(found);
  return true;
}

}  // namespace

Status openContents(ByteSource& source, Contents& contents) {
  const std::optional<std::uint64_t> size = source.size();
  if (!source.seekable() || !size) {
    return {ErrorCode::kInvalidArgument,
            "cannot go back in a pipe, which random access needs: play it forward (StreamReader) or save it "
            "to a file"};
  }
  contents.info.bytes = *size;
  ISOREEL_ASSIGN(const bool indexed, openByIndex(source, *size, contents));
  return indexed ? Status() : scanChunks(source, *size, contents);
}

Result<Bytes> readPacket(ByteSource& source, std::uint64_t track, const FrameEntry& frame) {
  ISOREEL_ASSIGN(Bytes chunk, readExactly(source, frame.offset, frame.bytes));
  return packetOf(std::move(chunk), track, frame);
}

Result<Bytes> packetOf(Bytes chunk, std::uint64_t track, const FrameEntry& frame) {
  ISOREEL_ASSIGN(const ByteSpan payload, readChunk(chunk, kFrameType));
  ISOREEL_ASSIGN(const FrameFacts facts, readFrameStart(payload, payload.size()));
  if (facts.track != track || facts.header != frame.header) {
    return {ErrorCode::kBadData, "frame header is not the one that is listed (spec container 7.2)"};
  }
  const auto start = chunk.begin() + static_cast<std::ptrdiff_t>(ChunkHeader::kBytes + facts.packet_start);
  chunk.erase(std::copy(start, start + static_cast<std::ptrdiff_t>(facts.packet_bytes), chunk.begin()),
              chunk.end());
  return chunk;
}

}  // namespace isoreel::container
