// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/container/reader.h>

#include <algorithm>

#include "src/chunk.h"
#include "src/contents.h"
#include "src/open.h"

namespace isoreel {
namespace {

using namespace container;

Result<Bytes> readPacket(ByteSource& source, std::uint64_t track, const FrameEntry& frame) {
  ISOREEL_ASSIGN(Bytes chunk, readExactly(source, frame.offset, frame.bytes));
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

// Walks the chunks of an attachment. Others may stand between its parts: parity, for one.
Status extractParts(ByteSource& source, const Attachment& attachment, ByteSink& out) {
  const auto place = [](std::uint64_t offset) { return "byte " + std::to_string(offset); };
  std::uint64_t next = 0, bytes = 0;
  const std::uint64_t end = attachment.offset + attachment.length;
  for (std::uint64_t offset = attachment.offset; offset < end;) {
    ISOREEL_ASSIGN(const Bytes front, readExactly(source, offset, ChunkHeader::kBytes));
    ISOREEL_ASSIGN(const ChunkHeader header, readChunkHeader(front).at(place(offset)));
    if (header.length > end - offset - ChunkHeader::kBytes) break;
    const std::uint64_t whole = header.length + kChunkOverhead;
    if (header.type == kAttachmentType) {
      ISOREEL_TRY(checkPayloadLength(header).at(place(offset)));
      ISOREEL_ASSIGN(const Bytes chunk, readExactly(source, offset, whole));
      ISOREEL_ASSIGN(const ByteSpan payload, readChunk(chunk, kAttachmentType).at(place(offset)));
      ISOREEL_ASSIGN(const PartFacts facts, readPart(payload).at(place(offset)));
      if (facts.part.name != attachment.name || facts.part.part != next) break;
      ISOREEL_TRY(out.append(facts.content));
      bytes += facts.content.size();
      ++next;
    }
    offset += whole;
  }
  if (bytes == attachment.bytes) return {};
  return {ErrorCode::kBadData, "its parts are not those that are listed (spec container 7.3)"};
}

}  // namespace

struct Reader::State {
  std::unique_ptr<ByteSource> source;
  Contents contents;
  std::size_t chosen = 0;

  const TrackContents& track() const { return contents.tracks[chosen]; }
};

Reader::Reader(std::unique_ptr<State> state) : state_(std::move(state)) {}
Reader::~Reader() = default;

Result<std::unique_ptr<Reader>> Reader::open(const std::filesystem::path& path, const std::string& track) {
  ISOREEL_ASSIGN(auto source, openFile(path));
  return open(std::move(source), track);
}

Result<std::unique_ptr<Reader>> Reader::open(std::unique_ptr<ByteSource> source, const std::string& track) {
  auto state = std::make_unique<State>();
  state->source = std::move(source);
  ByteSource& bytes = *state->source;
  const auto opened = [&]() -> Status {
    ISOREEL_TRY(openContents(bytes, state->contents));
    ISOREEL_ASSIGN(state->chosen, state->contents.choose(track));
    return {};
  };
  const Status status = withoutThrowing(opened).at(bytes.name());
  if (!status.ok()) return status;
  return std::unique_ptr<Reader>(new Reader(std::move(state)));
}

const FileInfo& Reader::info() const { return state_->contents.info; }
std::uint64_t Reader::frameCount() const { return state_->track().shown.size(); }
std::uint64_t Reader::entryCount() const { return state_->track().entries.size(); }
std::uint64_t Reader::entryOf(std::uint64_t frame) const {
  return state_->track().shown[static_cast<std::size_t>(frame)];
}
const FrameHeader& Reader::header(std::uint64_t frame) const { return entryHeader(entryOf(frame)); }
const FrameHeader& Reader::entryHeader(std::uint64_t entry) const {
  return state_->track().entries[static_cast<std::size_t>(entry)].header;
}
std::uint64_t Reader::chunkOffset(std::uint64_t entry) const {
  return state_->track().entries[static_cast<std::size_t>(entry)].offset;
}
std::uint64_t Reader::chunkBytes(std::uint64_t entry) const {
  return state_->track().entries[static_cast<std::size_t>(entry)].bytes;
}

Result<Bytes> Reader::packet(std::uint64_t frame) {
  if (frame < frameCount()) return entryPacket(entryOf(frame));
  return {ErrorCode::kNotFound, state_->source->name() + ": there is no frame at position " +
                                    std::to_string(frame) + "; the file has " + std::to_string(frameCount())};
}

Result<Bytes> Reader::entryPacket(std::uint64_t entry) {
  ByteSource& source = *state_->source;
  if (entry >= entryCount()) {
    return {ErrorCode::kNotFound,
            source.name() + ": there is no packet at position " + std::to_string(entry)};
  }
  const FrameEntry& frame = state_->track().entries[static_cast<std::size_t>(entry)];
  return withoutThrowing([&] { return readPacket(source, state_->track().record.id, frame); })
      .at(source.name() + ": " + framePlace(frame.header, frame.offset));
}

Status Reader::extract(const std::string& name, ByteSink& out) {
  ByteSource& source = *state_->source;
  for (const Attachment& attachment : info().attachments) {
    if (attachment.name != name) continue;
    return withoutThrowing([&] { return extractParts(source, attachment, out); })
        .at(source.name() + ": attachment '" + name + "'");
  }
  return {ErrorCode::kNotFound, source.name() + ": there is no attachment '" + name + "'"};
}

}  // namespace isoreel
