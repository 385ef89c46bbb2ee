// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <isoreel/codec/player.h>
#include <isoreel/inspect/distance.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "command.h"
#include "decoding.h"
#include "frame_range.h"
#include "input.h"
#include "options.h"
#include "output.h"
#include "parallel.h"
#include "progress.h"
#include "volume_input.h"

namespace isoreel::cli {
namespace {

using Json = nlohmann::ordered_json;

const std::map<std::string, CellVertices> kCellVertices{{"sheets", CellVertices::kOnePerSheet},
                                                        {"cells", CellVertices::kOne}};

struct CompareOptions {
  std::string input;
  std::string track;
  VolumeInput volumes;
  std::string frames;
  VertexPlacement placement = VertexPlacement::kQef;
  CellVertices vertices = CellVertices::kOnePerSheet;
  std::optional<std::size_t> samples;
  int jobs = 0;
  bool json = false;
};

struct CompareItem {
  std::uint64_t number = 0;
  double isovalue = 0;
  Surface decoded;
  Volume volume;
  inspect::SurfaceDistance to_volume, to_extracted;
};

/// Mean square over frames and the largest maximum.
struct Mean {
  double squares = 0, max = 0;
  std::uint64_t frames = 0;
  void add(const inspect::Distance& d) {
    squares += d.rms * d.rms;
    max = std::max(max, d.max);
    ++frames;
  }
  double rms() const { return frames == 0 ? 0 : std::sqrt(squares / static_cast<double>(frames)); }
};

/// JSON has no infinity: a surface against an empty one is null.
Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }
Json distanceJson(const inspect::Distance& d) { return {{"rms", number(d.rms)}, {"max", number(d.max)}}; }
Json bothWays(const inspect::SurfaceDistance& d) {
  Json result = distanceJson(d.symmetric);
  result["forward"] = distanceJson(d.forward);
  result["backward"] = distanceJson(d.backward);
  return result;
}

Status compare(const CompareOptions& options) {
  ISOREEL_ASSIGN(const Input input, openInput(options.input, options.track));
  ISOREEL_ASSIGN(const std::unique_ptr<io::VolumeSequence> volumes,
                 io::openVolumes(options.volumes.paths, options.volumes.options));
  warnOfDamage(input.info, options.input);
  const std::uint64_t count = input.packets->frameCount();
  if (volumes->size() != 1 && volumes->size() != count) {
    return {ErrorCode::kInvalidArgument,
            fmt::format("{} has {}, the input {}", options.input, counted(count, "frame"),
                        counted(volumes->size(), "volume"))};
  }
  ISOREEL_TRY(sameBox(*volumes, input.configuration.grid, options.input));
  const FrameRange range = parseFrames(options.frames, timelineOf(*input.packets, input.info.time_base));
  const ThreadLimit limit(options.jobs);
  const Inside inside = input.configuration.inside;
  Progress progress("compare", range.size());
  Player player(*input.packets, 0, parallelWithin);  // forward only: nothing is asked for again
  std::uint64_t next = range.begin;
  Mean volume_mean, extracted_mean;
  Json frames = Json::array();
  if (!options.json)
    fmt::print(" frame   to the volume: rms       max   to the extracted mesh: rms       max   (cells)\n");

  const auto read = [&](CompareItem& item) -> Result<bool> {
    if (next == range.end) return false;
    const std::uint64_t position = next++;
    item.number = input.packets->header(position).number;
    item.isovalue = input.packets->header(position).isovalue;
    Result<Surface> decoded = player.frame(position, decodeOptions());
    if (!decoded) return named(decoded.status(), options.input);
    item.decoded = *std::move(decoded);
    ISOREEL_ASSIGN(item.volume, volumes->read(volumes->size() == 1 ? 0 : static_cast<std::size_t>(position)));
    return true;
  };
  const auto work = [&](CompareItem& item) -> Status {
    const auto extracted = extractSurface(item.volume, item.isovalue, inside, options.placement,
                                          options.volumes.non_finite, parallelFor, options.vertices);
    if (!extracted) return extracted.status().at(fmt::format("frame {}", item.number));
    const inspect::Mesh mesh = inspect::meshOf(item.decoded, item.volume.grid);
    const auto to = [&](const inspect::Mesh& other) {
      return inspect::distance(mesh, other, options.samples.value_or(inspect::samplesFor(mesh, other)),
                               parallelFor);
    };
    item.to_extracted = to(inspect::meshOf(*extracted));
    item.to_volume = to(inspect::volumeIsosurface(item.volume, item.isovalue, inside));
    item.volume = {};
    return {};
  };
  const auto write = [&](CompareItem& item) -> Status {
    volume_mean.add(item.to_volume.symmetric);
    extracted_mean.add(item.to_extracted.symmetric);
    if (options.json) {
      frames.push_back({{"number", item.number},
                        {"volume", bothWays(item.to_volume)},
                        {"extracted", bothWays(item.to_extracted)}});
    } else {
      progress.clear();
      fmt::print("{:6}  {:19.5f}  {:8.4f}  {:27.5f}  {:8.4f}\n", item.number, item.to_volume.symmetric.rms,
                 item.to_volume.symmetric.max, item.to_extracted.symmetric.rms,
                 item.to_extracted.symmetric.max);
    }
    progress.advance();
    return {};
  };
  ISOREEL_TRY(forEachFrame<CompareItem>(options.jobs, read, work, write));
  progress.clear();
  if (interrupted) return {ErrorCode::kIo, "interrupted"};
  if (options.json) {
    fmt::print("{}\n", Json{{"frames", range.size()},
                            {"volume", distanceJson({volume_mean.rms(), volume_mean.max})},
                            {"extracted", distanceJson({extracted_mean.rms(), extracted_mean.max})},
                            {"frame_list", frames}}
                           .dump());
  } else {
    fmt::print("   all  {:19.5f}  {:8.4f}  {:27.5f}  {:8.4f}\n", volume_mean.rms(), volume_mean.max,
               extracted_mean.rms(), extracted_mean.max);
  }
  return {};
}

}  // namespace

void addCompareCommand(CLI::App& app, Action& chosen) {
  CLI::App* verb = app.add_subcommand(
      "compare",
      "Distance of each frame to its volume's isosurface and to the extracted mesh, in cells of the volume");
  const auto options = std::make_shared<CompareOptions>();
  verb->add_option("file", options->input, kInputHelp)->required();
  options->volumes.add(*verb);
  verb->add_option("--frames", options->frames, kFramesHelp);
  verb->add_option_function<std::string>(
          "--vertex",
          [options = options.get()](const std::string& text) {
            options->placement = choice("--vertex", kPlacements, text);
          },
          "How the extracted mesh places vertices")
      ->default_str("qef")
      ->type_name("qef|centroid");
  verb->add_option_function<std::string>(
          "--mesh",
          [options = options.get()](const std::string& text) {
            options->vertices = choice("--mesh", kCellVertices, text);
          },
          "Vertices of the extracted mesh: one for each sheet of the surface in a cell, or one a cell, where "
          "sheets then meet")
      ->default_str("sheets")
      ->type_name("sheets|cells");
  verb->add_option("--samples", options->samples,
                   "Sample points on each surface (default: 200000, fewer on small ones)")
      ->check(CLI::Range(1000, 100'000'000));
  verb->add_option("--jobs", options->jobs, "Threads, and frames under way at once; 0: one a core")
      ->check(CLI::Range(0, 256));
  verb->add_flag("--json", options->json, "One JSON object");
  addTrackOption(*verb, options->track);
  verb->callback([options, &chosen] { chosen = [options] { return compare(*options); }; });
}

}  // namespace isoreel::cli
