// SPDX-License-Identifier: BSD-3-Clause
#include "observed.h"
#include "decoding.h"

#include <fmt/format.h>
#include <isoreel/codec/decoder.h>
#include <isoreel/container/reader.h>

namespace isoreel::cli {
namespace {

using Json = nlohmann::ordered_json;

/// The rule in a message, without the places in front of it, which are the reader's to word.
std::string ruleOf(std::string_view message) {
  const std::size_t colon = message.rfind(": ");
  return std::string(colon == std::string_view::npos ? message : message.substr(colon + 2));
}

/// Whether all packets from the I frame on are there, by what headers say (spec container 4.3).
bool hasAllItNeeds(const Reader& reader, std::uint64_t entry) {
  for (; reader.entryHeader(entry).back > 0; --entry) {
    if (entry == 0) return false;
    const FrameHeader &header = reader.entryHeader(entry), &before = reader.entryHeader(entry - 1);
    if (header.position != before.position + 1 || header.back != before.back + 1) return false;
  }
  return true;
}

Result<Surface> surfaceOf(Reader& reader, Decoder& decoder, std::uint64_t entry) {
  ISOREEL_ASSIGN(const Bytes packet, reader.entryPacket(entry));
  if (!hasAllItNeeds(reader, entry))
    return {ErrorCode::kNotFound, "a packet that it needs is not there (spec container 4.3)"};
  return decoder.decode(packet, decodeOptions());
}

Json frameOf(Reader& reader, Decoder& decoder, std::uint64_t entry) {
  const FrameHeader& header = reader.entryHeader(entry);
  Json frame = {{"number", header.number}, {"time", header.time}, {"hidden", header.hidden()}};
  if (header.error_kind != ErrorKind::kNone) {
    frame["error_kind"] = header.error_kind;
    frame["error_rms"] = header.error_rms;
    frame["error_max"] = header.error_max;
  }
  const Result<Surface> surface = surfaceOf(reader, decoder, entry);
  if (surface.ok()) {
    frame.update(summaryOf(*surface));
  } else {
    frame["error"] = ruleOf(surface.error().message);
  }
  return frame;
}

Result<Json> trackOf(const std::string& path, const TrackInfo& info) {
  ISOREEL_ASSIGN(const auto reader, Reader::open(path, std::to_string(info.id)));
  Decoder decoder;
  Json track = {{"id", info.id}, {"name", info.name}, {"frames", Json::array()}};
  for (std::uint64_t i = 0; i < reader->entryCount(); ++i)
    track["frames"].push_back(frameOf(*reader, decoder, i));
  return track;
}

/// An attachment's content as text: those of the vectors are that.
Json attachmentOf(Reader& reader, const Attachment& attachment) {
  Json found = {{"name", attachment.name}, {"media_type", attachment.media_type}};
  const auto content = reader.openAttachment(attachment.name);
  Bytes bytes(static_cast<std::size_t>(std::min<std::uint64_t>(attachment.bytes, 4096)));
  const auto got = content.ok() ? (*content)->read(0, bytes) : Result<std::size_t>(content.status());
  if (got.ok()) {
    found["content"] = std::string(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(*got));
  } else {
    found["error"] = ruleOf(got.error().message);
  }
  return found;
}

/// The first track from front to end, without the index.
Json pipeOf(const std::string& path) {
  Json pipe = {{"packets", 0}};
  const auto play = [&]() -> Status {
    ISOREEL_ASSIGN(auto source, openFile(path));
    ISOREEL_ASSIGN(const auto stream, StreamReader::open(std::move(source)));
    for (int packets = 1;; ++packets) {
      ISOREEL_ASSIGN(const auto packet, stream->next());
      if (!packet) return {};
      pipe["packets"] = packets;
    }
  };
  if (const Status status = play(); !status.ok()) pipe["error"] = ruleOf(status.message());
  return pipe;
}

}  // namespace

Json summaryOf(const Surface& surface) {
  return {{"vertices", surface.vertices.size()},
          {"faces", surface.quads.size()},
          {"hash", fmt::format("{:016x}", surfaceHash(surface))}};
}

Result<Json> observeFile(const std::string& path) {
  ISOREEL_ASSIGN(const auto reader, Reader::open(path));
  const FileInfo& info = reader->info();
  Json found = {{"indexed", info.indexed},      {"tags", info.tags},       {"chapters", Json::array()},
                {"attachments", Json::array()}, {"tracks", Json::array()}, {"damage", Json::array()}};
  for (const Chapter& c : info.chapters)
    found["chapters"].push_back(
        {{"kind", static_cast<int>(c.kind)}, {"start", c.start}, {"length", c.length}, {"title", c.title}});
  for (const Attachment& a : info.attachments) found["attachments"].push_back(attachmentOf(*reader, a));
  std::vector<TrackInfo> tracks = info.tracks;
  if (tracks.empty()) tracks.emplace_back().id = info.track_id;  // its record is lost
  for (const TrackInfo& track : tracks) {
    ISOREEL_ASSIGN(Json one, trackOf(path, track));
    found["tracks"].push_back(std::move(one));
  }
  for (const std::string& line : info.damage) found["damage"].push_back(ruleOf(line));
  found["pipe"] = pipeOf(path);
  return found;
}

}  // namespace isoreel::cli
