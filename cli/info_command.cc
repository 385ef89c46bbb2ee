// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <isoreel/codec/packet_header.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "command.h"
#include "input.h"
#include "metadata.h"

namespace isoreel::cli {
namespace {

struct InfoOptions {
  std::string input;
  std::string track;
  bool json = false;
  bool frames = false;
  bool packets = false;
};

const char* typeName(PacketType type) { return type == PacketType::kIntra ? "I" : "P"; }

std::string hashText(std::uint64_t hash) { return fmt::format("{:016x}", hash); }

Vec3d corner(const Grid& grid, const std::array<std::uint32_t, 3>& position) {
  return grid.world(
      Vec3d{position[0] / double{kCell}, position[1] / double{kCell}, position[2] / double{kCell}});
}

Json frameJson(const PacketSource& packets, std::uint64_t frame, const Configuration& c) {
  const FrameHeader& h = packets.header(frame);
  Json key = nullptr;  // a packet on the way to it is lost
  if (const auto entry = keyEntry(packets, frame); entry.ok()) key = packets.entryHeader(*entry).number;
  static constexpr std::array<const char*, 3> kKinds{"none", "extracted", "volume"};
  Json box = nullptr;
  if (h.faces > 0) box = {{"min", corner(c.grid, h.box_min)}, {"max", corner(c.grid, h.box_max)}};
  return {{"number", h.number},
          {"time", c.time_base.seconds(h.time)},
          {"duration", c.time_base.seconds(h.duration)},
          {"type", typeName(h.type)},
          {"key", key},
          {"isovalue", h.isovalue},
          {"vertices", h.vertices},
          {"faces", h.faces},
          {"box", box},
          {"area", h.area},
          {"volume", h.volume},
          {"components", h.components},
          {"euler", h.euler},
          {"error",
           {{"against", kKinds[static_cast<std::size_t>(h.error_kind)]},
            {"rms", h.error_rms},
            {"max", h.error_max}}},
          {"hash", hashText(h.surface_hash)}};
}

Json packetJson(const PacketHeader& header, std::size_t bytes) {
  Json sections = Json::array();
  for (const Section& s : header.sections) {
    static constexpr std::array<const char*, 5> kNames{"?", "signs", "leaves", "motion", "vertices"};
    sections.push_back({{"kind", s.kind < kNames.size() ? kNames[s.kind] : "unknown"},
                        {"level", s.level},
                        {"bytes", s.bytes}});
  }
  return {{"number", header.number},
          {"type", typeName(header.type)},
          {"bytes", bytes},
          {"references", header.references},
          {"step", header.step / double{kCell}},
          {"tangential_step", header.tangential_step / double{kCell}},
          {"sections", sections}};
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
    seconds =
        c.time_base.seconds(last.time) + c.time_base.seconds(last.duration) - c.time_base.seconds(first.time);
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
          {"time_base", {c.time_base.numerator, c.time_base.denominator}},
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
             file["seconds"].get<double>(), input.configuration.time_base.numerator,
             input.configuration.time_base.denominator);
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

void printFrames(const Input& input) {
  fmt::print(
      "\n frame        time  type  isovalue    vertices       quads        area      volume  parts  euler  "
      "error rms     max\n");
  for (std::uint64_t i = 0; i < input.packets->frameCount(); ++i) {
    const FrameHeader& h = input.packets->header(i);
    fmt::print(
        "{:6}  {:10.4f}  {:>4}  {:8.4g}  {:10}  {:10}  {:10.4g}  {:10.4g}  {:5}  {:5}  {:9.4f}  {:6.4f}\n",
        h.number, input.configuration.time_base.seconds(h.time), typeName(h.type), h.isovalue, h.vertices,
        h.faces, h.area, h.volume, h.components, h.euler, h.error_rms, h.error_max);
  }
}

Status info(const InfoOptions& options) {
  ISOREEL_ASSIGN(const Input input, openInput(options.input, options.track));
  Json file = fileJson(input);
  if (options.frames) {
    file["frame_list"] = Json::array();
    for (std::uint64_t i = 0; i < input.packets->frameCount(); ++i)
      file["frame_list"].push_back(frameJson(*input.packets, i, input.configuration));
  }
  if (options.packets) {
    file["packet_list"] = Json::array();
    for (std::uint64_t i = 0; i < input.packets->frameCount(); ++i) {
      const auto place = fmt::format("{}: frame {}", options.input, input.packets->header(i).number);
      Result<Bytes> packet = input.packets->packet(i);
      if (!packet) return named(packet.status(), options.input);
      const Result<PacketHeader> header = readPacketHeader(*packet);
      if (!header) return header.status().at(place);
      file["packet_list"].push_back(packetJson(*header, packet->size()));
    }
  }
  if (options.json) {
    fmt::print("{}\n", dumped(file, 2));
    return {};
  }
  printFile(options.input, file, input);
  if (options.frames) printFrames(input);
  if (!options.packets) return {};
  fmt::print("\n");
  for (const Json& packet : file["packet_list"]) {
    fmt::print("packet {:>5}  {}  {} bytes, step {:.6g}, tangential {:.6g}:", packet["number"].dump(),
               packet["type"].get<std::string>(), packet["bytes"].dump(), packet["step"].get<double>(),
               packet["tangential_step"].get<double>());
    for (const Json& s : packet["sections"]) {
      const bool levelled = s["kind"] == "signs" || s["kind"] == "leaves";
      fmt::print(" {}{} {}", s["kind"].get<std::string>(), levelled ? s["level"].dump() : "",
                 s["bytes"].dump());
    }
    fmt::print("\n");
  }
  return {};
}

}  // namespace

void addInfoCommand(CLI::App& app, Action& chosen) {
  CLI::App* verb = app.add_subcommand("info", "What an .isr file holds, read without decoding");
  const auto options = std::make_shared<InfoOptions>();
  verb->add_option("input", options->input, kInputHelp)->required();
  verb->add_flag("--frames", options->frames,
                 "The facts of every frame: time, counts, area, volume, components, error");
  verb->add_flag("--packets", options->packets, "Type, references and sections of every packet");
  verb->add_flag("--json", options->json, "One JSON object");
  addTrackOption(*verb, options->track);
  verb->callback([options, &chosen] { chosen = [options] { return info(*options); }; });
}

}  // namespace isoreel::cli
