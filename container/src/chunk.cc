// SPDX-License-Identifier: BSD-3-Clause
#include "src/chunk.h"

#include <algorithm>

namespace isoreel::container {

Status appendChunk(Bytes& out, ChunkType type, ByteSpan first, ByteSpan second) {
  ChunkHeader header;
  header.type = type;
  header.length = std::uint64_t{first.size()} + second.size();
  const std::size_t start = out.size();
  out.reserve(start + kChunkOverhead + first.size() + second.size());
  ISOREEL_TRY(writeSyntax(out, header));
  constexpr std::size_t kCovered = ChunkHeader::kBytes - 4;
  const std::uint32_t crc = crc32c(ByteSpan(out).subspan(start, kCovered));
  out.resize(start + kCovered);
  ByteWriter writer(out);
  writer.fixed(crc);
  writer.bytes(first);
  writer.bytes(second);
  writer.fixed(crc32c(second, crc32c(first)));
  return {};
}

Result<ChunkHeader> readChunkHeader(ByteSpan bytes) {
  ChunkHeader header;
  ByteReader in(bytes);
  ISOREEL_TRY(readSyntax(in, header));
  if (header.sync != ChunkHeader::kSync)
    return {ErrorCode::kBadData, "no chunk starts here (spec container 3.1)"};
  if (header.crc != crc32c(bytes.first(ChunkHeader::kBytes - 4))) {
    return {ErrorCode::kBadData, "chunk header CRC does not match (spec container 3.1)"};
  }
  return header;
}

bool startsChunk(ByteSpan bytes) {
  if (bytes.size() < ChunkHeader::kBytes) return false;
  if (!std::equal(ChunkHeader::kSync.begin(), ChunkHeader::kSync.end(), bytes.begin())) return false;
  ByteReader in(bytes.subspan(ChunkHeader::kBytes - 4));
  return in.fixed<std::uint32_t>() == crc32c(bytes.first(ChunkHeader::kBytes - 4));
}

Result<ByteSpan> readChunk(ByteSpan bytes, ChunkType type) {
  ISOREEL_ASSIGN(const ChunkHeader header, readChunkHeader(bytes));
  if (header.type != type) {
    return {ErrorCode::kBadData, "chunk type is " + typeName(header.type) + " where " + typeName(type) +
                                     " is due (spec container 3.2)"};
  }
  if (bytes.size() < kChunkOverhead || header.length != bytes.size() - kChunkOverhead) {
    return {ErrorCode::kBadData, "chunk is not as long as it is listed (spec container 3.1)"};
  }
  const ByteSpan payload = bytes.subspan(ChunkHeader::kBytes, bytes.size() - kChunkOverhead);
  ISOREEL_TRY(checkPayloadCrc(crc32c(payload), bytes.last(kPayloadCrcBytes)));
  return payload;
}

Status checkPayloadCrc(std::uint32_t crc, ByteSpan stored) {
  ByteReader in(stored);
  if (in.fixed<std::uint32_t>() == crc && !in.truncated()) return {};
  return {ErrorCode::kBadData, "payload CRC does not match (spec container 3.1)"};
}

Status checkPayloadLength(const ChunkHeader& header) {
  std::uint64_t max = ~std::uint64_t{0};
  if (header.type == kFrameType || header.type == kIndexType) max = kMaxPayload;
  if (header.type == kTrackType) max = kMaxTrackPayload;
  if (header.type == kTagsType) max = kMaxTagsPayload;
  if (header.type == kChaptersType) max = kMaxChaptersPayload;
  if (header.type == kAttachmentType) max = kMaxPartPayload;
  if (header.type == kFooterType) max = Footer::kBytes;
  if (header.length <= max) return {};
  return {ErrorCode::kLimit, typeName(header.type) + " payload of " + std::to_string(header.length) +
                                 " bytes is above " + std::to_string(max) + " (spec container 10)"};
}

std::string typeName(ChunkType type) {
  std::string name;
  for (const std::uint8_t c : type) {
    const bool letter = (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z');
    name += letter ? static_cast<char>(c) : '?';
  }
  return name;
}

Status appendFrameStart(Bytes& out, std::uint64_t track, const FrameHeader& header,
                        std::uint64_t packet_bytes) {
  FrameStart start;
  start.track = track;
  PacketLength length;
  length.packet_length = packet_bytes;
  ISOREEL_TRY(writeSyntax(out, start));
  ISOREEL_TRY(writeSized(out, header));
  return writeSyntax(out, length);
}

Result<FrameFacts> readFrameStart(ByteSpan front, std::uint64_t payload_bytes) {
  ByteReader in(front.first(std::min<std::size_t>(front.size(), kMaxFrameStart)));
  FrameStart start;
  FrameFacts facts;
  PacketLength length;
  ISOREEL_TRY(readSyntax(in, start));
  ISOREEL_TRY(readSized(in, facts.header));
  ISOREEL_TRY(readSyntax(in, length));
  facts.track = start.track;
  facts.packet_start = in.position();
  if (length.packet_length > payload_bytes - in.position()) {
    return {ErrorCode::kTruncated, "packet is longer than its chunk (spec container 4.2)"};
  }
  facts.packet_bytes = static_cast<std::size_t>(length.packet_length);
  return facts;
}

Status FrameOrder::check(const FrameHeader& header) const {
  if (header.number != due()) {
    return {ErrorCode::kBadData, "frame number " + std::to_string(header.number) + " where " +
                                     std::to_string(due()) + " is due (spec container 4.3)"};
  }
  if (header.position != duePosition()) {
    return {ErrorCode::kBadData, "packet position " + std::to_string(header.position) + " where " +
                                     std::to_string(duePosition()) + " is due (spec container 4.3)"};
  }
  const bool follows = last_ && header.back == last_->back + 1;
  if (!follows && (header.back != 0 || (last_ && last_->hidden()))) {
    return {ErrorCode::kBadData, "the packet before it is not of its GOP (spec container 4.3)"};
  }
  return checkRising(header);
}

Status FrameOrder::checkRising(const FrameHeader& header) const {
  if (header.number < due()) {
    return {ErrorCode::kBadData, "frame number " + std::to_string(header.number) + " is below " +
                                     std::to_string(due()) + ", which is due (spec container 4.3)"};
  }
  if (header.position < duePosition()) {
    return {ErrorCode::kBadData, "packet position " + std::to_string(header.position) + " is below " +
                                     std::to_string(duePosition()) + ", which is due (spec container 4.3)"};
  }
  if (!header.hidden() && last_shown_time_ && header.time <= *last_shown_time_) {
    return {ErrorCode::kBadData, "frame time " + std::to_string(header.time) + " is not after " +
                                     std::to_string(*last_shown_time_) + " before it (spec container 4.3)"};
  }
  return {};
}

}  // namespace isoreel::container
