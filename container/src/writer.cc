// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/container/writer.h>

#include <algorithm>

#include "src/chunk.h"
#include "src/compress.h"
#include "src/file_output.h"
#include "src/index.h"
#include "src/open.h"
#include "src/signature.h"

namespace isoreel {

using namespace container;

namespace {

// What one parity has to protect is kept in memory until then, and again by who repairs.
constexpr std::size_t kRegionBytes = std::size_t{32} << 20;

Status invalid(const std::string& what) { return {ErrorCode::kInvalidArgument, what}; }

Status checkTags(const std::string& tags) {
  if (tags.empty() || tags.front() != '{')
    return invalid("tags are not a JSON object: they do not start with '{' (spec container 6.1)");
  if (tags.size() <= kMaxTags) return {};
  return invalid("tags of " + std::to_string(tags.size()) + " bytes are above " + std::to_string(kMaxTags) +
                 " (spec container 10)");
}

ByteSpan spanOf(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

}  // namespace

struct Writer::State {
  struct Track {
    TrackRecord record;
    FrameOrder order;
    std::optional<FrameHeader> last;
  };

  std::unique_ptr<ByteSink> sink;
  WriterOptions options;
  FileInfo info;
  std::vector<Track> tracks;
  AttachmentList attachments{info.attachments};
  IndexBuilder index;
  std::uint64_t position = 0;  // bytes of the file
  Bytes region;                // what no parity protects yet; kept if parity is wanted
  bool frames_in_region = false;
  bool unflushed = false;
  Status failed;  // what every later call gets

  Result<std::uint64_t> addTrack(TrackSettings settings);
  Status load(const std::filesystem::path& path);
  Result<Bytes> preamble(ByteSpan first_frame);
  Status begin();
  Status write(const Packet& packet, std::uint64_t id);
  Status protect();
  Status endGop();
  Status setTags(std::string tags);
  Status setChapters(std::vector<Chapter> chapters);
  Status attach(AttachmentPart part, ByteSource& content);
  Status putPart(const AttachmentPart& part, ByteSpan content);
  Status putPacked(ChunkType type, ByteSpan content);
  Status finish();
  Status put(ByteSpan bytes);
};

Result<std::uint64_t> Writer::State::addTrack(TrackSettings settings) {
  ISOREEL_TRY(failed);
  if (tracks.size() >= kMaxTracks)
    return invalid("more than " + std::to_string(kMaxTracks) + " tracks (spec container 10)");
  TrackRecord record;
  for (const Track& track : tracks) {
    if (track.record.name == settings.name) return invalid("two tracks of the name '" + settings.name + "'");
    record.id = std::max(record.id, track.record.id + 1);
  }
  record.time_base = settings.time_base;
  record.name = std::move(settings.name);
  record.configuration = std::move(settings.configuration);
  Bytes payload;
  if (Status status = writeSyntax(payload, record); !status.ok()) return invalid(status.error().message);
  if (position > 0) {
    Bytes chunk;
    ISOREEL_TRY(appendChunk(chunk, kTrackType, payload));
    ISOREEL_TRY(put(chunk));
  }
  info.tracks.push_back({record.id, record.name, record.time_base, record.configuration, 0});
  tracks.push_back({std::move(record), {}, {}});
  return tracks.back().record.id;
}

// Signature, tags, chapters and track records. The UUID is made of the first frame too, so they are written
// with it. Tags stand in front: who plays the file forward has them once the track is there.
Result<Bytes> Writer::State::preamble(ByteSpan first_frame) {
  Bytes records;
  std::size_t first = 0;
  for (const Track& track : tracks) {
    Bytes payload;
    ISOREEL_TRY(writeSyntax(payload, track.record));
    if (records.empty()) first = payload.size();
    ISOREEL_TRY(appendChunk(records, kTrackType, payload));
  }
  info.uuid = makeUuid(ByteSpan(records).subspan(ChunkHeader::kBytes, first), first_frame);
  ISOREEL_ASSIGN(Bytes bytes, makeSignature(info.uuid));
  if (info.tags != "{}") {
    ISOREEL_ASSIGN(const Bytes payload, compress(spanOf(info.tags)));
    ISOREEL_TRY(appendChunk(bytes, kTagsType, payload));
  }
  if (!info.chapters.empty()) {
    ISOREEL_ASSIGN(const Bytes content, writeChapters(info.chapters));
    ISOREEL_ASSIGN(const Bytes payload, compress(content));
    ISOREEL_TRY(appendChunk(bytes, kChaptersType, payload));
  }
  bytes.insert(bytes.end(), records.begin(), records.end());
  return bytes;
}

Status Writer::State::begin() {
  if (position > 0) return {};
  ISOREEL_ASSIGN(const Bytes front, preamble({}));
  return put(front);
}

// An error of the disk is for good.
Status Writer::State::put(ByteSpan bytes) {
  if (Status status = sink->append(bytes); !status.ok()) {
    failed = status;
    return status;
  }
  position += bytes.size();
  unflushed = true;
  if (options.parity) region.insert(region.end(), bytes.begin(), bytes.end());
  return region.size() < kRegionBytes ? Status() : protect();
}

Status Writer::State::protect() {
  frames_in_region = false;
  if (region.empty()) return {};
  const Bytes bytes = std::exchange(region, {});
  ISOREEL_ASSIGN(const Bytes chunks, options.parity(bytes));
  ISOREEL_TRY(put(chunks));
  region.clear();
  return {};
}

Status Writer::State::endGop() {
  ISOREEL_TRY(failed);
  ISOREEL_TRY(protect());
  if (!options.sync || !unflushed) return {};
  failed = sink->sync();
  unflushed = false;
  return failed;
}

Status Writer::State::write(const Packet& packet, std::uint64_t id) {
  ISOREEL_TRY(failed);
  const std::string place = sink->name() + ": frame " + std::to_string(packet.header.number);
  const auto track =
      std::find_if(tracks.begin(), tracks.end(), [&](const Track& t) { return t.record.id == id; });
  if (track == tracks.end()) return invalid("there is no track " + std::to_string(id)).at(place);
  FrameHeader header = packet.header;
  header.position = track->order.duePosition();
  ISOREEL_TRY(track->order.check(header).at(place));
  if (header.back == 0 && frames_in_region) ISOREEL_TRY(protect());
  Bytes start;
  ISOREEL_TRY(appendFrameStart(start, id, header, packet.data.size()).at(place));
  Bytes bytes;
  ISOREEL_TRY(appendChunk(bytes, kFrameType, start, packet.data));
  const std::size_t chunk_bytes = bytes.size();
  if (position == 0) {
    ISOREEL_ASSIGN(const Bytes front,
                   preamble(ByteSpan(bytes).subspan(ChunkHeader::kBytes, chunk_bytes - kChunkOverhead)));
    bytes.insert(bytes.begin(), front.begin(), front.end());
  }
  const std::uint64_t offset = position + bytes.size() - chunk_bytes;
  ISOREEL_TRY(index.add(id, header, offset, chunk_bytes).at(place));
  frames_in_region = true;
  track->order.passed(header);
  track->last = header;
  if (!header.hidden()) ++info.tracks[static_cast<std::size_t>(track - tracks.begin())].frames;
  return put(bytes);
}

Status Writer::State::putPacked(ChunkType type, ByteSpan content) {
  ISOREEL_ASSIGN(const Bytes payload, compress(content));
  Bytes chunk;
  ISOREEL_TRY(appendChunk(chunk, type, payload));
  return put(chunk);
}

Status Writer::State::setTags(std::string tags) {
  ISOREEL_TRY(failed);
  ISOREEL_TRY(checkTags(tags));
  info.tags = std::move(tags);
  return position == 0 ? Status() : putPacked(kTagsType, spanOf(info.tags));
}

Status Writer::State::setChapters(std::vector<Chapter> chapters) {
  ISOREEL_TRY(failed);
  const Result<Bytes> content = writeChapters(chapters);
  if (!content) return invalid(content.error().message);
  info.chapters = std::move(chapters);
  return position == 0 ? Status() : putPacked(kChaptersType, *content);
}

Status Writer::State::putPart(const AttachmentPart& part, ByteSpan content) {
  Bytes payload;
  if (Status status = writeSized(payload, part); !status.ok()) return invalid(status.error().message);
  if ((part.flags & AttachmentPart::kRemoved) == 0) {
    ISOREEL_ASSIGN(const Bytes packed, compress(content));
    payload.insert(payload.end(), packed.begin(), packed.end());
  }
  Bytes chunk;
  ISOREEL_TRY(appendChunk(chunk, kAttachmentType, payload));
  ISOREEL_TRY(attachments.add(part, content.size(), position, chunk.size()));
  return put(chunk);
}

// One part is read ahead, since the last one says that it is the last.
Status Writer::State::attach(AttachmentPart part, ByteSource& content) {
  ISOREEL_TRY(failed);
  ISOREEL_TRY(begin());
  Bytes bytes(kMaxPartContent), ahead(kMaxPartContent);
  std::uint64_t offset = 0;
  const auto next = [&](Bytes& into) -> Status {
    ISOREEL_ASSIGN(const std::size_t got, content.read(offset, into));
    into.resize(got);
    offset += got;
    return {};
  };
  ISOREEL_TRY(next(bytes));
  for (;;) {
    ahead.resize(kMaxPartContent);
    if (bytes.size() == kMaxPartContent) {
      ISOREEL_TRY(next(ahead));
    } else {
      ahead.clear();
    }
    if (ahead.empty()) part.flags = AttachmentPart::kLast;
    ISOREEL_TRY(putPart(part, bytes));
    if (ahead.empty()) return {};
    part.media_type.clear();
    ++part.part;
    std::swap(bytes, ahead);
  }
}

Status Writer::State::finish() {
  ISOREEL_TRY(failed);
  ISOREEL_TRY(begin());
  ISOREEL_TRY(protect());
  std::vector<TrackRecord> records;
  for (const Track& track : tracks) records.push_back(track.record);
  ISOREEL_ASSIGN(const Bytes chunks, index.finish(info, records, position));
  options.parity = nullptr;
  ISOREEL_TRY(put(chunks));
  failed = sink->commit();
  ISOREEL_TRY(failed);
  failed = {ErrorCode::kInvalidArgument, sink->name() + ": finished already, nothing can be added"};
  return {};
}

// Takes over what the file at `path` holds, and cuts an unfinished end off.
Status Writer::State::load(const std::filesystem::path& path) {
  ISOREEL_ASSIGN(auto file, FileOutput::extend(path));
  ISOREEL_ASSIGN(const auto source, openFile(path));
  Contents contents;
  ISOREEL_TRY(openContents(*source, contents));
  const std::uint64_t size = contents.info.bytes;
  const std::uint64_t keep = contents.info.indexed ? size : contents.end;
  // Of a scan, an unfinished end is the one damage that may be.
  if (contents.info.version == 0 || contents.info.damage.size() > (keep < size ? 1 : 0)) {
    return {ErrorCode::kBadData,
            "is damaged, and cannot be continued before it is repaired: " + contents.info.damage.front()};
  }
  struct Place {
    std::uint64_t track;
    const FrameEntry* entry;
  };
  std::vector<Place> places;
  for (const TrackContents& track : contents.tracks) {
    Track& mine = tracks.emplace_back();
    mine.record = track.record;
    for (const FrameEntry& entry : track.entries) {
      ISOREEL_TRY(mine.order.check(entry.header));
      mine.order.passed(entry.header);
      mine.last = entry.header;
      places.push_back({track.record.id, &entry});
    }
  }
  std::sort(places.begin(), places.end(),
            [](const Place& a, const Place& b) { return a.entry->offset < b.entry->offset; });
  for (const Place& place : places)
    ISOREEL_TRY(index.add(place.track, place.entry->header, place.entry->offset, place.entry->bytes));
  ISOREEL_ASSIGN(std::ignore, contents.choose(""));
  info = std::move(contents.info);
  ISOREEL_TRY(file->keepFirst(keep));
  position = keep;
  sink = std::move(file);
  return {};
}

Writer::Writer(std::unique_ptr<State> state) : state_(std::move(state)) {}
Writer::~Writer() = default;

Result<std::unique_ptr<Writer>> Writer::create(const std::filesystem::path& path, WriterSettings settings) {
  ISOREEL_ASSIGN(auto sink, createFile(path, settings.overwrite));
  auto writer = create(std::move(sink), std::move(settings));
  return writer;
}

Result<std::unique_ptr<Writer>> Writer::create(std::unique_ptr<ByteSink> sink, WriterSettings settings) {
  auto state = std::make_unique<State>();
  state->sink = std::move(sink);
  state->options = std::move(settings.options);
  Status status = checkTags(settings.tags);
  if (status.ok()) {
    state->info.tags = std::move(settings.tags);
    status = state
                 ->addTrack(
                     {settings.time_base, std::move(settings.track_name), std::move(settings.configuration)})
                 .status();
  }
  if (!status.ok()) {
    state->sink->discard();
    return status.at(state->sink->name());
  }
  return std::unique_ptr<Writer>(new Writer(std::move(state)));
}

Result<std::unique_ptr<Writer>> Writer::append(const std::filesystem::path& path, WriterOptions options) {
  auto state = std::make_unique<State>();
  state->options = std::move(options);
  ISOREEL_TRY(withoutThrowing([&] {
    const Status status = state->load(path);
    return status.ok() || status.message().starts_with(path.string()) ? status : status.at(path.string());
  }));
  return std::unique_ptr<Writer>(new Writer(std::move(state)));
}

Result<std::uint64_t> Writer::addTrack(TrackSettings settings) {
  return withoutThrowing([&] { return state_->addTrack(std::move(settings)); });
}

Status Writer::write(const Packet& packet, std::uint64_t track) {
  return withoutThrowing([&] { return state_->write(packet, track); });
}

Status Writer::endGop() {
  return withoutThrowing([&] { return state_->endGop(); });
}

Status Writer::setTags(std::string tags) {
  return withoutThrowing([&] { return state_->setTags(std::move(tags)); });
}

Status Writer::setChapters(std::vector<Chapter> chapters) {
  return withoutThrowing([&] { return state_->setChapters(std::move(chapters)); });
}

Status Writer::attach(const std::string& name, const std::string& media_type, ByteSource& content) {
  return withoutThrowing([&] { return state_->attach({name, 0, 0, media_type}, content); });
}

Status Writer::removeAttachment(const std::string& name) {
  const auto& list = state_->info.attachments;
  if (std::none_of(list.begin(), list.end(), [&](const Attachment& a) { return a.name == name; }))
    return {ErrorCode::kNotFound, state_->sink->name() + ": there is no attachment '" + name + "'"};
  ISOREEL_TRY(state_->failed);
  return withoutThrowing([&] { return state_->putPart({name, 0, AttachmentPart::kRemoved, ""}, {}); });
}

const FileInfo& Writer::info() const { return state_->info; }

const FrameHeader* Writer::lastFrame(std::uint64_t track) const {
  for (const State::Track& t : state_->tracks) {
    if (t.record.id == track) return t.last ? &*t.last : nullptr;
  }
  return nullptr;
}

Status Writer::finish() {
  return withoutThrowing([&] { return state_->finish(); });
}

void Writer::discard() {
  State& state = *state_;
  state.sink->discard();
  if (state.failed.ok())
    state.failed = {ErrorCode::kInvalidArgument, state.sink->name() + ": discarded, nothing can be added"};
}

std::uint64_t Writer::bytesWritten() const { return state_->position; }

}  // namespace isoreel
