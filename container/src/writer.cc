// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/container/writer.h>

#include "src/chunk.h"
#include "src/compress.h"
#include "src/contents.h"
#include "src/file_output.h"
#include "src/index.h"
#include "src/signature.h"

namespace isoreel {

using namespace container;

struct Writer::State {
  std::unique_ptr<FileOutput> output;
  TrackRecord track;
  Bytes track_payload;
  std::string tags;
  Uuid uuid{};
  FrameOrder order;
  IndexBuilder index;
  Status failed;  // what every later call gets

  Result<Bytes> preamble(ByteSpan first_frame);
  Status write(const Packet& packet);
  Status finish();
  Status put(ByteSpan bytes);
};

namespace {

Status checkTags(const std::string& tags) {
  if (tags.empty() || tags.front() != '{') {
    return {ErrorCode::kInvalidArgument,
            "tags are not a JSON object: they do not start with '{' (spec container 6)"};
  }
  if (tags.size() <= kMaxTags) return {};
  return {ErrorCode::kInvalidArgument, "tags of " + std::to_string(tags.size()) + " bytes are above " +
                                           std::to_string(kMaxTags) + " (spec container 10)"};
}

}  // namespace

// Signature, tags and track record. The UUID is made of the first frame too, so they are written with it.
// Tags stand in front: who plays the file forward has them once the track is there.
Result<Bytes> Writer::State::preamble(ByteSpan first_frame) {
  uuid = makeUuid(track_payload, first_frame);
  ISOREEL_ASSIGN(Bytes bytes, makeSignature(uuid));
  if (tags != "{}") {
    ISOREEL_ASSIGN(const Bytes payload,
                   compress(ByteSpan(reinterpret_cast<const std::uint8_t*>(tags.data()), tags.size())));
    ISOREEL_TRY(appendChunk(bytes, kTagsType, payload));
  }
  ISOREEL_TRY(appendChunk(bytes, kTrackType, track_payload));
  return bytes;
}

// An error of the disk is for good.
Status Writer::State::put(ByteSpan bytes) {
  Status status = output->append(bytes);
  if (!status.ok()) failed = status;
  return status;
}

Status Writer::State::write(const Packet& packet) {
  ISOREEL_TRY(failed);
  const std::string place = output->name() + ": frame " + std::to_string(packet.header.number);
  ISOREEL_TRY(order.check(packet.header).at(place));
  Bytes start;
  ISOREEL_TRY(appendFrameStart(start, track.id, packet.header, packet.data.size()).at(place));
  Bytes bytes;
  ISOREEL_TRY(appendChunk(bytes, kFrameType, start, packet.data));
  const std::size_t chunk_bytes = bytes.size();
  if (output->bytes() == 0) {
    ISOREEL_ASSIGN(const Bytes front,
                   preamble(ByteSpan(bytes).subspan(ChunkHeader::kBytes, chunk_bytes - kChunkOverhead)));
    bytes.insert(bytes.begin(), front.begin(), front.end());
  }
  const std::uint64_t offset = output->bytes() + bytes.size() - chunk_bytes;
  ISOREEL_TRY(index.add(track.id, packet.header, offset, chunk_bytes).at(place));
  ISOREEL_TRY(put(bytes));
  order.passed(packet.header);
  return {};
}

Status Writer::State::finish() {
  ISOREEL_TRY(failed);
  if (output->bytes() == 0) {
    ISOREEL_ASSIGN(const Bytes front, preamble({}));
    ISOREEL_TRY(put(front));
  }
  ISOREEL_ASSIGN(const Bytes chunks, index.finish(uuid, tags, track, output->bytes()));
  ISOREEL_TRY(put(chunks));
  failed = output->commit();
  ISOREEL_TRY(failed);
  failed = {ErrorCode::kInvalidArgument, output->name() + ": finished already, nothing can be added"};
  return {};
}

Writer::Writer(std::unique_ptr<State> state) : state_(std::move(state)) {}
Writer::~Writer() = default;

Result<std::unique_ptr<Writer>> Writer::create(const std::filesystem::path& path, WriterSettings settings) {
  auto state = std::make_unique<State>();
  state->track.time_base = settings.time_base;
  state->track.name = std::move(settings.track_name);
  state->track.configuration = std::move(settings.configuration);
  if (Status status = writeSyntax(state->track_payload, state->track); !status.ok()) {
    return {ErrorCode::kInvalidArgument, path.string() + ": " + std::string(status.message())};
  }
  ISOREEL_TRY(checkTags(settings.tags).at(path.string()));
  state->tags = std::move(settings.tags);
  ISOREEL_ASSIGN(state->output,
                 withoutThrowing([&] { return FileOutput::create(path, settings.overwrite); }));
  return std::unique_ptr<Writer>(new Writer(std::move(state)));
}

Status Writer::write(const Packet& packet) {
  return withoutThrowing([&] { return state_->write(packet); });
}

Status Writer::finish() {
  return withoutThrowing([&] { return state_->finish(); });
}

void Writer::discard() {
  State& state = *state_;
  state.output->remove();
  if (state.failed.ok()) {
    state.failed = {ErrorCode::kInvalidArgument, state.output->name() + ": discarded, nothing can be added"};
  }
}

std::uint64_t Writer::bytesWritten() const { return state_->output->bytes(); }

}  // namespace isoreel
