// SPDX-License-Identifier: BSD-3-Clause
#include "src/contents.h"

#include <algorithm>

#include "src/compress.h"

namespace isoreel {

bool Attachment::nameFits(const std::string& name) {
  if (name.empty() || name.size() > kMaxName || name == "." || name == "..") return false;
  return std::none_of(name.begin(), name.end(),
                      [](unsigned char c) { return c < 0x20 || c == 0x7F || c == '/' || c == '\\'; });
}

namespace container {

TrackContents& Contents::track(std::uint64_t id) {
  for (TrackContents& track : tracks) {
    if (track.record.id == id) return track;
  }
  tracks.emplace_back().record.id = id;
  return tracks.back();
}

bool isTrack(const TrackRecord& record, const std::string& text) {
  return record.name == text || std::to_string(record.id) == text;
}

Result<std::size_t> Contents::choose(const std::string& track) {
  if (tracks.empty() && track.empty()) tracks.emplace_back();
  std::size_t chosen = 0;
  if (!track.empty()) {
    const auto named = [&](const TrackContents& t) { return t.record.name == track; };
    auto found = std::find_if(tracks.begin(), tracks.end(), named);
    if (found == tracks.end()) {
      found = std::find_if(tracks.begin(), tracks.end(),
                           [&](const TrackContents& t) { return isTrack(t.record, track); });
    }
    if (found == tracks.end()) {
      return {ErrorCode::kNotFound, "there is no track '" + track + "'; the file has " +
                                        std::to_string(tracks.size()) +
                                        (tracks.size() == 1 ? " track" : " tracks")};
    }
    chosen = static_cast<std::size_t>(found - tracks.begin());
  }
  info.tracks.clear();
  for (const TrackContents& t : tracks) {
    if (t.has_record) info.tracks.push_back(t.info());
  }
  const TrackRecord& record = tracks[chosen].record;
  info.track_id = record.id;
  info.track_name = record.name;
  info.time_base = record.time_base;
  info.configuration = record.configuration;
  return chosen;
}

void AttachmentList::remove(const std::string& name) {
  std::erase_if(list_, [&](const Attachment& a) { return a.name == name; });
}

Status AttachmentList::add(const AttachmentPart& part, std::uint64_t content_bytes, std::uint64_t offset,
                           std::uint64_t chunk_bytes) {
  if ((part.flags & AttachmentPart::kRemoved) != 0) {
    next_part_ = 0;
    remove(part.name);
    return {};
  }
  const bool fits = part.part == 0 || (part.part == next_part_ && part.name == open_.name);
  if (!fits) {
    next_part_ = 0;
    return {ErrorCode::kBadData, "part " + std::to_string(part.part) +
                                     " of an attachment, and not the one before it"
                                     " (spec container 6.3)"};
  }
  if (part.part == 0) open_ = {part.name, part.media_type, 0, offset, 0};
  open_.bytes += content_bytes;
  open_.length = offset + chunk_bytes - open_.offset;
  next_part_ = std::uint64_t{part.part} + 1;
  if ((part.flags & AttachmentPart::kLast) == 0) return {};
  next_part_ = 0;
  remove(part.name);
  if (list_.size() >= kMaxAttachments) {
    return {ErrorCode::kLimit,
            "more than " + std::to_string(kMaxAttachments) + " attachments (spec container 10)"};
  }
  list_.push_back(open_);
  return {};
}

Result<PartFacts> readPart(ByteSpan payload) {
  ByteReader in(payload);
  PartFacts facts;
  ISOREEL_TRY(readSized(in, facts.part));
  const ByteSpan rest = in.bytes(in.left());
  if ((facts.part.flags & AttachmentPart::kRemoved) != 0) return facts;
  ISOREEL_ASSIGN(facts.content, decompress(rest, kMaxPartContent));
  return facts;
}

Result<std::vector<Chapter>> readChapters(ByteSpan content) {
  ByteReader in(content);
  ChapterCount count;
  ISOREEL_TRY(readSyntax(in, count));
  std::vector<Chapter> chapters;
  for (std::uint64_t i = 0; i < count.count; ++i) ISOREEL_TRY(readSized(in, chapters.emplace_back()));
  return chapters;
}

Result<Bytes> writeChapters(const std::vector<Chapter>& chapters) {
  Bytes content;
  ISOREEL_TRY(writeSyntax(content, ChapterCount{chapters.size()}));
  for (const Chapter& chapter : chapters) ISOREEL_TRY(writeSized(content, chapter));
  if (content.size() <= kMaxChaptersContent) return content;
  return {ErrorCode::kLimit, "chapters of " + std::to_string(content.size()) + " bytes are above " +
                                 std::to_string(kMaxChaptersContent) + " (spec container 10)"};
}

std::string framePlace(const FrameHeader& header, std::uint64_t offset) {
  return (header.hidden() ? "hidden packet before frame " : "frame ") + std::to_string(header.number) +
         " at byte " + std::to_string(offset);
}

}  // namespace container
}  // namespace isoreel
