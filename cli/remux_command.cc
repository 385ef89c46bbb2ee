// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <isoreel/container/writer.h>
#include <isoreel/lavf/carrier_writer.h>

#include <algorithm>

#include "command.h"
#include "copy.h"
#include "interrupt.h"
#include "metadata.h"
#include "output.h"
#include "progress.h"

namespace isoreel::cli {
namespace {

struct RemuxOptions {
  std::string input;
  std::string output;
  std::string track;
  bool force = false;
  bool json = false;
};

/// The packets of a track that can be decoded, with numbers that count up: of a damaged file, without those
/// whose key or predecessor is lost.
class WholeGops final : public PacketSource {
 public:
  explicit WholeGops(PacketSource& source) : source_(source) {
    bool whole = false;  // the last packet is there, and all that it needs
    for (std::uint64_t i = 0; i < source.entryCount(); ++i) {
      FrameHeader header = source.entryHeader(i);
      const bool follows = i > 0 && source.entryHeader(i - 1).position + 1 == header.position;
      whole = header.back == 0 || (whole && follows);
      if (!whole) continue;
      header.number = shown_.size();
      header.position = headers_.size();
      if (!header.hidden()) shown_.push_back(headers_.size());
      headers_.push_back(header);
      entries_.push_back(i);
    }
  }
  std::uint64_t dropped() const { return source_.entryCount() - entries_.size(); }

  std::uint64_t frameCount() const override { return shown_.size(); }
  const FrameHeader& header(std::uint64_t frame) const override { return headers_[shown_[frame]]; }
  Result<Bytes> packet(std::uint64_t frame) override { return entryPacket(shown_[frame]); }
  std::uint64_t entryCount() const override { return entries_.size(); }
  std::uint64_t entryOf(std::uint64_t frame) const override { return shown_[frame]; }
  const FrameHeader& entryHeader(std::uint64_t entry) const override { return headers_[entry]; }
  Result<Bytes> entryPacket(std::uint64_t entry) override { return source_.entryPacket(entries_[entry]); }
  std::uint64_t entryBytes(std::uint64_t entry) const override { return source_.entryBytes(entries_[entry]); }
  void willRead(std::uint64_t begin, std::uint64_t end) override {
    if (begin < end) source_.willRead(entries_[begin], entries_[end - 1] + 1);
  }

 private:
  PacketSource& source_;
  std::vector<FrameHeader> headers_;
  std::vector<std::uint64_t> entries_, shown_;
};

struct Track {
  Input input;
  std::unique_ptr<WholeGops> packets;
};

/// Those asked for; each is read by itself.
Result<std::vector<Track>> openTracks(const RemuxOptions& options) {
  ISOREEL_ASSIGN(SourceFile source, openSource(options.input, options.track));
  std::vector<Track> tracks;
  for (Input& input : source.tracks) tracks.push_back({std::move(input), nullptr});
  for (Track& track : tracks) {
    track.packets = std::make_unique<WholeGops>(*track.input.packets);
    if (track.packets->dropped() > 0) {
      complain("isoreel: warning: {}: {} left out, which cannot be decoded without what is missing\n",
               options.input, counted(track.packets->dropped(), "packet"));
    }
    if (track.packets->frameCount() == 0) return {ErrorCode::kNotFound, options.input + ": holds no frame"};
  }
  return tracks;
}

/// The track whose next packet is the earliest; the number of tracks when all are written.
std::size_t earliest(const std::vector<Track>& tracks, const std::vector<std::uint64_t>& next) {
  std::size_t result = tracks.size();
  double first = 0;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    if (next[i] >= tracks[i].packets->entryCount()) continue;
    const double at = tracks[i].input.info.time_base.seconds(tracks[i].packets->entryHeader(next[i]).time);
    if (result < tracks.size() && at >= first) continue;
    result = i;
    first = at;
  }
  return result;
}

Status copyPackets(const std::vector<Track>& tracks, Writer& writer, Progress& progress) {
  std::vector<std::uint64_t> ids{0}, next(tracks.size(), 0);
  for (std::size_t i = 1; i < tracks.size(); ++i) {
    const FileInfo& info = tracks[i].input.info;
    const auto& there = writer.info().tracks;
    const bool taken = std::any_of(there.begin(), there.end(),
                                   [&](const TrackInfo& track) { return track.name == info.track_name; });
    const std::string name = taken ? fmt::format("{} {}", info.track_name, i) : info.track_name;
    ISOREEL_ASSIGN(const std::uint64_t id, writer.addTrack({info.time_base, name, info.configuration}));
    ids.push_back(id);
  }
  for (std::size_t i = earliest(tracks, next); i < tracks.size(); i = earliest(tracks, next)) {
    Packet packet{tracks[i].packets->entryHeader(next[i]), {}};
    ISOREEL_ASSIGN(packet.data, tracks[i].packets->entryPacket(next[i]++));
    ISOREEL_TRY(writer.write(packet, ids[i]));
    progress.advance();
    if (interrupted) return {ErrorCode::kIo, "interrupted"};
  }
  return {};
}

Result<std::vector<std::string>> toReel(const RemuxOptions& options, const std::vector<Track>& tracks,
                                        Progress& progress) {
  const FileInfo& info = tracks.front().input.info;
  std::vector<std::string> notes;
  ISOREEL_ASSIGN(const auto attachments, openAttachments(tracks.front().input, notes));
  WriterSettings settings{info.time_base, info.track_name, info.configuration, info.tags, options.force, {}};
  ISOREEL_ASSIGN(const std::unique_ptr<Writer> writer, Writer::create(options.output, std::move(settings)));
  Status status = copyPackets(tracks, *writer, progress);
  if (status.ok() && !info.chapters.empty()) status = writer->setChapters(info.chapters);
  for (const auto& [facts, content] : attachments) {
    if (status.ok()) status = writer->attach(facts.name, facts.media_type, *content);
  }
  if (status.ok()) status = writer->finish();
  if (!status.ok()) {
    writer->discard();
    return named(status, options.output);
  }
  std::uint64_t unknown = 0;
  for (const Track& track : tracks) {
    for (std::uint64_t i = 0; i < track.packets->frameCount(); ++i) {
      const FrameHeader& header = track.packets->header(i);
      unknown += header.faces > 0 && header.area == 0 ? 1u : 0u;
    }
  }
  if (unknown > 0) {
    notes.push_back(
        fmt::format("area, volume, box, pieces and errors of {} are 0: the input does not tell them",
                    counted(unknown, "frame")));
  }
  return notes;
}

Result<std::vector<std::string>> toCarrier(const RemuxOptions& options, lavf::Carrier carrier,
                                           const std::vector<Track>& tracks, Progress& progress) {
  const FileInfo& info = tracks.front().input.info;
  lavf::CarrierSettings settings{info.tags, info.chapters, info.time_base, {}, options.force, [&] {
                                   progress.advance();
                                   return !interrupted.load();
                                 }};
  std::vector<std::string> passed;
  ISOREEL_ASSIGN(settings.attachments, openAttachments(tracks.front().input, passed));
  std::vector<lavf::CarrierTrack> written;
  for (const Track& track : tracks) {
    const FileInfo& each = track.input.info;
    written.push_back({track.packets.get(), each.time_base, each.track_name, each.configuration});
  }
  ISOREEL_ASSIGN(std::vector<std::string> notes,
                 lavf::writeCarrier(options.output, carrier, written, settings));
  notes.insert(notes.end(), passed.begin(), passed.end());
  return notes;
}

Status remux(const RemuxOptions& options) {
  std::error_code ignored;
  if (std::filesystem::equivalent(options.input, options.output, ignored))
    throw CLI::ValidationError("--output", "is the input");
  const bool to_reel =
      CLI::detail::to_lower(std::filesystem::path(options.output).extension().string()) == ".isr";
  const Result<lavf::Carrier> carrier = lavf::carrierOf(options.output);
  if (!to_reel && !carrier.ok()) {
    if (carrier.error().code == ErrorCode::kUnsupported) return carrier.status().at(options.output);
    throw CLI::ValidationError(
        "--output", fmt::format("'{}' ends in none of .isr .nut .mov .mp4 .mkv .avi", options.output));
  }
  ISOREEL_TRY(mayWrite(options.output, options.force));
  ISOREEL_ASSIGN(const std::vector<Track> tracks, openTracks(options));
  std::uint64_t frames = 0, packets = 0;
  for (const Track& track : tracks) {
    frames += track.packets->frameCount();
    packets += track.packets->entryCount();
  }
  Progress progress("remux", packets);
  Result<std::vector<std::string>> notes =
      to_reel ? toReel(options, tracks, progress) : toCarrier(options, *carrier, tracks, progress);
  progress.clear();
  if (!notes) return interrupted ? Status(ErrorCode::kIo, "interrupted") : notes.status();
  const auto bytes = std::filesystem::file_size(options.output, ignored);
  if (options.json) {
    fmt::print("{}\n", dumped(Json{{"frames", frames},
                                   {"packets", packets},
                                   {"bytes", bytes},
                                   {"carrier", to_reel ? "isr" : lavf::carrierName(*carrier)},
                                   {"notes", *notes}}));
    return {};
  }
  for (const std::string& note : *notes) complain("isoreel: warning: {}: {}\n", options.output, note);
  fmt::print("{}: {}, {} bytes\n", options.output, counted(frames, "frame"), bytes);
  return {};
}

}  // namespace

void addRemuxCommand(CLI::App& app, Action& chosen) {
  CLI::App* verb = app.add_subcommand("remux",
                                      "Packets into another container, or from it into .isr, bit for bit. "
                                      "Times, keys, tags, chapters and facts "
                                      "of frames go along as far as it has a place for them; what it has "
                                      "none for is told on stderr, and it is "
                                      "an error if packets, times or keys would be lost");
  const auto options = std::make_shared<RemuxOptions>();
  verb->add_option("input", options->input, kInputHelp)->required();
  verb->add_option("-o,--output", options->output,
                   "By extension: .isr .nut .mov .mp4 .mkv, or .avi (constant rate)")
      ->required();
  verb->add_option("--track", options->track, "Name or number of the only track to take (default: all)")
      ->default_str("");
  verb->add_flag("--force", options->force, "Replace the output when it is there already");
  verb->add_flag("--json", options->json, "One JSON object: frames, packets, bytes, carrier, notes");
  verb->callback([options, &chosen] { chosen = [options] { return remux(*options); }; });
}

}  // namespace isoreel::cli
