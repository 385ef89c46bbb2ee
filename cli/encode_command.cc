// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <isoreel/codec/encoder.h>

#include <bit>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "command.h"
#include "encode_pass.h"
#include "encode_target.h"
#include "facts.h"
#include "frame_range.h"
#include "metadata.h"
#include "options.h"
#include "output.h"
#include "parallel.h"
#include "progress.h"
#include "shards.h"
#include "volume_input.h"

namespace isoreel::cli {
namespace {

const std::map<std::string, FrameTypes> kFrameTypes{{"auto", FrameTypes::kAuto},
                                                    {"intra", FrameTypes::kIntra}};
const std::map<std::string, Profile> kProfiles{{"classic", Profile::kClassic}, {"main", Profile::kMain}};
const std::map<std::string, Fit> kFits{{"volume", Fit::kVolume}, {"extracted", Fit::kExtracted}};
const std::map<std::string, Preset> kPresets{
    {"fast", Preset::kFast}, {"default", Preset::kDefault}, {"best", Preset::kBest}};
const std::map<std::string, Inside> kInside{{"below", Inside::kBelow}, {"above", Inside::kAbove}};

struct EncodeOptions {
  VolumeInput volumes;
  TargetOptions target;
  std::string isovalues;
  std::vector<std::string> tracks;  // NAME=ISO, where there are several
  std::optional<Inside> inside;
  std::string step = "1/16";
  std::string cell = "1";  // side of a coded cell in cells of the volumes, or auto
  double max_error = 0;    // cells RMS; 0: the step says
  std::uint64_t size = 0;  // bytes; 0: the step says
  bool measure = false;
  std::string fps;  // "" for the volumes' own times, or else 25
  std::string times;
  std::string frames;
  Profile profile = Profile::kMain;
  std::vector<std::string> without;
  FrameTypes frame_types = FrameTypes::kAuto;
  std::uint32_t gop = 12;
  Preset preset = Preset::kDefault;
  std::optional<std::uint32_t> block, search;
  bool registration = true;
  VertexPlacement placement = VertexPlacement::kQef;
  Fit fit = Fit::kVolume;
  std::uint32_t slices = Slices{}.most;
  int jobs = 0;
  bool json = false;
  std::vector<std::string> tags;
};

std::uint32_t stepUnits(const std::string& text) {
  const double units = parseFraction("--step", text).value() * kCell;
  if (!(units >= 1) || units > kCell) {
    throw CLI::ValidationError("--step", fmt::format("'{}' is not from 1/16384 to 1 of a cell", text));
  }
  return static_cast<std::uint32_t>(std::lround(units));
}

/// What --cell says; 1 for auto, to begin with.
double cellSide(const EncodeOptions& options) {
  if (options.cell == "auto") {
    if (options.max_error == 0) throw CLI::ValidationError("--cell", "auto goes with --max-error");
    if (options.target.append) throw CLI::ValidationError("--cell", "--append: the grid is that of the file");
    return 1;
  }
  const std::vector<double> values = parseNumbers("--cell", options.cell);
  if (values.size() != 1 || !(values[0] >= 1 && values[0] <= kMaxCell)) {
    throw CLI::ValidationError("--cell",
                               fmt::format("'{}' is neither auto nor from 1 to {}", options.cell, kMaxCell));
  }
  return values[0];
}

/// The isovalue of every frame: one for all, one each, or one volume at several.
std::vector<double> frameIsovalues(const std::string& option, const std::string& text,
                                   const io::VolumeSequence& volumes) {
  if (text.empty() && !volumes.levelSet()) {
    throw CLI::ValidationError(option, "is required: these volumes do not say that they are level sets");
  }
  std::vector<double> values = text.empty() ? std::vector<double>{0.0} : parseNumbers(option, text);
  if (values.size() == 1) values.assign(volumes.size(), values[0]);
  if (values.size() != volumes.size() && volumes.size() != 1) {
    throw CLI::ValidationError(
        option, fmt::format("{} values for {} volumes: give one, one each, or several for a single volume",
                            values.size(), volumes.size()));
  }
  return values;
}

/// The tracks that are asked for, and the isovalues of each one's frames.
std::vector<std::vector<double>> trackIsovalues(const EncodeOptions& options,
                                                const io::VolumeSequence& volumes,
                                                std::vector<TargetTrack>& tracks) {
  if (options.tracks.empty()) {
    tracks.resize(1);
    return {frameIsovalues("--iso", options.isovalues, volumes)};
  }
  std::vector<std::vector<double>> isovalues;
  for (const std::string& text : options.tracks) {
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0)
      throw CLI::ValidationError("--track", fmt::format("'{}' is not NAME=ISO", text));
    TargetTrack& track = tracks.emplace_back();
    track.name = text.substr(0, equals);
    track.id = tracks.size() - 1;
    isovalues.push_back(frameIsovalues("--track", text.substr(equals + 1), volumes));
    if (isovalues.back().size() != isovalues.front().size())
      throw CLI::ValidationError("--track", "tracks have different numbers of frames");
  }
  return isovalues;
}

/// Times as --times, --fps or the volumes' files say, in that order.
FrameTimes frameTimes(const EncodeOptions& options, const io::VolumeSequence& volumes, std::size_t frames) {
  if (!options.times.empty()) return timesFromFile(options.times, frames);
  if (!options.fps.empty()) return constantRate(options.fps, frames);
  std::vector<double> seconds;
  for (std::size_t i = 0; i < volumes.size() && volumes.size() == frames; ++i) {
    if (const auto time = volumes.time(i)) seconds.push_back(*time);
  }
  const auto times = seconds.size() == frames ? timesInSeconds(seconds) : std::nullopt;
  return times ? *times : constantRate("25", frames);
}

std::string tagsJson(const EncodeOptions& options, const std::optional<Shard>& shard) {
  Json tags;
  tags["software"] = "isoreel " ISOREEL_VERSION;
  std::vector<std::string> names;
  for (const std::string& path : options.volumes.paths)
    names.push_back(std::filesystem::path(path).filename().string());
  tags["source"] = names.size() == 1
                       ? names[0]
                       : fmt::format("{} to {} ({} files)", names.front(), names.back(), names.size());
  for (const std::string& tag : options.tags) {
    const std::size_t equals = tag.find('=');
    if (equals == std::string::npos || equals == 0)
      throw CLI::ValidationError("--tag", fmt::format("'{}' is not KEY=VALUE", tag));
    tags[tag.substr(0, equals)] = tag.substr(equals + 1);
  }
  if (shard) tags["shard"] = shardTag(*shard);
  return dumped(tags);
}

void printSummary(const EncodeOptions& options, double cell, const EncodeTotals& totals, std::uint64_t bytes,
                  double seconds) {
  std::FILE* const out = options.target.output == "-" ? stderr : stdout;
  const auto share = [&](std::uint64_t part) {
    return totals.vertices == 0 ? 0.0
                                : 8.0 * static_cast<double>(part) / static_cast<double>(totals.vertices);
  };
  if (options.json) {
    const std::uint64_t other = bytes - totals.sizes.signs - totals.sizes.motion - totals.sizes.vertices;
    nlohmann::ordered_json result{{"frames", totals.frames},
                                  {"vertices", totals.vertices},
                                  {"bytes",
                                   {{"total", bytes},
                                    {"signs", totals.sizes.signs},
                                    {"motion", totals.sizes.motion},
                                    {"vertices", totals.sizes.vertices},
                                    {"other", other}}},
                                  {"predicted_frames", totals.predicted},
                                  {"cell", cell},
                                  {"frame_list", totals.list},
                                  {"seconds", seconds}};
    if (totals.error_kind != ErrorKind::kNone)
      result["error"] = errorJson(totals.error_kind, totals.errorRms(), totals.error_max);
    fmt::print(out, "{}\n", result.dump());
    return;
  }
  fmt::print(out, "{}: {} ({} predicted), {} vertices, {} bytes in {:.2f} s\n",
             options.target.output == "-" ? "standard output" : options.target.output,
             counted(totals.frames, "frame"), totals.predicted, totals.vertices, bytes, seconds);
  std::string error;
  if (totals.error_kind != ErrorKind::kNone) {
    error = fmt::format(
        "; {} {:.4f} {} RMS, at most {:.4f}",
        totals.error_kind == ErrorKind::kVolume ? "from the volumes' isosurfaces" : "vertices moved",
        totals.errorRms(), cell == 1 ? "cells" : "coded cells", totals.error_max);
  }
  if (cell != 1) fmt::print(out, "  coded cells have {:g} times the side of the volumes'\n", cell);
  fmt::print(out, "  {:.2f} bits a vertex: {:.2f} signs, {:.2f} motion, {:.2f} positions{}\n", share(bytes),
             share(totals.sizes.signs), share(totals.sizes.motion), share(totals.sizes.vertices), error);
}

EncoderSettings settingsOf(const EncodeOptions& options, const EncodeJob& job) {
  EncoderSettings settings;
  settings.configuration.profile = options.profile;
  settings.configuration.inside =
      options.inside.value_or(job.volumes->levelSet() ? Inside::kBelow : Inside::kAbove);
  settings.configuration.grid = job.volumes->grid();
  settings.configuration.step = stepUnits(options.step);
  settings.cell = cellSide(options);
  settings.configuration.time_base = job.times.base;
  settings.frame_types = options.frame_types;
  settings.gop = options.gop;
  settings.configuration.slices.most = options.slices;
  usePreset(options.preset, settings);
  if (options.block)
    settings.motion.block_log2 = static_cast<std::uint32_t>(std::countr_zero(*options.block));
  if (options.search) settings.motion.range = *options.search;
  settings.motion.registration = options.registration;
  for (const std::string& tool : options.without) {
    if (tool == "neighbours") settings.heights.neighbours = false;
    if (tool == "signs") settings.heights.mixed_signs = false;
    if (tool == "sheets") settings.heights.sheets = false;
    if (tool == "fit") settings.heights.fit_triangles = false;
    if (tool == "rate") settings.heights.weigh_rate = false;
  }
  settings.heights.fit = options.fit;
  settings.placement = options.placement;
  settings.non_finite = options.volumes.non_finite;
  settings.parallel = parallelWithin;
  return settings;
}

Status encode(const EncodeOptions& options) {
  const Stopwatch watch;
  ISOREEL_TRY(EncodeTarget::mayStart(options.target));
  EncodeJob job;
  ISOREEL_ASSIGN(job.volumes, io::openVolumes(options.volumes.paths, options.volumes.options));
  job.isovalues = trackIsovalues(options, *job.volumes, job.tracks);
  const std::uint64_t frames = job.isovalues.front().size();
  job.times = frameTimes(options, *job.volumes, job.isovalues.front().size());
  job.range = parseFrames(options.frames, {frames, job.times.base, [&](std::uint64_t frame) {
                                             return job.times.times[static_cast<std::size_t>(frame)];
                                           }});
  std::optional<Shard> shard;
  if (job.range.size() < frames && !options.target.append)
    shard = Shard{job.range.begin, job.range.end, frames, options.gop};
  job.shard = shard.has_value();
  job.error = {options.measure, options.max_error > 0 ? std::optional(options.max_error) : std::nullopt};
  job.jobs = options.jobs;
  EncodeTarget target(options.target);
  ISOREEL_TRY(target.open(job.tracks, job.times, static_cast<std::size_t>(job.range.begin)));
  job.settings = settingsOf(options, job);
  const ThreadLimit limit(options.jobs);
  const EncodePass pass{options.target, job, tagsJson(options, shard), !options.tags.empty()};
  std::uint32_t step = job.settings.configuration.step;
  if (options.size > 0) {
    job.error.measure = false;  // its results are as long whatever they are
    ISOREEL_ASSIGN(step, stepForSize(pass, options.size));
    job.error.measure = options.measure;
  }
  if (options.cell == "auto") {
    ISOREEL_ASSIGN(job.settings.cell, cellForError(pass, job));
  }
  EncodeTotals totals;
  ISOREEL_TRY(pass.run(target, step, "encode", totals));
  printSummary(options, job.settings.cell, totals, target.bytesAdded(), watch.seconds());
  return {};
}

}  // namespace

void addEncodeCommand(CLI::App& app, Action& chosen) {
  CLI::App* verb = app.add_subcommand("encode", "Code the isosurfaces of volumes into an .isr file");
  const auto options = std::make_shared<EncodeOptions>();
  options->volumes.add(*verb);
  verb->add_option("-o,--output", options->target.output,
                   "The .isr file to write; - for standard output, where it can be played as it comes")
      ->required();
  CLI::Option* iso = verb->add_option("--iso", options->isovalues,
                                      "Isovalue, or one a frame: V,V,… (default: 0 for level sets)");
  verb->add_option("--track", options->tracks,
                   "NAME=ISO, once for each of several isosurfaces of the same volumes: tracks of one file")
      ->take_all()
      ->default_str("")
      ->excludes(iso);
  verb->add_flag(
      "--append", options->target.append,
      "Continue the output, a finished file (or one whose writer was killed), behind its last frame");
  verb->add_option("--sync", options->target.sync,
                   "When to flush to disk what survives a loss of power: at the end, or after each GOP")
      ->check(CLI::IsMember({"none", "gop"}));
  verb->add_option(
          "--parity", options->target.parity,
          "Percent of parity, by which 'isoreel repair' restores damage of up to that part of a GOP; 0: none")
      ->check(CLI::Range(0, 100));
  verb->add_option_function<std::string>(
          "--inside",
          [options = options.get()](const std::string& text) {
            options->inside = choice("--inside", kInside, text);
          },
          "Side of the isovalue that is inside (default: below for level sets, else above)")
      ->type_name("below|above");
  CLI::Option* step =
      verb->add_option("--step", options->step, "Quantiser step of vertices, as a part of a cell");
  CLI::Option* size =
      verb->add_option("--size", options->size,
                       "Length of the file to make, in bytes (or 300kB, 20MB, 4MiB): the step that fills "
                       "it to 98 % at least is looked for, in several encodes")
          ->transform(CLI::AsSizeValue(true))
          ->type_name("BYTES")
          ->default_str("")
          ->excludes("--append")
          ->excludes(step);
  verb->add_option(
          "--cell", options->cell,
          "Side of a coded cell, in cells of the volumes, 1 to 64: a coarser lattice takes fewer bytes where "
          "large distances will do; auto: the one that does in the first GOP, with --max-error")
      ->type_name("SIDE|auto");
  verb->add_option("--max-error", options->max_error,
                   "Cells (of the volumes) RMS that no frame may be further from its volume's isosurface (as "
                   "`compare` finds it): "
                   "each GOP gets the largest step that keeps to it")
      ->check(CLI::PositiveNumber)
      ->default_str("")
      ->excludes(step)
      ->excludes(size);
  verb->add_flag(
      "--measure", options->measure,
      "Measure each frame's distance to its volume's isosurface, as `compare` does, and keep it in "
      "the frame's header");
  verb->add_option_function<std::string>(
          "--profile",
          [options = options.get()](const std::string& text) {
            options->profile = choice("--profile", kProfiles, text);
          },
          "Coding tools: all there are, or those of the 2006 paper")
      ->default_str("main")
      ->type_name("main|classic");
  verb->add_option_function<std::string>(
          "--preset",
          [options = options.get()](const std::string& text) {
            options->preset = choice("--preset", kPresets, text);
          },
          "Time for bytes: fast does not search far nor look closely; best tries blocks of 8, 16 and 32 "
          "cells")
      ->default_str("default")
      ->type_name("fast|default|best");
  verb->add_option(
          "--without", options->without,
          "Leave out tools of profile main, to see what they are worth: neighbours, signs, sheets, fit, rate")
      ->check(CLI::IsMember({"neighbours", "signs", "sheets", "fit", "rate"}))
      ->delimiter(',')
      ->default_str("");
  verb->add_option_function<std::string>(
          "--frame-types",
          [options = options.get()](const std::string& text) {
            options->frame_types = choice("--frame-types", kFrameTypes, text);
          },
          "Predict frames from those before them where that is smaller, or none")
      ->default_str("auto")
      ->type_name("auto|intra");
  verb->add_option("--gop", options->gop, "Frames from one that decodes alone to the next, at most")
      ->check(CLI::Range(1, 1 << 20));
  verb->add_option("--block", options->block,
                   "Side of the blocks that move, in cells (default: 8, or as the preset says)")
      ->check(CLI::IsMember({4, 8, 16, 32}));
  verb->add_option("--search", options->search,
                   "Range of the coarse motion search around what neighbours say, in cells; 0: none "
                   "(default: 8, or as the preset says)")
      ->check(CLI::Range(0, 64));
  verb->add_flag("!--no-registration", options->registration,
                 "Leave motion as the coarse search finds it (to see what registration is worth)");
  verb->add_option_function<std::string>(
          "--vertex",
          [options = options.get()](const std::string& text) {
            options->placement = choice("--vertex", kPlacements, text);
          },
          "The extractor's vertex of a cell, which counts for --profile classic and --fit extracted: least "
          "squares of planes, or mean of crossings")
      ->default_str("qef")
      ->type_name("qef|centroid");
  verb->add_option_function<std::string>(
          "--fit",
          [options = options.get()](const std::string& text) { options->fit = choice("--fit", kFits, text); },
          "What profile main brings surfaces close to: the volume's isosurface, or the extractor's mesh")
      ->default_str("volume")
      ->type_name("volume|extracted");
  verb->add_option("--slices", options->slices,
                   "Parts that large frames are coded in, so that as many threads can decode one frame")
      ->check(CLI::Range(1u, Slices::kMost));
  CLI::Option* fps =
      verb->add_option("--fps", options->fps,
                       "Frames a second: 25, 30000/1001 (without it, times in the volume files "
                       "come first)")
          ->default_str("25");
  verb->add_option("--times", options->times, "File with the time of each frame in seconds, one a line")
      ->excludes(fps);
  verb->add_option("--frames", options->frames,
                   std::string(kFramesHelp) +
                       "; shards of one encode, which concat joins into its very bytes, begin and end at "
                       "multiples of --gop");
  verb->add_option("--tag", options->tags, "Metadata KEY=VALUE; may be repeated")
      ->take_all()
      ->default_str("");
  verb->add_option("--jobs", options->jobs, "Threads, and frames under way at once; 0: one a core")
      ->check(CLI::Range(0, 256));
  verb->add_flag("--force", options->target.force, "Replace the output when it is there already");
  verb->add_flag("--json", options->json, "End with the totals as one JSON object");
  verb->callback([options, &chosen] { chosen = [options] { return encode(*options); }; });
}

}  // namespace isoreel::cli
