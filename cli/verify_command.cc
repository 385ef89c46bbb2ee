// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <isoreel/codec/decoder.h>
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
  std::uint64_t frames = 0;
  std::vector<std::string> problems;
  std::vector<std::uint64_t> lost;  // frames that are well, but depend on some that are not

  /// What was found of a frame that was decoded after those before it. A P frame whose reference is missing
  /// is lost; its reference is among the problems.
  void addFrame(const FrameHeader& header, const Status& status) {
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
Status verifyChunks(const VerifyOptions& options, Findings& findings, std::vector<FrameHeader>& headers) {
  ISOREEL_ASSIGN(std::unique_ptr<ByteSource> source, openFile(options.input));
  ISOREEL_ASSIGN(const std::unique_ptr<StreamReader> stream, StreamReader::open(std::move(source)));
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
  return forEachFrame<Item>(
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
          ++findings.frames;
          headers.push_back(header);
          findings.addFrame(header, item.statuses[i]);
          progress.advance();
        }
        return {};
      });
}

/// After the first damage, where reading forward ends: what else is damaged, as far as it can be found.
void verifyRest(const VerifyOptions& options, Findings& findings) {
  Result<Input> input = openInput(options.input);
  if (!input || input->info.bytes == 0) return;
  for (const std::string& line : input->info.damage) findings.add({ErrorCode::kBadData, line});
  Decoder decoder;
  for (std::uint64_t i = findings.frames; i < input->packets->entryCount() && !interrupted; ++i) {
    Packet packet{input->packets->entryHeader(i), {}};
    Result<Bytes> data = input->packets->entryPacket(i);
    findings.add(data.status());
    if (!data) continue;
    packet.data = *std::move(data);
    ++findings.frames;
    findings.addFrame(packet.header, checkFrame(decoder, packet, input->configuration));
  }
}

/// The seek index must be there and say what the frames say.
Status verifyIndex(const VerifyOptions& options, const std::vector<FrameHeader>& headers) {
  ISOREEL_ASSIGN(std::unique_ptr<ByteSource> source, openFile(options.input));
  if (!source->seekable()) return {};
  ISOREEL_ASSIGN(const std::unique_ptr<Reader> reader, Reader::open(std::move(source)));
  if (!reader->info().indexed)
    return {ErrorCode::kBadData, "no seek index: the file was not finished, or is cut (spec container 6)"};
  if (reader->entryCount() != headers.size()) {
    return {ErrorCode::kBadData, fmt::format("the seek index lists {} packets, the file holds {}",
                                             reader->entryCount(), headers.size())};
  }
  for (std::uint64_t i = 0; i < reader->entryCount(); ++i) {
    Bytes indexed, stored;
    ISOREEL_TRY(writeSyntax(indexed, reader->entryHeader(i)));
    ISOREEL_TRY(writeSyntax(stored, headers[i]));
    if (indexed != stored)
      return {ErrorCode::kBadData,
              fmt::format("the seek index does not agree with the header of frame {}", i)};
    ISOREEL_TRY(reader->entryPacket(i).status());
  }
  return {};
}

Status verify(const VerifyOptions& options) {
  Findings findings{options.input, 0, {}, {}};
  std::vector<FrameHeader> headers;
  if (const Status status = verifyChunks(options, findings, headers); !status.ok()) {
    findings.add(status);
    if (!interrupted) verifyRest(options, findings);
  } else if (const Status index = verifyIndex(options, headers); !index.ok()) {
    findings.add(index);
  }
  if (interrupted) return {ErrorCode::kIo, "interrupted"};
  if (options.json) {
    fmt::print("{}\n", nlohmann::ordered_json{{"ok", findings.problems.empty()},
                                              {"frames", findings.frames},
                                              {"problems", findings.problems},
                                              {"lost", findings.lost}}
                           .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  } else {
    for (const std::string& problem : findings.problems) fmt::print("{}\n", problem);
    for (const std::string& loss : findings.losses()) fmt::print("{}\n", loss);
    if (findings.problems.empty())
      fmt::print("{}: {}, every checksum, hash and surface is right\n", options.input,
                 counted(findings.frames, "frame"));
  }
  if (findings.problems.empty()) return {};
  return {ErrorCode::kBadData,
          fmt::format("{}: {}", options.input, counted(findings.problems.size(), "problem"))};
}

}  // namespace

void addVerifyCommand(CLI::App& app, Action& chosen) {
  CLI::App* verb = app.add_subcommand(
      "verify", "Check every checksum, decode every frame, compare hashes, check that surfaces are closed");
  const auto options = std::make_shared<VerifyOptions>();
  verb->add_option("input", options->input, "The .isr file; - for standard input")->required();
  verb->add_option("--jobs", options->jobs, "Threads; 0: one a core")->check(CLI::Range(0, 256));
  verb->add_flag(
      "--json", options->json,
      "One JSON object: ok, frames, problems, lost (numbers of frames that others' damage takes away)");
  verb->callback([options, &chosen] { chosen = [options] { return verify(*options); }; });
}

}  // namespace isoreel::cli
