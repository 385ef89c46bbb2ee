// SPDX-License-Identifier: BSD-3-Clause
#include "src/scan.h"

#include <algorithm>
#include <optional>

#include "src/chunk.h"
#include "src/compress.h"
#include "src/signature.h"
#include "src/window.h"

namespace isoreel::container {
namespace {

class Scanner {
 public:
  Scanner(ByteSource& source, std::uint64_t size, Contents& contents)
      : window_(source, size), size_(size), contents_(contents) {}

  Status run() {
    ISOREEL_TRY(signature());
    for (std::uint64_t position = Signature::kBytes; position < size_;) {
      const Step step = chunk(position);
      ISOREEL_TRY(window_.status());
      if (step.status.ok()) {
        closeGap(position);
        contents_.end = step.next;
      } else if (!gap_start_) {
        gap_start_ = position;
        gap_reason_ = step.status.message();
      }
      position = step.next;
    }
    closeGap(size_);
    if (contents_.tracks.empty()) {
      return {ErrorCode::kTruncated, "neither a track record nor a frame is whole (spec container 9.2)"};
    }
    for (const TrackContents& track : contents_.tracks) {
      if (track.has_record) continue;
      contents_.info.damage.push_back(
          "track " + std::to_string(track.record.id) +
          ": no record is whole: time base, name and configuration are lost (spec "
          "container 5)");
    }
    return {};
  }

 private:
  struct Step {
    Status status;
    std::uint64_t next;  // where to look for the next chunk
  };

  Status signature() {
    ISOREEL_ASSIGN(const SignatureFacts facts,
                   readSignature(first(window_.at(0, Signature::kBytes), Signature::kBytes)));
    if (!facts.crc_good) {
      contents_.info.damage.emplace_back("signature: CRC does not match (spec container 2.2)");
      return {};
    }
    contents_.info.uuid = facts.signature.uuid;
    contents_.info.version = facts.signature.version;
    contents_.info.minor = facts.signature.minor;
    return {};
  }

  // The chunk at `position`, or what is wrong with it.
  Step chunk(std::uint64_t position) {
    const ByteSpan front = window_.at(position, ChunkHeader::kBytes);
    if (front.size() < ChunkHeader::kBytes) {
      return {{ErrorCode::kTruncated, "ends inside a chunk header (spec container 3.1)"}, size_};
    }
    const Result<ChunkHeader> header = readChunkHeader(front);
    if (!header.ok()) return {header.status(), window_.nextHeader(position + 1)};
    const std::uint64_t room = size_ - position - ChunkHeader::kBytes;
    if (room < kPayloadCrcBytes || header->length > room - kPayloadCrcBytes) {
      return {
          {ErrorCode::kTruncated, "ends inside a " + typeName(header->type) + " chunk (spec container 3.1)"},
          window_.nextHeader(position + 1)};
    }
    const std::uint64_t end = position + kChunkOverhead + header->length;
    if (Status limit = checkPayloadLength(*header); !limit.ok()) return {std::move(limit), end};
    Bytes kept;
    if (Status crc = payload(position + ChunkHeader::kBytes, *header, kept); !crc.ok()) {
      // Bytes may be missing, so chunks may start inside. But a file made of chunk headers in each other's
      // payloads must not cost a CRC of the rest for each: beyond the file's size in failed payloads, whole
      // ones are passed.
      failed_bytes_ += header->length;
      return {crc.at(typeName(header->type)), failed_bytes_ > size_ ? end : window_.nextHeader(position + 1)};
    }
    return {take(*header, position, kept), end};
  }

  // Checks the payload's CRC, and keeps as much of the payload as its type needs.
  Status payload(std::uint64_t offset, const ChunkHeader& header, Bytes& kept) {
    std::uint64_t keep = 0;
    if (header.type == kFrameType) keep = kMaxFrameStart;
    if (header.type == kTrackType || header.type == kTagsType || header.type == kChaptersType ||
        header.type == kAttachmentType) {
      keep = header.length;
    }
    std::uint32_t crc = 0;
    for (std::uint64_t done = 0; done < header.length;) {
      const ByteSpan bytes = first(window_.at(offset + done, 1), header.length - done);
      if (bytes.empty()) return {ErrorCode::kTruncated, "the file became shorter while it was read"};
      crc = crc32c(bytes, crc);
      const ByteSpan more = first(bytes, keep - std::min<std::uint64_t>(keep, kept.size()));
      kept.insert(kept.end(), more.begin(), more.end());
      done += bytes.size();
    }
    return checkPayloadCrc(crc,
                           first(window_.at(offset + header.length, kPayloadCrcBytes), kPayloadCrcBytes));
  }

  Status take(const ChunkHeader& header, std::uint64_t position, const Bytes& kept) {
    if (header.type == kFrameType) return frame(header, position, kept);
    if (header.type == kTrackType) return track(kept);
    if (header.type == kAttachmentType) return attachment(header, position, kept);
    if (header.type == kTagsType) {
      ISOREEL_ASSIGN(const Bytes tags, decompress(kept, kMaxTags));
      contents_.info.tags.assign(tags.begin(), tags.end());
    }
    if (header.type == kChaptersType) {
      ISOREEL_ASSIGN(const Bytes content, decompress(kept, kMaxChaptersContent));
      ISOREEL_ASSIGN(contents_.info.chapters, readChapters(content));
    }
    return {};
  }

  Status frame(const ChunkHeader& header, std::uint64_t position, const Bytes& kept) {
    ISOREEL_ASSIGN(const FrameFacts facts, readFrameStart(kept, header.length));
    if (contents_.tracks.size() >= kMaxTracks && !known(facts.track)) return tooManyTracks();
    TrackContents& track = contents_.track(facts.track);
    orders_.resize(contents_.tracks.size());
    FrameOrder& order = orders_[static_cast<std::size_t>(&track - contents_.tracks.data())];
    ISOREEL_TRY(order.checkRising(facts.header));
    order.passed(facts.header);
    track.add({facts.header, position, header.length + kChunkOverhead});
    return {};
  }

  // The first record of a track counts.
  Status track(const Bytes& kept) {
    TrackRecord record;
    ByteReader in(kept);
    ISOREEL_TRY(readSyntax(in, record));
    if (contents_.tracks.size() >= kMaxTracks && !known(record.id)) return tooManyTracks();
    TrackContents& track = contents_.track(record.id);
    if (!track.has_record) track.record = std::move(record);
    track.has_record = true;
    return {};
  }

  Status attachment(const ChunkHeader& header, std::uint64_t position, const Bytes& kept) {
    ISOREEL_ASSIGN(const PartFacts facts, readPart(kept));
    return attachments_.add(facts.part, facts.content.size(), position, header.length + kChunkOverhead);
  }

  bool known(std::uint64_t id) const {
    return std::any_of(contents_.tracks.begin(), contents_.tracks.end(),
                       [&](const TrackContents& t) { return t.record.id == id; });
  }
  static Status tooManyTracks() {
    return {ErrorCode::kLimit, "more than " + std::to_string(kMaxTracks) + " tracks (spec container 10)"};
  }

  void closeGap(std::uint64_t end) {
    if (!gap_start_) return;
    contents_.info.damage.push_back("byte " + std::to_string(*gap_start_) + ", " +
                                    std::to_string(end - *gap_start_) + " bytes left out: " + gap_reason_);
    gap_start_.reset();
  }

  static ByteSpan first(ByteSpan bytes, std::uint64_t count) {
    return bytes.first(static_cast<std::size_t>(std::min<std::uint64_t>(bytes.size(), count)));
  }

  Window window_;
  const std::uint64_t size_;
  Contents& contents_;
  std::vector<FrameOrder> orders_;  // of contents_.tracks
  AttachmentList attachments_{contents_.info.attachments};
  std::uint64_t failed_bytes_ = 0;
  std::optional<std::uint64_t> gap_start_;
  std::string gap_reason_;
};

}  // namespace

Status scanChunks(ByteSource& source, std::uint64_t size, Contents& contents) {
  return Scanner(source, size, contents).run();
}

}  // namespace isoreel::container
