// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <isoreel/codec/decoder.h>
#include <isoreel/container/parity.h>
#include <isoreel/container/reader.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "command.h"
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

/// Every rule that a decoded frame must keep, beyond those that decoding checks.
Status checkFrame(Decoder& decoder, const Packet& packet, const Configuration& track) {
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
  ISOREEL_ASSIGN(const Surface surface, decoder.decode(packet.data));
  if (!(surface.grid == track.grid)) return differs("the track's grid, and so the box,");
  return checkClosed(surface);
}

struct Findings {
  std::string file;
  std::uint64_t frames = 0;    // shown ones
  std::uint64_t in_track = 0;  // packets of the track that came before the damage
  std::vector<std::string> problems;
  std::vector<std::uint64_t> lost;  // frames that are well, but depend on some that are not

  /// What was found of a frame that was decoded after those before it. A P frame whose reference is missing
  /// is lost; its reference is among the problems.
  void addFrame(const FrameHeader& header, const Status& status) {
    if (header.hidden() && !status.ok() && status.error().code == ErrorCode::kNotFound) return;
    if (!status.ok() && header.type == PacketType::kPredicted &&
        status.error().code == ErrorCode::kNotFound) {
      lost.push_back(header.number);
    } else {
      add(status.at(fmt::format("frame {}", header.number)));
    }
  }
  /// "frames 6 to 7 cannot be decoded without it", a line for each run.
  std::vector<std::string> losses() const {
    std::vector<std::string> lines;
    for (std::size_t i = 0; i < lost.size();) {
      std::size_t end = i + 1;
      while (end < lost.size() && lost[end] == lost[end - 1] + 1) ++end;
      lines.push_back(end - i == 1 ? fmt::format("{}: frame {} cannot be decoded without it", file, lost[i])
                                   : fmt::format("{}: frames {} to {} cannot be decoded without it", file,
                                                 lost[i], lost[end - 1]));
      i = end;
    }
    return lines;
  }

  /// Once each, with the file's name. Fine is no problem.
  void add(const Status& status) {
    const std::string problem(named(status, file).message());
    if (!status.ok() && std::find(problems.begin(), problems.end(), problem) == problems.end())
      problems.push_back(problem);
  }
};

/// Reads the file as a pipe would be read: every byte of every chunk is looked at.
Status verifyChunks(const VerifyOptions& options, Findings& findings, std::vector<FrameHeader>& headers,
                    FileInfo& info) {
  ISOREEL_ASSIGN(std::unique_ptr<ByteSource> source, openFile(options.input));
  ISOREEL_ASSIGN(const std::unique_ptr<StreamReader> stream,
                 StreamReader::open(std::move(source), options.track));
  ISOREEL_ASSIGN(const Configuration configuration, readConfiguration(stream->info().configuration));
  const ThreadLimit limit(options.jobs);
  Progress progress("verify", std::nullopt);
  struct Item {
    Gop gop;
    std::vector<Status> statuses;
  };
  GopSource gops([&](Packet& packet) -> Result<bool> {
    ISOREEL_ASSIGN(std::optional<Packet> read, stream->next());
    if (!read) return false;
    packet = *std::move(read);
    return true;
  });
  const Status status = forEachFrame<Item>(
      options.jobs, [&](Item& item) { return gops.next(item.gop); },
      [&](Item& item) -> Status {
        Decoder decoder;
        for (const Packet& packet : item.gop.packets)
          item.statuses.push_back(checkFrame(decoder, packet, configuration));
        return {};
      },
      [&](Item& item) -> Status {
        for (std::size_t i = 0; i < item.statuses.size(); ++i) {
          const FrameHeader& header = item.gop.packets[i].header;
          ++findings.in_track;
          findings.frames += header.hidden() ? 0u : 1u;
          headers.push_back(header);
          findings.addFrame(header, item.statuses[i]);
          progress.advance();
        }
        return {};
      });
  info = stream->info();
  return status;
}

/// What else is damaged, frame or not, and was not named yet.
void scanRest(const VerifyOptions& options, Findings& findings) {
  const auto source = openFile(options.input);
  if (!source.ok() || !(*source)->seekable()) return;
  const Result<FileInfo> info = scanFile(**source);
  if (!info.ok()) return;
  for (const std::string& line : info->damage) {
    const std::string place = line.substr(0, line.find(','));  // "byte 123"
    const auto names = [&](const std::string& problem) {
      const std::size_t at = problem.find(place);
      return at != std::string::npos &&
             (at + place.size() == problem.size() ||
              std::isdigit(static_cast<unsigned char>(problem[at + place.size()])) == 0);
    };
    if (std::none_of(findings.problems.begin(), findings.problems.end(), names))
      findings.add({ErrorCode::kBadData, line});
  }
}

/// After the first damage, where reading forward ends: what else is damaged, as far as it can be found.
void verifyRest(const VerifyOptions& options, Findings& findings) {
  Result<Input> input = openInput(options.input, options.track);
  if (!input || input->info.bytes == 0) return;
  for (const std::string& line : input->info.damage) findings.add({ErrorCode::kBadData, line});
  Decoder decoder;
  for (std::uint64_t i = findings.in_track; i < input->packets->entryCount() && !interrupted; ++i) {
    Packet packet{input->packets->entryHeader(i), {}};
    Result<Bytes> data = input->packets->entryPacket(i);
    findings.add(data.status());
    if (!data) continue;
    packet.data = *std::move(data);
    findings.frames += packet.header.hidden() ? 0u : 1u;
    findings.addFrame(packet.header, checkFrame(decoder, packet, input->configuration));
  }
}

/// The seek index must be there and say what the chunks say. `stream`: what was found forward.
Status verifyIndex(const VerifyOptions& options, const std::vector<FrameHeader>& headers,
                   const FileInfo& stream) {
  ISOREEL_ASSIGN(std::unique_ptr<ByteSource> source, openFile(options.input));
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
  const auto source = openFile(options.input);
  if (!source.ok() || !(*source)->seekable()) return {};
  Result<ParityReport> report = checkParity(**source);
  return report.ok() ? *std::move(report) : ParityReport();
}

/// The tracks to look at: the one asked for, or all.
std::vector<std::string> tracksToVerify(const VerifyOptions& options) {
  if (!options.track.empty()) return {options.track};
  auto source = openFile(options.input);
  if (!source.ok() || !(*source)->seekable()) return {""};
  const auto reader = Reader::open(*std::move(source));
  std::vector<std::string> tracks;
  for (std::size_t i = 0; reader.ok() && i < (*reader)->info().tracks.size(); ++i)
    tracks.push_back(i == 0 ? "" : std::to_string((*reader)->info().tracks[i].id));
  return tracks.empty() ? std::vector<std::string>{""} : tracks;
}

Status verify(const VerifyOptions& all) {
  Findings findings{all.input, 0, 0, {}, {}};
  for (const std::string& track : tracksToVerify(all)) {
    VerifyOptions options = all;
    options.track = track;
    std::vector<FrameHeader> headers;
    FileInfo info;
    findings.in_track = 0;
    if (const Status status = verifyChunks(options, findings, headers, info); !status.ok()) {
      findings.add(status);
      if (!interrupted) verifyRest(options, findings);
    } else if (const Status index = verifyIndex(options, headers, info); !index.ok()) {
      findings.add(index);
    }
    if (interrupted) return {ErrorCode::kIo, "interrupted"};
  }
  if (!findings.problems.empty()) scanRest(all, findings);
  const ParityReport parity = verifyParity(all);
  if (all.json) {
    fmt::print("{}\n", nlohmann::ordered_json{{"ok", findings.problems.empty()},
                                              {"frames", findings.frames},
                                              {"problems", findings.problems},
                                              {"lost", findings.lost},
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
      fmt::print("{}: {}, every checksum, hash and surface is right{}\n", all.input,
                 counted(findings.frames, "frame"),
                 parity.runs > 0 ? fmt::format("; parity protects {} bytes", parity.bytes) : "");
  }
  if (findings.problems.empty()) return {};
  return {ErrorCode::kBadData,
          fmt::format("{}: {}", all.input, counted(findings.problems.size(), "problem"))};
}

}  // namespace

void addVerifyCommand(CLI::App& app, Action& chosen) {
  CLI::App* verb = app.add_subcommand(
      "verify", "Check every checksum, decode every frame, compare hashes, check that surfaces are closed");
  const auto options = std::make_shared<VerifyOptions>();
  verb->add_option("input", options->input, "The .isr file; - for standard input")->required();
  verb->add_option("--jobs", options->jobs, "Threads; 0: one a core")->check(CLI::Range(0, 256));
  verb->add_flag("--json", options->json,
                 "One JSON object: ok, frames, problems, lost (numbers of frames that others' damage takes "
                 "away), parity");
  addTrackOption(*verb, options->track);
  verb->callback([options, &chosen] { chosen = [options] { return verify(*options); }; });
}

}  // namespace isoreel::cli
