// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <isoreel/codec/encoder.h>

#include <bit>
#include <cmath>
#include <filesystem>
#include <mutex>
#include <nlohmann/json.hpp>

#include "command.h"
#include "encode_target.h"
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
const std::map<std::string, Inside> kInside{{"below", Inside::kBelow}, {"above", Inside::kAbove}};

struct EncodeOptions {
  VolumeInput volumes;
  TargetOptions target;
  std::string isovalues;
  std::vector<std::string> tracks;  // NAME=ISO, where there are several
  std::optional<Inside> inside;
  std::string step = "1/16";
  std::string fps;  // "" for the volumes' own times, or else 25
  std::string times;
  std::string frames;
  Profile profile = Profile::kClassic;
  std::vector<std::string> without;
  FrameTypes frame_types = FrameTypes::kAuto;
  std::uint32_t gop = 12;
  std::uint32_t block = 8;
  std::uint32_t search = 8;
  bool registration = true;
  VertexPlacement placement = VertexPlacement::kQef;
  int jobs = 0;
  bool json = false;
  std::vector<std::string> tags;
};

/// One GOP of a track on its way through the encoder: frames [begin, end) of the volumes or isovalues.
struct EncodeItem {
  std::uint64_t begin = 0, end = 0;
  std::size_t track = 0;
  struct Frame {
    Packet packet;
    PacketSizes sizes;
  };
  std::vector<Frame> frames;
  Status status;  // why there are fewer
};

std::uint32_t stepUnits(const std::string& text) {
  const double units = parseFraction("--step", text).value() * kCell;
  if (!(units >= 1) || units > kCell) {
    throw CLI::ValidationError("--step", fmt::format("'{}' is not from 1/16384 to 1 of a cell", text));
  }
  return static_cast<std::uint32_t>(std::lround(units));
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

struct Totals {
  std::uint64_t frames = 0, predicted = 0, vertices = 0;
  PacketSizes sizes;
  double error_squares = 0, error_max = 0;
  bool measured = false;        // how far vertices moved
  nlohmann::ordered_json list;  // of frames

  void add(const Packet& packet, const PacketSizes& bytes, const std::string& track) {
    const FrameHeader& header = packet.header;
    ++frames;
    predicted += header.type == PacketType::kPredicted;
    vertices += header.vertices;
    sizes.signs += bytes.signs;
    sizes.motion += bytes.motion;
    sizes.vertices += bytes.vertices;
    measured |= header.error_kind == ErrorKind::kExtracted;
    error_squares += std::pow(static_cast<double>(header.error_rms), 2) * header.vertices;
    error_max = std::max(error_max, static_cast<double>(header.error_max));
    list.push_back({{"number", header.number},
                    {"type", header.type == PacketType::kPredicted ? "P" : "I"},
                    {"vertices", header.vertices},
                    {"bytes",
                     {{"total", packet.data.size()},
                      {"signs", bytes.signs},
                      {"motion", bytes.motion},
                      {"vertices", bytes.vertices},
                      {"other", bytes.other}}}});
    if (!track.empty()) list.back()["track"] = track;
  }
};

void printSummary(const EncodeOptions& options, const Totals& totals, std::uint64_t bytes, double seconds) {
  std::FILE* const out = options.target.output == "-" ? stderr : stdout;
  const auto share = [&](std::uint64_t part) {
    return totals.vertices == 0 ? 0.0
                                : 8.0 * static_cast<double>(part) / static_cast<double>(totals.vertices);
  };
  if (options.json) {
    const std::uint64_t other = bytes - totals.sizes.signs - totals.sizes.motion - totals.sizes.vertices;
    const nlohmann::ordered_json result{{"frames", totals.frames},
                                        {"vertices", totals.vertices},
                                        {"bytes",
                                         {{"total", bytes},
                                          {"signs", totals.sizes.signs},
                                          {"motion", totals.sizes.motion},
                                          {"vertices", totals.sizes.vertices},
                                          {"other", other}}},
                                        {"predicted_frames", totals.predicted},
                                        {"frame_list", totals.list},
                                        {"seconds", seconds}};
    fmt::print(out, "{}\n", result.dump());
    return;
  }
  fmt::print(out, "{}: {} ({} predicted), {} vertices, {} bytes in {:.2f} s\n",
             options.target.output == "-" ? "standard output" : options.target.output,
             counted(totals.frames, "frame"), totals.predicted, totals.vertices, bytes, seconds);
  const double error =
      totals.vertices == 0 ? 0.0 : std::sqrt(totals.error_squares / static_cast<double>(totals.vertices));
  fmt::print(out, "  {:.2f} bits a vertex: {:.2f} signs, {:.2f} motion, {:.2f} positions{}\n", share(bytes),
             share(totals.sizes.signs), share(totals.sizes.motion), share(totals.sizes.vertices),
             totals.measured
                 ? fmt::format("; vertices moved {:.4f} cells RMS, at most {:.4f}", error, totals.error_max)
                 : "");
}

Status encode(const EncodeOptions& options) {
  const Stopwatch watch;
  ISOREEL_TRY(EncodeTarget::mayStart(options.target));
  const std::uint32_t step = stepUnits(options.step);
  ISOREEL_ASSIGN(const std::unique_ptr<io::VolumeSequence> volumes,
                 io::openVolumes(options.volumes.paths, options.volumes.options));
  std::vector<TargetTrack> tracks;
  const std::vector<std::vector<double>> isovalues = trackIsovalues(options, *volumes, tracks);
  const std::uint64_t frames = isovalues.front().size();
  FrameTimes times = frameTimes(options, *volumes, isovalues.front().size());
  const FrameRange range = parseFrames(options.frames, {frames, times.base, [&](std::uint64_t frame) {
                                                          return times.times[static_cast<std::size_t>(frame)];
                                                        }});
  std::optional<Shard> shard;
  if (range.size() < frames && !options.target.append)
    shard = Shard{range.begin, range.end, frames, options.gop};
  const std::string tags = tagsJson(options, shard);
  EncodeTarget target;
  ISOREEL_TRY(target.open(options.target, tracks, times, static_cast<std::size_t>(range.begin)));

  EncoderSettings settings;
  settings.configuration.profile = options.profile;
  settings.configuration.inside =
      options.inside.value_or(volumes->levelSet() ? Inside::kBelow : Inside::kAbove);
  settings.configuration.grid = volumes->grid();
  settings.configuration.step = step;
  settings.configuration.time_base = times.base;
  settings.frame_types = options.frame_types;
  settings.gop = options.gop;
  settings.motion = {static_cast<std::uint32_t>(std::countr_zero(options.block)), options.search,
                     options.registration};
  for (const std::string& tool : options.without) {
    if (tool == "neighbours") settings.heights.neighbours = false;
    if (tool == "signs") settings.heights.mixed_signs = false;
    if (tool == "sheets") settings.heights.sheets = false;
    if (tool == "fit") settings.heights.fit_triangles = false;
    if (tool == "rate") settings.heights.weigh_rate = false;
  }
  settings.placement = options.placement;
  settings.non_finite = options.volumes.non_finite;
  settings.parallel = parallelFor;
  ISOREEL_ASSIGN(const Encoder probe, Encoder::create(settings));
  if (Status begun = target.begin(settings.configuration, probe.configurationRecord(), tracks, tags,
                                  !options.tags.empty());
      !begun.ok()) {
    target.giveUp(0);
    return begun;
  }
  const ThreadLimit limit(options.jobs);
  Progress progress("encode", range.size() * tracks.size());
  Totals totals;
  std::uint64_t next = range.begin;
  std::size_t next_track = 0;
  std::mutex reading;
  std::shared_ptr<const Volume> only;  // the single volume of a sequence over isovalues
  const auto volumeAt = [&](std::size_t index) -> Result<std::shared_ptr<const Volume>> {
    const std::lock_guard lock(reading);
    if (only) return only;
    ISOREEL_ASSIGN(Volume volume, volumes->read(index));
    auto shared = std::make_shared<const Volume>(std::move(volume));
    if (volumes->size() == 1) only = shared;
    return shared;
  };
  const auto encodeFrame = [&](Encoder& encoder, std::size_t track,
                               std::size_t frame) -> Result<EncodeItem::Frame> {
    const std::size_t index = volumes->size() == 1 ? 0 : frame;
    ISOREEL_ASSIGN(const std::shared_ptr<const Volume> volume, volumeAt(index));
    const std::uint64_t number = tracks[track].number + frame - range.begin;
    // The packets of a shard have the numbers that a whole encode gives them.
    const FrameTiming timing{shard ? frame : number, times.times[frame], times.durations[frame],
                             isovalues[track][frame]};
    EncodeItem::Frame result;
    Result<Packet> packet = encoder.encode(*volume, timing, &result.sizes);
    if (!packet) return packet.status().at(volumes->name(index));
    result.packet = *std::move(packet);
    result.packet.header.number = number;
    return result;
  };
  // GOPs are closed: each has an encoder of its own. They begin where those of a whole encode do. Those of
  // several tracks take turns.
  const auto begin = [&](EncodeItem& item) -> Result<bool> {
    item.begin = next;
    item.end = std::min<std::uint64_t>(next - next % options.gop + options.gop, range.end);
    item.track = next_track++;
    if (next_track == tracks.size()) {
      next_track = 0;
      next = item.end;
    }
    return item.begin < item.end;
  };
  const auto work = [&](EncodeItem& item) -> Status {
    ISOREEL_ASSIGN(Encoder encoder, Encoder::create(settings));
    for (std::uint64_t frame = item.begin; frame < item.end; ++frame) {
      Result<EncodeItem::Frame> coded =
          interrupted ? Result<EncodeItem::Frame>(ErrorCode::kIo, "interrupted")
                      : encodeFrame(encoder, item.track, static_cast<std::size_t>(frame));
      if (!coded) {
        item.status = coded.status();
        return {};
      }
      item.frames.push_back(*std::move(coded));
    }
    return {};
  };
  const auto write = [&](EncodeItem& item) -> Status {
    for (const EncodeItem::Frame& frame : item.frames) {
      ISOREEL_TRY(target.writer().write(frame.packet, tracks[item.track].id));
      totals.add(frame.packet, frame.sizes, tracks[item.track].name);
      progress.advance();
    }
    ISOREEL_TRY(target.writer().endGop());
    return item.status;
  };
  Status status = forEachFrame<EncodeItem>(options.jobs, begin, work, write);
  if (status.ok() && totals.frames < range.size() * tracks.size())
    status = Status(ErrorCode::kIo, "interrupted");
  if (!status.ok())
    return {status.error().code, std::string(status.message()) + target.giveUp(totals.frames)};
  ISOREEL_TRY(target.finish());
  progress.clear();
  printSummary(options, totals, target.bytesAdded(), watch.seconds());
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
  verb->add_option("--step", options->step, "Quantiser step of vertices, as a part of a cell");
  verb->add_option_function<std::string>(
          "--profile",
          [options = options.get()](const std::string& text) {
            options->profile = choice("--profile", kProfiles, text);
          },
          "Coding tools: those of the 2006 paper, or more (I frames only as yet: --frame-types intra)")
      ->default_str("classic")
      ->type_name("classic|main");
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
  verb->add_option("--block", options->block, "Side of the blocks that move, in cells")
      ->check(CLI::IsMember({4, 8, 16, 32}));
  verb->add_option("--search", options->search,
                   "Range of the coarse motion search around what neighbours say, in cells; 0: none")
      ->check(CLI::Range(0, 64));
  verb->add_flag("!--no-registration", options->registration,
                 "Leave motion as the coarse search finds it (to see what registration is worth)");
  verb->add_option_function<std::string>(
          "--vertex",
          [options = options.get()](const std::string& text) {
            options->placement = choice("--vertex", kPlacements, text);
          },
          "Vertex of a cell: least squares of planes, or mean of crossings")
      ->default_str("qef")
      ->type_name("qef|centroid");
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
