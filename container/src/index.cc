// SPDX-License-Identifier: BSD-3-Clause
#include "src/index.h"

#include <algorithm>

#include "src/chunk.h"
#include "src/compress.h"
#include "src/signature.h"

namespace isoreel::container {
namespace {

// The first track is the one that is read; the others only have to be well formed.
Status readTracks(ByteReader& in, std::uint64_t count, Contents& contents) {
  for (std::uint64_t i = 0; i < count; ++i) {
    TrackRecord track;
    ISOREEL_TRY(readSized(in, track));
    if (i > 0) continue;
    contents.track = track.id;
    contents.info.time_base = track.time_base;
    contents.info.track_name = std::move(track.name);
    contents.info.configuration = std::move(track.configuration);
  }
  return {};
}

// `end` is where the frame chunks must end: the index's own offset.
Status readEntries(ByteReader& in, std::uint64_t count, std::uint64_t end, Contents& contents) {
  FrameOrder order;
  std::uint64_t position = Signature::kBytes;
  for (std::uint64_t i = 0; i < count; ++i) {
    IndexEntry entry;
    FrameEntry frame;
    ISOREEL_TRY(readSyntax(in, entry));
    ISOREEL_TRY(readSized(in, frame.header));
    if (entry.gap > end - position || entry.chunk_length > end - position - entry.gap) {
      return {ErrorCode::kBadData, "index entry " + std::to_string(i) +
                                       ": its chunk is not in front of the index (spec container 7.2)"};
    }
    frame.offset = position + entry.gap;
    frame.bytes = entry.chunk_length;
    position = frame.offset + frame.bytes;
    if (entry.track != contents.track) continue;
    ISOREEL_TRY(order.check(frame.header));
    order.passed(frame.header);
    contents.frames.push_back(frame);
  }
  return {};
}

}  // namespace

Status IndexBuilder::add(std::uint64_t track, const FrameHeader& header, std::uint64_t offset,
                         std::uint64_t chunk_bytes) {
  IndexEntry entry;
  entry.track = track;
  entry.gap = offset - end_;
  entry.chunk_length = chunk_bytes;
  Bytes bytes;
  ISOREEL_TRY(writeSyntax(bytes, entry));
  ISOREEL_TRY(writeSized(bytes, header));
  if (entries_.size() + bytes.size() + kIndexAllowance > kMaxIndexContent) {
    return {ErrorCode::kLimit, "too many frames for one file: the index would be above " +
                                   std::to_string(kMaxIndexContent) + " bytes (spec container 10)"};
  }
  entries_.insert(entries_.end(), bytes.begin(), bytes.end());
  ++frames_;
  end_ = offset + chunk_bytes;
  return {};
}

Result<Bytes> IndexBuilder::finish(const Uuid& uuid, const std::string& tags, const TrackRecord& track,
                                   std::uint64_t file_bytes) const {
  FileRecord file;
  file.uuid = uuid;
  file.tags = tags;
  file.frames = frames_;
  Bytes content;
  ISOREEL_TRY(writeSized(content, file));
  ISOREEL_TRY(writeSized(content, track));
  content.insert(content.end(), entries_.begin(), entries_.end());
  ISOREEL_ASSIGN(const Bytes payload, compress(content));

  Bytes chunks;
  ISOREEL_TRY(appendChunk(chunks, kIndexType, payload));
  Footer footer;
  footer.index_offset = file_bytes;
  footer.index_length = chunks.size();
  footer.file_length = file_bytes + chunks.size() + Footer::kChunkBytes;
  footer.uuid = uuid;
  Bytes footer_payload;
  ISOREEL_TRY(writeSyntax(footer_payload, footer));
  ISOREEL_TRY(appendChunk(chunks, kFooterType, footer_payload));
  return chunks;
}

Result<Footer> readFooter(ByteSpan chunk, std::uint64_t file_bytes) {
  ISOREEL_ASSIGN(const ByteSpan payload, readChunk(chunk, kFooterType));
  Footer footer;
  ByteReader in(payload);
  ISOREEL_TRY(readSyntax(in, footer));
  const std::uint64_t end = file_bytes - Footer::kChunkBytes;
  if (footer.file_length != file_bytes) {
    return {ErrorCode::kBadData, "footer: the file has " + std::to_string(file_bytes) + " bytes, not " +
                                     std::to_string(footer.file_length) + " (spec container 8)"};
  }
  if (footer.index_offset < Signature::kBytes || footer.index_offset > end ||
      footer.index_length > end - footer.index_offset || footer.index_length < kChunkOverhead ||
      footer.index_length > kMaxPayload + kChunkOverhead) {
    return {ErrorCode::kBadData, "footer: its index is not in front of it (spec container 8)"};
  }
  return footer;
}

Status readIndex(ByteSpan chunk, const Footer& footer, Contents& contents) {
  ISOREEL_ASSIGN(const ByteSpan payload, readChunk(chunk, kIndexType));
  ISOREEL_ASSIGN(const Bytes content,
                 decompress(payload, std::min(kMaxIndexContent, footer.file_length + kIndexAllowance)));
  ByteReader in(content);
  FileRecord file;
  ISOREEL_TRY(readSized(in, file));
  ISOREEL_TRY(checkVersion(file.version));
  if (file.uuid != footer.uuid) {
    return {ErrorCode::kBadData, "index: its UUID is not the footer's (spec container 7.1)"};
  }
  if (file.frames > footer.file_length / kMinFrameChunk) {
    return {ErrorCode::kBadData, "index: more frames than the file has room for (spec container 7.1)"};
  }
  contents.info.uuid = file.uuid;
  contents.info.version = file.version;
  contents.info.minor = file.minor;
  contents.info.tags = std::move(file.tags);
  contents.info.indexed = true;
  ISOREEL_TRY(readTracks(in, file.tracks, contents));
  contents.frames.reserve(static_cast<std::size_t>(file.frames));
  return readEntries(in, file.frames, footer.index_offset, contents);
}

}  // namespace isoreel::container
