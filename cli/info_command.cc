// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "command.h"
#include "facts.h"
#include "input.h"
#include "interrupt.h"
#include "metadata.h"
#include "output.h"
#include "packet_list.h"

namespace isoreel::cli {
namespace {

struct InfoOptions {
  std::string input;
  std::string track;
  bool json = false;
  bool frames = false;
  bool follow = false;
  bool packets = false;
  int jobs = 0;
  bool events = false;
  std::string plot;
  bool force = false;
};

std::string hashText(std::uint64_t hash) { return fmt::format("{:016x}", hash); }

Vec3d corner(const Grid& grid, const std::array<std::uint32_t, 3>& position) {
  return grid.world(
      Vec3d{position[0] / double{kCell}, position[1] / double{kCell}, position[2] / double{kCell}});
}

/// `key`: number of the frame that its decoding starts with, null when a packet on the way from there is
/// lost.
Json frameJson(const FrameHeader& h, const Configuration& c, TimeBase base, Json key, std::uint64_t bytes) {
  Json box = nullptr;
  if (h.faces > 0) box = {{"min", corner(c.grid, h.box_min)}, {"max", corner(c.grid, h.box_max)}};
  return {{"number", h.number},
          {"time", base.seconds(h.time)},
          {"duration", base.seconds(h.duration)},
          {"type", typeName(h.type)},
          {"key", std::move(key)},
          {"bytes", bytes},
          {"isovalue", h.isovalue},
          {"vertices", h.vertices},
          {"faces", h.faces},
          {"box", box},
          {"area", h.area},
          {"volume", h.volume},
          {"components", h.components},
          {"euler", h.euler},
          {"error", errorJson(h.error_kind, h.error_rms, h.error_max)},
          {"hash", hashText(h.surface_hash)}};
}

Json frameJson(const Input& input, std::uint64_t frame) {
  const PacketSource& packets = *input.packets;
  Json key = nullptr;
  if (const auto entry = keyEntry(packets, frame); entry.ok()) key = packets.entryHeader(*entry).number;
  return frameJson(packets.header(frame), input.configuration, input.info.time_base, std::move(key),
                   packets.entryBytes(packets.entryOf(frame)));
}

Json tracksJson(const FileInfo& info) {
  Json tracks = Json::array();
  for (const TrackInfo& track : info.tracks)
    tracks.push_back({{"id", track.id}, {"name", track.name}, {"frames", track.frames}});
  return tracks;
}

Json fileJson(const Input& input) {
  const Configuration& c = input.configuration;
  const PacketSource& packets = *input.packets;
  std::uint64_t vertices = 0;
  for (std::uint64_t i = 0; i < packets.frameCount(); ++i) vertices += packets.header(i).vertices;
  double seconds = 0;
  if (packets.frameCount() > 0) {
    const FrameHeader &first = packets.header(0), &last = packets.header(packets.frameCount() - 1);
    // Subtracted as seconds: ticks of a hostile file may overflow.
    const TimeBase base = input.info.time_base;
    seconds = base.seconds(last.time) + base.seconds(last.duration) - base.seconds(first.time);
  }
  return {{"version", input.info.version},
          {"minor", input.info.minor},
          {"carrier", input.carrier ? lavf::carrierName(*input.carrier) : "isr"},
          {"uuid", input.carrier ? Json(nullptr) : Json(uuidText(input.info.uuid))},
          {"indexed", input.info.indexed},
          {"bytes", input.info.bytes == 0 ? Json(nullptr) : Json(input.info.bytes)},
          {"frames", packets.frameCount()},
          {"seconds", seconds},
          {"vertices", vertices},
          {"profile", c.profile == Profile::kClassic ? "classic" : "main"},
          {"inside", c.inside == Inside::kBelow ? "below" : "above"},
          {"step", c.step / double{kCell}},
          {"time_base", {input.info.time_base.numerator, input.info.time_base.denominator}},
          {"grid",
           {{"nodes", c.grid.nodes},
            {"origin", c.grid.origin},
            {"spacing", c.grid.spacing},
            {"direction", c.grid.direction},
            {"levels", octreeDepth(c.grid) + 1}}},
          {"tracks", tracksJson(input.info)},
          {"chapters", chaptersJson(input.info)},
          {"attachments", attachmentsJson(input.info)},
          {"damage", input.info.damage},
          {"tags", tagsOf(input.info)}};
}

void printFile(const std::string& path, const Json& file, const Input& input) {
  const Grid& grid = input.configuration.grid;
  const bool pipe = input.info.bytes == 0;
  fmt::print("{}: Isoreel {}.{}, profile {}, {}\n", path, file["version"].dump(), file["minor"].dump(),
             file["profile"].get<std::string>(),
             pipe ? "from a pipe"
                  : file["bytes"].dump() + " bytes" +
                        (input.carrier        ? fmt::format(" of {}", lavf::carrierName(*input.carrier))
                         : input.info.indexed ? ""
                                              : " (no seek index: unfinished, or cut)"));
  fmt::print("  frames   {} in {:.6g} s (time base {}/{})\n", file["frames"].dump(),
             file["seconds"].get<double>(), input.info.time_base.numerator, input.info.time_base.denominator);
  fmt::print("  grid     {} x {} x {} nodes, spacing {:.6g} {:.6g} {:.6g}, octree levels 0 to {}\n",
             grid.nodes[0], grid.nodes[1], grid.nodes[2], grid.spacing[0], grid.spacing[1], grid.spacing[2],
             octreeDepth(grid));
  fmt::print("  surface  inside is {} the isovalue, step {:.6g} cells, {} vertices in all\n",
             file["inside"].get<std::string>(), file["step"].get<double>(), file["vertices"].dump());
  if (!input.carrier) fmt::print("  uuid     {}\n", file["uuid"].get<std::string>());
  for (const std::string& line : input.info.damage) fmt::print("  damage   {}\n", line);
  if (file["tracks"].size() > 1) {
    for (const Json& track : file["tracks"])
      fmt::print("  track    {} '{}', {} frames\n", track["id"].dump(), printable(track["name"]),
                 track["frames"].dump());
  }
  for (const std::string& line : chapterLines(input.info)) fmt::print("  {}\n", line);
  for (const Attachment& a : input.info.attachments) fmt::print("  attached {}\n", attachmentLine(a));
  if (!file["tags"].is_object()) return;
  for (const auto& [key, value] : file["tags"].items())
    fmt::print("  {:<8} {}\n", printable(key), printable(value));
}

void printFrameTitles() {
  fmt::print(
      "\n frame        time  type  isovalue    vertices       quads        area      volume  parts  euler  "
      "error rms     max\n");
}

void printFrame(const FrameHeader& h, TimeBase base) {
  fmt::print(
      "{:6}  {:10.4f}  {:>4}  {:8.4g}  {:10}  {:10}  {:10.4g}  {:10.4g}  {:5}  {:5}  {:9.4f}  {:6.4f}\n",
      h.number, base.seconds(h.time), typeName(h.type), h.isovalue, h.vertices, h.faces, h.area, h.volume,
      h.components, h.euler, h.error_rms, h.error_max);
}

// Frames as they come, until the writer is done.
Status follow(const InfoOptions& options) {
  ISOREEL_ASSIGN(std::unique_ptr<ByteSource> source,
                 followFile(options.input, [] { return interrupted.load(); }));
  lavf::Sniffed bytes;
  bytes.source = std::move(source);
  Result<ForwardInput> forward = openForward(std::move(bytes), options.track);
  if (!forward) return named(forward.status(), options.input);
  StreamReader& stream = *forward->stream;
  const TimeBase base = stream.info().time_base;
  ISOREEL_ASSIGN(const Configuration configuration, readConfiguration(stream.info().configuration));
  if (!options.json) printFrameTitles();
  Json key = nullptr;
  for (;;) {
    ISOREEL_ASSIGN(const std::optional<Packet> packet, stream.next());
    if (!packet) return {};
    const FrameHeader& header = packet->header;
    if (header.back == 0) key = header.number;
    if (header.hidden()) continue;
    if (options.json) {
      fmt::print("{}\n", dumped(frameJson(header, configuration, base, key, packet->data.size())));
    } else {
      printFrame(header, base);
    }
    std::fflush(stdout);
  }
}

Json eventsJson(const Input& input) {
  Json list = Json::array();
  for (const Event& event : findEvents(*input.packets)) {
    const FrameHeader& header = input.packets->header(event.frame);
    list.push_back({{"frame", header.number},
                    {"time", input.info.time_base.seconds(header.time)},
                    {"kind", kindName(event.kind)},
                    {"before", event.before},
                    {"after", event.after}});
  }
  return list;
}

void printEvents(const Json& events) {
  fmt::print("\n frame        time  pieces\n");
  for (const Json& event : events) {
    fmt::print("{:6}  {:10.4f}  {} to {}: {}\n", event["frame"].get<std::uint64_t>(),
               event["time"].get<double>(), event["before"].get<std::uint32_t>(),
               event["after"].get<std::uint32_t>(), event["kind"].get<std::string>());
  }
  fmt::print(
      "{} where the number of pieces changes. Numbers alone do not tell a piece that splits off from one "
      "that\n"
      "appears, nor see changes that cancel out within a frame.\n",
      counted(events.size(), "frame"));
}

Status info(const InfoOptions& options) {
  if (options.follow) return follow(options);
  if (!options.plot.empty()) ISOREEL_TRY(mayWrite(options.plot, options.force));
  ISOREEL_ASSIGN(const Input input, openInput(options.input, options.track));
  Json file = fileJson(input);
  if (options.frames) {
    file["frame_list"] = Json::array();
    for (std::uint64_t i = 0; i < input.packets->frameCount(); ++i)
      file["frame_list"].push_back(frameJson(input, i));
  }
  if (options.packets) {
    ISOREEL_ASSIGN(file["packet_list"], packetList(input, options.input, options.jobs));
  }
  if (options.events) file["events"] = eventsJson(input);
  if (!options.plot.empty()) {
    const std::string name = std::filesystem::path(options.input).filename().string();
    ISOREEL_TRY(inspect::writeChart(chartOfFacts(input, name), options.plot));
  }
  if (options.json) {
    fmt::print("{}\n", dumped(file, 2));
    return {};
  }
  printFile(options.input, file, input);
  if (options.frames) {
    printFrameTitles();
    for (std::uint64_t i = 0; i < input.packets->frameCount(); ++i)
      printFrame(input.packets->header(i), input.info.time_base);
  }
  if (options.events) printEvents(file["events"]);
  if (!options.packets) return {};
  fmt::print("\n");
  printPackets(file["packet_list"]);
  return {};
}

}  // namespace

void addInfoCommand(CLI::App& app, Action& chosen) {
  CLI::App* verb = app.add_subcommand("info", "What an .isr file holds; only --packets decodes");
  const auto options = std::make_shared<InfoOptions>();
  verb->add_option("input", options->input, kInputHelp)->required();
  verb->add_flag("--frames", options->frames,
                 "The facts of every frame: time, counts, area, volume, components, error");
  CLI::Option* const packets =
      verb->add_flag("--packets", options->packets,
                     "Type, references and sections of every packet; what the blocks of P packets do");
  verb->add_option("--jobs", options->jobs, "Threads for --packets; 0: one a core")
      ->check(CLI::Range(0, 256));
  CLI::Option* const events = verb->add_flag(
      "--events", options->events,
      "Frames where pieces of surface split off or appear, merge or vanish, as far as their number tells");
  CLI::Option* const plot =
      verb->add_option("--plot", options->plot,
                       "Draw bytes by type of frame, area, volume and pieces over time into this .svg file")
          ->check(CLI::Validator(
              [](const std::string& name) { return name.ends_with(".svg") ? "" : "does not end in .svg"; },
              "FILE.svg"));
  verb->add_flag("--force", options->force, "Replace the picture when it is there already");
  verb->add_flag("--json", options->json, "One JSON object");
  verb->add_flag("--follow", options->follow,
                 "The facts of frames as they come, while the file is being written and until its writer "
                 "finishes; with --json an object a line")
      ->excludes(packets)
      ->excludes(events)
      ->excludes(plot);
  addTrackOption(*verb, options->track);
  verb->callback([options, &chosen] { chosen = [options] { return info(*options); }; });
}

}  // namespace isoreel::cli
