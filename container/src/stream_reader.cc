// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/container/reader.h>

#include <algorithm>

#include "src/chunk.h"
#include "src/compress.h"
#include "src/contents.h"
#include "src/signature.h"

namespace isoreel {

using namespace container;

struct StreamReader::State {
  std::unique_ptr<ByteSource> source;
  FileInfo info;
  std::string wanted;  // name or id of the track, "" for the first
  bool has_track = false;
  std::size_t chosen = 0;          // the one that is played, in info.tracks
  std::uint64_t position = 0;      // of the next byte to read
  std::vector<FrameOrder> orders;  // of info.tracks
  AttachmentList attachments{info.attachments};
  std::uint64_t index_offset = 0;  // of the last INDX chunk, and its length
  std::uint64_t index_length = 0;
  bool footer_last = false;  // the chunk read last was a footer
  bool ended = false;
  Status failed;

  Status open();
  Result<std::optional<Packet>> next();
  Result<bool> chunk(std::optional<Packet>& packet);
  Result<std::optional<Packet>> take(const ChunkHeader& header, std::uint64_t offset, Bytes payload);
  Result<std::optional<Packet>> frame(Bytes payload);
  Status takeTrack(const Bytes& payload);
  Status checkFooter(const Bytes& payload, std::uint64_t offset) const;
  Result<Bytes> read(std::uint64_t count);
  Result<Bytes> readPayload(const ChunkHeader& header);
};

// `count` bytes, fewer at the end of the stream. Memory grows with what arrives, not with what a length
// promises.
Result<Bytes> StreamReader::State::read(std::uint64_t count) {
  constexpr std::size_t kStep = std::size_t{1} << 20;
  Bytes bytes;
  while (bytes.size() < count) {
    const std::size_t had = bytes.size();
    bytes.resize(had + static_cast<std::size_t>(std::min<std::uint64_t>(count - had, kStep)));
    const std::span<std::uint8_t> rest = std::span(bytes).subspan(had);
    ISOREEL_ASSIGN(const std::size_t got, source->read(position, rest));
    position += got;
    if (got == rest.size()) continue;
    bytes.resize(had + got);
    break;
  }
  return bytes;
}

// The payload, its CRC checked; of chunks that are only skipped nothing is kept.
Result<Bytes> StreamReader::State::readPayload(const ChunkHeader& header) {
  const bool known = header.type == kFrameType || header.type == kTrackType || header.type == kTagsType ||
                     header.type == kChaptersType || header.type == kAttachmentType ||
                     header.type == kFooterType;
  if (known) ISOREEL_TRY(checkPayloadLength(header));
  const std::uint64_t step = known ? header.length : std::uint64_t{1} << 16;
  Bytes kept;
  std::uint32_t crc = 0;
  for (std::uint64_t done = 0; done < header.length;) {
    const std::uint64_t count = std::min(header.length - done, step);
    ISOREEL_ASSIGN(Bytes bytes, read(count));
    if (bytes.size() != count) {
      return {ErrorCode::kTruncated, "ends at byte " + std::to_string(position) + ", inside a " +
                                         typeName(header.type) + " payload of " +
                                         std::to_string(header.length) + " bytes (spec container 3.1)"};
    }
    crc = crc32c(bytes, crc);
    done += count;
    if (known) kept = std::move(bytes);
  }
  ISOREEL_ASSIGN(const Bytes stored, read(kPayloadCrcBytes));
  if (stored.size() != kPayloadCrcBytes) {
    return {ErrorCode::kTruncated,
            "ends at byte " + std::to_string(position) + ", inside a payload CRC (spec container 3.1)"};
  }
  ISOREEL_TRY(checkPayloadCrc(crc, stored));
  return kept;
}

Status StreamReader::State::open() {
  info.bytes = source->size().value_or(0);
  ISOREEL_ASSIGN(const Bytes bytes, read(Signature::kBytes));
  ISOREEL_ASSIGN(const SignatureFacts facts, readSignature(bytes));
  if (!facts.crc_good) return {ErrorCode::kBadData, "signature: CRC does not match (spec container 2.2)"};
  info.uuid = facts.signature.uuid;
  info.version = facts.signature.version;
  info.minor = facts.signature.minor;
  while (!has_track) {
    std::optional<Packet> packet;
    ISOREEL_ASSIGN(const bool more, chunk(packet));
    if (!more && info.tracks.empty())
      return {ErrorCode::kBadData, "there is no track record (spec container 2.1)"};
    if (!more) return {ErrorCode::kNotFound, "there is no track '" + wanted + "'"};
  }
  return {};
}

Result<std::optional<Packet>> StreamReader::State::next() {
  std::optional<Packet> packet;
  while (!packet) {
    ISOREEL_ASSIGN(const bool more, chunk(packet));
    if (!more) break;
  }
  return packet;
}

// Reads one chunk, and its packet if it is a frame of the track. False at the end of the file.
Result<bool> StreamReader::State::chunk(std::optional<Packet>& packet) {
  const std::uint64_t offset = position;
  ISOREEL_ASSIGN(const Bytes front, read(ChunkHeader::kBytes));
  if (front.empty() && footer_last) return false;
  const std::uint64_t frames = has_track ? info.tracks[chosen].frames : 0;
  std::string place = "byte " + std::to_string(offset);
  place += frames > 0 ? " (after frame " + std::to_string(frames - 1) + ")" : " (before frame 0)";
  if (front.empty()) {
    return Status(ErrorCode::kTruncated,
                  "the file ends without a footer: it was cut, or is still being written (spec container 8)")
        .at(place);
  }
  if (front.size() < ChunkHeader::kBytes) {
    return Status(ErrorCode::kTruncated, "ends inside a chunk header (spec container 3.1)").at(place);
  }
  ISOREEL_ASSIGN(const ChunkHeader header, readChunkHeader(front).at(place));
  // Which frame a damaged chunk held is known where there is one track only.
  if (header.type == kFrameType && info.tracks.size() == 1)
    place = "frame " + std::to_string(frames) + " at byte " + std::to_string(offset);
  ISOREEL_ASSIGN(Bytes payload, readPayload(header).at(place));
  ISOREEL_ASSIGN(packet, take(header, offset, std::move(payload)).at(place));
  footer_last = header.type == kFooterType;
  return true;
}

Result<std::optional<Packet>> StreamReader::State::take(const ChunkHeader& header, std::uint64_t offset,
                                                        Bytes payload) {
  if (header.type == kFrameType) return frame(std::move(payload));
  if (header.type == kTrackType) ISOREEL_TRY(takeTrack(payload));
  if (header.type == kFooterType) ISOREEL_TRY(checkFooter(payload, offset));
  if (header.type == kIndexType) {
    index_offset = offset;
    index_length = position - offset;
  }
  if (header.type == kTagsType) {
    ISOREEL_ASSIGN(const Bytes tags, decompress(payload, kMaxTags));
    info.tags.assign(tags.begin(), tags.end());
  }
  if (header.type == kChaptersType) {
    ISOREEL_ASSIGN(const Bytes content, decompress(payload, kMaxChaptersContent));
    ISOREEL_ASSIGN(info.chapters, readChapters(content));
  }
  if (header.type == kAttachmentType) {
    ISOREEL_ASSIGN(const PartFacts facts, readPart(payload));
    ISOREEL_TRY(attachments.add(facts.part, facts.content.size(), offset, header.length + kChunkOverhead));
  }
  return std::optional<Packet>();
}

Result<std::optional<Packet>> StreamReader::State::frame(Bytes payload) {
  ISOREEL_ASSIGN(const FrameFacts facts, readFrameStart(payload, payload.size()));
  const auto track = std::find_if(info.tracks.begin(), info.tracks.end(),
                                  [&](const TrackInfo& t) { return t.id == facts.track; });
  if (track == info.tracks.end())
    return {ErrorCode::kBadData, "frame in front of its track's record (spec container 2.1)"};
  const std::size_t index = static_cast<std::size_t>(track - info.tracks.begin());
  ISOREEL_TRY(orders[index].check(facts.header));
  orders[index].passed(facts.header);
  if (!facts.header.hidden()) ++track->frames;
  if (!has_track || index != chosen) return std::optional<Packet>();
  const auto start = payload.begin() + static_cast<std::ptrdiff_t>(facts.packet_start);
  payload.erase(std::copy(start, start + static_cast<std::ptrdiff_t>(facts.packet_bytes), payload.begin()),
                payload.end());
  return std::optional<Packet>(Packet{facts.header, std::move(payload)});
}

Status StreamReader::State::takeTrack(const Bytes& payload) {
  TrackRecord record;
  ByteReader in(payload);
  ISOREEL_TRY(readSyntax(in, record));
  const bool again = std::any_of(info.tracks.begin(), info.tracks.end(),
                                 [&](const TrackInfo& t) { return t.id == record.id; });
  if (again) return {};
  if (info.tracks.size() >= kMaxTracks)
    return {ErrorCode::kLimit, "more than " + std::to_string(kMaxTracks) + " tracks (spec container 10)"};
  info.tracks.push_back({record.id, record.name, record.time_base, record.configuration, 0});
  orders.emplace_back();
  if (has_track || (!wanted.empty() && !isTrack(record, wanted))) return {};
  has_track = true;
  chosen = info.tracks.size() - 1;
  info.track_id = record.id;
  info.time_base = record.time_base;
  info.track_name = std::move(record.name);
  info.configuration = std::move(record.configuration);
  return {};
}

Status StreamReader::State::checkFooter(const Bytes& payload, std::uint64_t offset) const {
  Footer footer;
  ByteReader in(payload);
  ISOREEL_TRY(readSyntax(in, footer));
  if (footer.uuid != info.uuid) {
    return {ErrorCode::kBadData, "footer: its UUID is not the signature's (spec container 8)"};
  }
  if (footer.file_length != offset + Footer::kChunkBytes) {
    return {ErrorCode::kBadData, "footer: it stands at the end of " +
                                     std::to_string(offset + Footer::kChunkBytes) + " bytes, not of " +
                                     std::to_string(footer.file_length) + " (spec container 8)"};
  }
  if (footer.index_offset != index_offset || footer.index_length != index_length) {
    return {ErrorCode::kBadData, "footer: the index is not where it says (spec container 8)"};
  }
  return {};
}

StreamReader::StreamReader(std::unique_ptr<State> state) : state_(std::move(state)) {}
StreamReader::~StreamReader() = default;

Result<std::unique_ptr<StreamReader>> StreamReader::open(std::unique_ptr<ByteSource> source,
                                                         const std::string& track) {
  auto state = std::make_unique<State>();
  state->wanted = track;
  state->source = std::move(source);
  ISOREEL_TRY(withoutThrowing([&] { return state->open(); }).at(state->source->name()));
  return std::unique_ptr<StreamReader>(new StreamReader(std::move(state)));
}

const FileInfo& StreamReader::info() const { return state_->info; }

Result<std::optional<Packet>> StreamReader::next() {
  State& state = *state_;
  if (!state.failed.ok()) return state.failed;
  if (state.ended) return std::optional<Packet>();
  Result<std::optional<Packet>> packet =
      withoutThrowing([&] { return state.next(); }).at(state.source->name());
  if (!packet.ok()) state.failed = packet.status();
  if (packet.ok() && !packet->has_value()) state.ended = true;
  return packet;
}

}  // namespace isoreel
