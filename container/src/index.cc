// SPDX-License-Identifier: BSD-3-Clause
#include "src/index.h"

#include <algorithm>

#include "src/chunk.h"
#include "src/compress.h"
#include "src/signature.h"

namespace isoreel::container {
namespace {

Status readTracks(ByteReader& in, std::uint64_t count, Contents& contents) {
  for (std::uint64_t i = 0; i < count; ++i) {
    TrackRecord record;
    ISOREEL_TRY(readSized(in, record));
    TrackContents& track = contents.track(record.id);
    if (track.has_record) {
      return {ErrorCode::kBadData,
              "index: two tracks have the id " + std::to_string(record.id) + " (spec container 5)"};
    }
    track.record = std::move(record);
    track.has_record = true;
  }
  return {};
}

Status readAttachments(ByteReader& in, std::uint64_t count, std::uint64_t end, Contents& contents) {
  for (std::uint64_t i = 0; i < count; ++i) {
    Attachment attachment;
    ISOREEL_TRY(readSized(in, attachment));
    if (attachment.offset < Signature::kBytes || attachment.offset > end ||
        attachment.length > end - attachment.offset) {
      return {ErrorCode::kBadData, "index: an attachment is not in front of it (spec container 7.3)"};
    }
    contents.info.attachments.push_back(std::move(attachment));
  }
  return {};
}

// `end` is where the frame chunks must end: the index's own offset.
Status readEntries(ByteReader& in, std::uint64_t count, std::uint64_t end, Contents& contents) {
  std::vector<FrameOrder> orders(contents.tracks.size());
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
    const auto track = std::find_if(contents.tracks.begin(), contents.tracks.end(),
                                    [&](const TrackContents& t) { return t.record.id == entry.track; });
    if (track == contents.tracks.end()) {
      return {ErrorCode::kBadData,
              "index entry " + std::to_string(i) + ": there is no such track (spec container 7.2)"};
    }
    FrameOrder& order = orders[static_cast<std::size_t>(track - contents.tracks.begin())];
    ISOREEL_TRY(order.check(frame.header));
    order.passed(frame.header);
    track->add(frame);
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
  ++count_;
  end_ = offset + chunk_bytes;
  return {};
}

Result<Bytes> IndexBuilder::finish(const FileInfo& info, const std::vector<TrackRecord>& tracks,
                                   std::uint64_t file_bytes) const {
  FileRecord file;
  file.uuid = info.uuid;
  file.tags = info.tags;
  file.tracks = tracks.size();
  file.chapters = info.chapters.size();
  file.attachments = info.attachments.size();
  file.entries = count_;
  Bytes content;
  ISOREEL_TRY(writeSized(content, file));
  for (const TrackRecord& track : tracks) ISOREEL_TRY(writeSized(content, track));
  for (const Chapter& chapter : info.chapters) ISOREEL_TRY(writeSized(content, chapter));
  for (const Attachment& attachment : info.attachments) ISOREEL_TRY(writeSized(content, attachment));
  content.insert(content.end(), entries_.begin(), entries_.end());
  ISOREEL_ASSIGN(const Bytes payload, compress(content));

  Bytes chunks;
  ISOREEL_TRY(appendChunk(chunks, kIndexType, payload));
  Footer footer;
  footer.index_offset = file_bytes;
  footer.index_length = chunks.size();
  footer.file_length = file_bytes + chunks.size() + Footer::kChunkBytes;
  footer.uuid = info.uuid;
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
  if (file.entries > footer.file_length / kMinFrameChunk) {
    return {ErrorCode::kBadData, "index: more frames than the file has room for (spec container 7.1)"};
  }
  contents.info.uuid = file.uuid;
  contents.info.version = file.version;
  contents.info.minor = file.minor;
  contents.info.tags = std::move(file.tags);
  contents.info.indexed = true;
  ISOREEL_TRY(readTracks(in, file.tracks, contents));
  for (std::uint64_t i = 0; i < file.chapters; ++i)
    ISOREEL_TRY(readSized(in, contents.info.chapters.emplace_back()));
  ISOREEL_TRY(readAttachments(in, file.attachments, footer.index_offset, contents));
  return readEntries(in, file.entries, footer.index_offset, contents);
}

}  // namespace isoreel::container
