// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <isoreel/codec/decoder.h>
#include <isoreel/container/parity.h>
#include <isoreel/container/reader.h>
#include <isoreel/inspect/manifold.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <regex>

#include "command.h"
#include "decoding.h"
#include "gop.h"
#include "input.h"
#include "output.h"
#include "parallel.h"
#include "progress.h"

namespace isoreel::cli {
namespace {

struct VerifyOptions {
  std::string input;
  std::string track;
  bool json = false;
  int jobs = 0;
};

/// What was found of a packet.
struct FrameCheck {
  Status status;
  std::size_t faults = 0;  // vertices at which the surface is no 2-manifold; not looked at after an error
};

/// Every rule that a decoded frame must keep, beyond those that decoding checks.
Status checkFrame(Decoder& decoder, const Packet& packet, const Configuration& track, std::size_t& faults) {
  const FrameHeader& header = packet.header;
  ISOREEL_ASSIGN(const PacketHeader head, readPacketHeader(packet.data));
  const auto differs = [](const char* what) {
    return Status(ErrorCode::kBadData,
                  fmt::format("{} of the frame header is not that of the packet (spec container 4.1)", what));
  };
  // Number and time of the packet are those it was coded with: a cut or a join gives the frame others.
  if (head.type != header.type) return differs("the type");
  if (head.isovalue != header.isovalue) return differs("the isovalue");
  if (head.vertices != header.vertices || head.faces != header.faces) return differs("a count");
  if (head.surface_hash != header.surface_hash) return differs("the surface hash");
  ISOREEL_ASSIGN(const Surface surface, decoder.decode(packet.data, decodeOptions()));
  if (!(surface.grid == track.grid)) return differs("the track's grid, and so the box,");
  ISOREEL_TRY(checkClosed(surface));
  faults = inspect::manifoldness(surface.quads, surface.vertices.size()).faults;
  return {};
}

FrameCheck check(Decoder& decoder, const Packet& packet, const Configuration& track) {
  FrameCheck result;
  result.status = checkFrame(decoder, packet, track, result.faults);
  return result;
}

/// Frames that are well, but depend on some that are not.
struct LostFrames {
  std::string track;
  std::vector<std::uint64_t> frames;
};

/// A frame whose surface is no 2-manifold: of profile classic, where sheets meet in a cell.
struct JoinedFrame {
  std::string track;
  std::uint64_t frame;
  std::size_t vertices;
};

struct Findings {
  std::string file;
  std::string track = {};      // name or number of the one looked at; "" where the file has only that
  std::uint64_t frames = 0;    // shown ones
  std::uint64_t in_track = 0;  // packets of the track that came before the damage
  std::vector<std::string> problems = {};
  std::vector<LostFrames> lost = {};  // by track, for those that have such
  std::vector<JoinedFrame> joined = {};

  std::string trackText(const std::string& name) const {
    return name.empty() ? "" : fmt::format(" of track '{}'", name);
  }
  /// What was found of a frame that was decoded after those before it. A P frame whose reference is missing
  /// is lost; its reference is among the problems.
  void addFrame(const FrameHeader& header, const FrameCheck& found) {
    const Status& status = found.status;
    if (found.faults > 0 && !header.hidden()) joined.push_back({track, header.number, found.faults});
    if (header.hidden() && !status.ok() && status.error().code == ErrorCode::kNotFound) return;
    if (!status.ok() && header.type == PacketType::kPredicted &&
        status.error().code == ErrorCode::kNotFound) {
      if (lost.empty() || lost.back().track != track) lost.push_back({track, {}});
      lost.back().frames.push_back(header.number);
    } else {
      add(status.at(fmt::format("frame {}{}", header.number, trackText(track))));
    }
  }
  /// "frames 6 to 7 cannot be decoded without it", a line for each run.
  std::vector<std::string> losses() const {
    std::vector<std::string> lines;
    for (const auto& [name, numbers] : lost) {
      for (std::size_t i = 0; i < numbers.size();) {
        std::size_t end = i + 1;
        while (end < numbers.size() && numbers[end] == numbers[end - 1] + 1) ++end;
        const std::string run = end - i == 1 ? fmt::format("frame {}", numbers[i])
                                             : fmt::format("frames {} to {}", numbers[i], numbers[end - 1]);
        lines.push_back(fmt::format("{}: {}{} cannot be decoded without it", file, run, trackText(name)));
        i = end;
      }
    }
    return lines;
  }
  std::string manifoldText() const {
    if (joined.empty()) return "all are 2-manifolds";
    std::size_t vertices = 0;
    for (const JoinedFrame& each : joined) vertices += each.vertices;
    return fmt::format("{} no 2-manifold, at {} {} together",
                       joined.size() == 1 ? "1 frame is" : fmt::format("{} frames are", joined.size()),
                       vertices, vertices == 1 ? "vertex" : "vertices");
  }
  nlohmann::ordered_json lostJson() const {
    auto list = nlohmann::ordered_json::array();
    for (const auto& [name, numbers] : lost) list.push_back({{"track", name}, {"frames", numbers}});
    return list;
  }
  nlohmann::ordered_json joinedJson() const {
    auto list = nlohmann::ordered_json::array();
    for (const JoinedFrame& each : joined)
      list.push_back({{"track", each.track}, {"frame", each.frame}, {"vertices", each.vertices}});
    return list;
  }
  std::vector<std::uint64_t> allLost() const {
    std::vector<std::uint64_t> all;
    for (const LostFrames& each : lost) all.insert(all.end(), each.frames.begin(), each.frames.end());
    return all;
  }

  /// Once each, with the file's name. Fine is no problem. Of one chunk, the line that names its frame stays.
  void add(const Status& status) {
    if (status.ok()) return;
    const std::string problem(named(status, file).message());
    const std::string chunk = chunkOf(problem);
    const auto same = std::find_if(problems.begin(), problems.end(), [&](const std::string& p) {
      return p == problem || (!chunk.empty() && chunkOf(p) == chunk);
    });
    if (same == problems.end()) {
      problems.push_back(problem);
    } else if (!isFrame(*same) && isFrame(problem)) {
      *same = problem;
    }
  }

 private:
  std::string_view behindName(const std::string& problem) const {
    const std::string_view text(problem);
    return text.substr(std::min(text.size(), text.find(file + ": ") == 0 ? file.size() + 2 : 0));
  }
  bool isFrame(const std::string& problem) const { return behindName(problem).starts_with("frame "); }
  /// "4781" of "byte 4781 (after frame 2): …" and "frame 3 at byte 4781: …", which tell of a chunk.
  std::string chunkOf(const std::string& problem) const {
    static const std::regex kChunk("^(frame [0-9]+ at )?byte ([0-9]+)");
    std::match_results<std::string_view::const_iterator> found;
    const std::string_view text = behindName(problem);
    return std::regex_search(text.begin(), text.end(), found, kChunk) ? found[2].str() : "";
  }
};

/// Checks packets in order, a GOP a thread. `next` as of GopSource.
Status verifyPackets(const VerifyOptions& options, const Configuration& configuration,
                     const std::function<Result<bool>(Packet&)>& next, Findings& findings,
                     std::vector<FrameHeader>& headers) {
  const ThreadLimit limit(options.jobs);
  Progress progress("verify", std::nullopt);
  struct Item {
    Gop gop;
    std::vector<FrameCheck> checks;
  };
  GopSource gops(next);
  return forEachFrame<Item>(
      options.jobs, [&](Item& item) { return gops.next(item.gop); },
      [&](Item& item) -> Status {
        Decoder decoder(parallelWithin);
        for (const Packet& packet : item.gop.packets)
          item.checks.push_back(check(decoder, packet, configuration));
        return {};
      },
      [&](Item& item) -> Status {
        for (std::size_t i = 0; i < item.checks.size(); ++i) {
          const FrameHeader& header = item.gop.packets[i].header;
          ++findings.in_track;
          findings.frames += header.hidden() ? 0u : 1u;
          headers.push_back(header);
          findings.addFrame(header, item.checks[i]);
          progress.advance();
        }
        return {};
      });
}

/// Reads the file as a pipe would be read: every byte of every chunk is looked at.
Status verifyChunks(const VerifyOptions& options, std::unique_ptr<ByteSource> source, Findings& findings,
                    std::vector<FrameHeader>& headers, FileInfo& info) {
  ISOREEL_ASSIGN(const std::unique_ptr<StreamReader> stream,
                 StreamReader::open(std::move(source), options.track));
  ISOREEL_ASSIGN(const Configuration configuration, readConfiguration(stream->info().configuration));
  const auto next = [&](Packet& packet) -> Result<bool> {
    ISOREEL_ASSIGN(std::optional<Packet> read, stream->next());
    if (!read) return false;
    packet = *std::move(read);
    return true;
  };
  Status status = verifyPackets(options, configuration, next, findings, headers);
  info = stream->info();
  return status;
}

/// A file of another container has no checksums but those of the packets.
Status verifyCarried(const VerifyOptions& options, lavf::Sniffed bytes, Findings& findings) {
  ISOREEL_ASSIGN(const Input input, openInput(std::move(bytes), options.track));
  for (const std::string& line : input.info.damage) findings.add({ErrorCode::kBadData, line});
  std::vector<FrameHeader> headers;
  const auto next = [&, entry = std::uint64_t{0}](Packet& packet) mutable -> Result<bool> {
    if (entry == input.packets->entryCount()) return false;
    packet.header = input.packets->entryHeader(entry);
    ISOREEL_ASSIGN(packet.data, input.packets->entryPacket(entry++));
    return true;
  };
  return verifyPackets(options, input.configuration, next, findings, headers);
}

/// What else is damaged, frame or not.
void scanRest(const VerifyOptions& options, Findings& findings) {
  const auto source = openBytes(options.input);
  if (!source.ok() || !(*source)->seekable()) return;
  const Result<FileInfo> info = scanFile(**source);
  if (!info.ok()) return;
  for (const std::string& line : info->damage) findings.add({ErrorCode::kBadData, line});
}

/// After the first damage, where reading forward ends: what else is damaged, as far as it can be found.
void verifyRest(const VerifyOptions& options, Findings& findings) {
  Result<Input> input = openInput(options.input, options.track);
  if (!input || input->info.bytes == 0) return;
  for (const std::string& line : input->info.damage) findings.add({ErrorCode::kBadData, line});
  Decoder decoder(parallelWithin);
  for (std::uint64_t i = findings.in_track; i < input->packets->entryCount() && !interrupted; ++i) {
    Packet packet{input->packets->entryHeader(i), {}};
    Result<Bytes> data = input->packets->entryPacket(i);
    findings.add(data.status());
    if (!data) continue;
    packet.data = *std::move(data);
    findings.frames += packet.header.hidden() ? 0u : 1u;
    findings.addFrame(packet.header, check(decoder, packet, input->configuration));
  }
}

/// The seek index must be there and say what the chunks say. `stream`: what was found forward.
Status verifyIndex(const VerifyOptions& options, const std::vector<FrameHeader>& headers,
                   const FileInfo& stream) {
  ISOREEL_ASSIGN(std::unique_ptr<ByteSource> source, openBytes(options.input));
  if (!source->seekable()) return {};
  ISOREEL_ASSIGN(const std::unique_ptr<Reader> reader, Reader::open(std::move(source), options.track));
  const FileInfo& info = reader->info();
  if (!info.indexed)
    return {ErrorCode::kBadData, "no seek index: the file was not finished, or is cut (spec container 7)"};
  const auto wrong = [](const std::string& what) {
    return Status(ErrorCode::kBadData,
                  "the seek index does not agree with the " + what + " (spec container 7)");
  };
  if (info.tags != stream.tags) return wrong("tags");
  if (info.chapters != stream.chapters) return wrong("chapters");
  if (info.attachments != stream.attachments) return wrong("attachments");
  if (info.uuid != stream.uuid) return wrong("signature");
  for (std::size_t i = 0; i < std::max(info.tracks.size(), stream.tracks.size()); ++i) {
    if (info.tracks.size() != stream.tracks.size() || info.tracks[i].id != stream.tracks[i].id ||
        info.tracks[i].name != stream.tracks[i].name ||
        info.tracks[i].time_base != stream.tracks[i].time_base ||
        info.tracks[i].configuration != stream.tracks[i].configuration) {
      return wrong("track records");
    }
  }
  if (reader->entryCount() != headers.size()) {
    return {ErrorCode::kBadData, fmt::format("the seek index lists {} packets, the file holds {}",
                                             reader->entryCount(), headers.size())};
  }
  for (std::uint64_t i = 0; i < reader->entryCount(); ++i) {
    if (reader->entryHeader(i) != headers[i])
      return wrong(fmt::format("header of frame {}", headers[i].number));
    ISOREEL_TRY(reader->entryPacket(i).status());
  }
  return {};
}

/// Parity is of no use if it is not checked before it is needed.
ParityReport verifyParity(const VerifyOptions& options) {
  const auto source = openBytes(options.input);
  if (!source.ok() || !(*source)->seekable()) return {};
  Result<ParityReport> report = checkParity(**source);
  return report.ok() ? *std::move(report) : ParityReport();
}

struct TrackToVerify {
  std::string choice;  // as --track has it
  std::string name;    // for people
};
/// The one asked for, or all. What is a pipe has one.
std::vector<TrackToVerify> tracksToVerify(const VerifyOptions& options, bool pipe) {
  if (!options.track.empty() || pipe) return {{options.track, options.track}};
  const Result<Input> input = openInput(options.input);
  if (!input.ok() || input->info.tracks.size() < 2) return {{"", ""}};
  std::vector<TrackToVerify> tracks;
  for (const TrackInfo& track : input->info.tracks) {
    const std::string id = std::to_string(track.id);
    tracks.push_back({tracks.empty() ? "" : id, track.name.empty() ? id : track.name});
  }
  return tracks;
}

/// One track. Whether the file is one of another container.
bool verifyTrack(const VerifyOptions& options, Result<lavf::Sniffed> bytes, Findings& findings) {
  if (!bytes.ok()) {
    findings.add(bytes.status());
    return false;
  }
  if (bytes->carrier) {
    findings.add(verifyCarried(options, *std::move(bytes), findings));
    return true;
  }
  std::vector<FrameHeader> headers;
  FileInfo info;
  findings.in_track = 0;
  const Status status = verifyChunks(options, std::move(bytes->source), findings, headers, info);
  if (status.ok()) {
    findings.add(verifyIndex(options, headers, info));
  } else {
    findings.add(status);
    if (!interrupted) verifyRest(options, findings);
  }
  return false;
}

Status verify(const VerifyOptions& all) {
  Findings findings{.file = all.input};
  Result<lavf::Sniffed> bytes = openSniffed(all.input);
  const bool pipe = !bytes.ok() || !bytes->source->seekable();
  auto open = [&, opened = true]() mutable -> Result<lavf::Sniffed> {
    if (!std::exchange(opened, false)) return openSniffed(all.input);
    return std::move(bytes);
  };
  bool carried = false;
  for (const TrackToVerify& track : tracksToVerify(all, pipe)) {
    VerifyOptions options = all;
    options.track = track.choice;
    findings.track = track.name;
    carried = verifyTrack(options, open(), findings);
    if (interrupted) return {ErrorCode::kIo, "interrupted"};
  }
  if (!findings.problems.empty() && !carried && !pipe) scanRest(all, findings);
  const ParityReport parity = carried || pipe ? ParityReport() : verifyParity(all);
  if (all.json) {
    fmt::print("{}\n", nlohmann::ordered_json{{"ok", findings.problems.empty()},
                                              {"frames", findings.frames},
                                              {"problems", findings.problems},
                                              {"lost", findings.allLost()},
                                              {"lost_by_track", findings.lostJson()},
                                              {"not_manifold", findings.joinedJson()},
                                              {"parity",
                                               {{"bytes", parity.bytes},
                                                {"damaged_blocks", parity.damaged},
                                                {"restorable_blocks", parity.restored}}}}
                           .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  } else {
    for (const std::string& problem : findings.problems) fmt::print("{}\n", problem);
    for (const std::string& loss : findings.losses()) fmt::print("{}\n", loss);
    if (parity.damaged > 0)
      fmt::print("{}: parity can restore {} of {} damaged blocks: isoreel repair\n", all.input,
                 parity.restored, parity.damaged);
    if (findings.problems.empty())
      fmt::print("{}: {}, every checksum, hash and surface is right; {}{}\n", all.input,
                 counted(findings.frames, "frame"), findings.manifoldText(),
                 parity.runs > 0 ? fmt::format("; parity protects {} bytes", parity.bytes) : "");
  }
  if (findings.problems.empty()) return {};
  return {ErrorCode::kBadData,
          fmt::format("{}: {}", all.input, counted(findings.problems.size(), "problem"))};
}

}  // namespace

void addVerifyCommand(CLI::App& app, Action& chosen) {
  CLI::App* verb = app.add_subcommand("verify",
                                      "Check every checksum, decode every frame, compare hashes, check that "
                                      "surfaces are closed and manifolds");
  const auto options = std::make_shared<VerifyOptions>();
  verb->add_option("input", options->input, kInputHelp)->required();
  verb->add_option("--jobs", options->jobs, "Threads; 0: one a core")->check(CLI::Range(0, 256));
  verb->add_flag(
      "--json", options->json,
      "One JSON object: ok, frames, problems, lost (numbers of frames that others' damage takes "
      "away), lost_by_track, not_manifold (frames with vertices at which the surface is no 2-manifold, as "
      "profile classic has), parity");
  addTrackOption(*verb, options->track);
  verb->callback([options, &chosen] { chosen = [options] { return verify(*options); }; });
}

}  // namespace isoreel::cli
