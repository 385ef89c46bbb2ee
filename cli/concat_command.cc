// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "command.h"
#include "copy.h"
#include "input.h"
#include "metadata.h"
#include "output.h"
#include "progress.h"
#include "shards.h"
#include "volume_input.h"

namespace isoreel::cli {
namespace {

enum class Times { kShift, kKeep };
const std::map<std::string, Times> kTimes{{"shift", Times::kShift}, {"keep", Times::kKeep}};

struct ConcatOptions {
  std::vector<std::string> inputs;
  std::string output;
  Times times = Times::kShift;
  bool shards = true;
  unsigned parity = 0;
  bool force = false;
  bool json = false;
};

/// The files in the order in which they are joined.
struct Join {
  std::vector<SourceFile> files;
  std::vector<TrackSettings> tracks;
  std::string tags;
  bool shards = false;
};

bool areShards(const std::vector<SourceFile>& files) {
  return std::all_of(files.begin(), files.end(),
                     [](const SourceFile& file) { return shardOf(file.info().tags).has_value(); });
}

/// What keeps a shard from being a part of the same encode as the first; "" when nothing does.
std::string strange(const SourceFile& file, const Shard& shard, const SourceFile& first, const Shard& other) {
  const FileInfo &info = file.info(), &wanted = first.info();
  const std::uint64_t frames = file.tracks.front().packets->frameCount();
  if (frames != shard.end - shard.begin) {
    return fmt::format("holds {} of the frames {}:{} that it was made for", frames, shard.begin, shard.end);
  }
  const std::string differs = " is not that of " + first.path;
  if (shard.frames != other.frames) return "the number of frames in all" + differs;
  if (shard.gop != other.gop) return "the length of GOPs" + differs;
  if (info.configuration != wanted.configuration) return "a setting" + differs;
  if (info.time_base != wanted.time_base) return "the time base" + differs;
  return withoutShard(info.tags) == withoutShard(wanted.tags) ? "" : "a tag" + differs;
}

Status orderShards(std::vector<SourceFile>& files) {
  std::vector<Shard> shards;
  std::vector<std::string> names;
  names.reserve(files.size());
  for (const SourceFile& file : files) {
    shards.push_back(*shardOf(file.info().tags));
    names.push_back(file.path);
    if (const std::string why = strange(file, shards.back(), files.front(), shards.front()); !why.empty()) {
      return {ErrorCode::kInvalidArgument,
              fmt::format("{}: {} (--no-shards joins them as they are)", file.path, why)};
    }
  }
  ISOREEL_ASSIGN(const std::vector<std::size_t> order, orderOfShards(shards, names));
  std::vector<SourceFile> sorted;
  sorted.reserve(files.size());
  for (const std::size_t i : order) sorted.push_back(std::move(files[i]));
  files = std::move(sorted);
  return {};
}

/// The union; where files differ in a tag, the first that has it counts.
std::string joinedTags(const std::vector<SourceFile>& files) {
  if (std::all_of(files.begin(), files.end(),
                  [&](const SourceFile& file) { return file.info().tags == files.front().info().tags; })) {
    return withoutShard(files.front().info().tags);
  }
  Json joined = Json::object();
  for (const SourceFile& file : files) {
    const Json tags = parsedTags(withoutShard(file.info().tags));
    if (!tags.is_object()) continue;
    for (const auto& [key, value] : tags.items()) {
      if (!joined.contains(key)) joined[key] = value;
    }
  }
  return dumped(joined);
}

/// Grids, the inside rule and the names of tracks must agree with the first file's.
Status checkFits(const SourceFile& file, const SourceFile& first) {
  const auto differs = [&](const std::string& what) {
    return Status(ErrorCode::kInvalidArgument,
                  fmt::format("{}: {} differs from that of {}", file.path, what, first.path));
  };
  if (file.tracks.size() != first.tracks.size()) return differs("the number of tracks");
  for (std::size_t t = 0; t < first.tracks.size(); ++t) {
    const FileInfo &info = file.tracks[t].info, &other = first.tracks[t].info;
    if (info.track_name != other.track_name) return differs(fmt::format("the name of track {}", t));
    Result<Configuration> own = readConfiguration(info.configuration),
                          wanted = readConfiguration(other.configuration);
    if (!own) return named(own.status(), file.path);
    if (!wanted) return named(wanted.status(), first.path);
    if (own->grid.nodes != wanted->grid.nodes) return differs("the size of the grid");
    if (!(own->grid == wanted->grid)) return differs("the place of the grid in the world");
    if (own->inside != wanted->inside) return differs("the side of the isovalue that is inside");
  }
  return {};
}

Result<Join> prepare(const ConcatOptions& options) {
  Join join;
  for (const std::string& path : options.inputs) {
    ISOREEL_ASSIGN(SourceFile file, openSource(path));
    join.files.push_back(std::move(file));
  }
  for (const SourceFile& file : join.files) ISOREEL_TRY(checkFits(file, join.files.front()));
  join.shards = options.shards && areShards(join.files);
  if (join.shards) ISOREEL_TRY(orderShards(join.files));
  join.tags = joinedTags(join.files);
  for (std::size_t t = 0; t < join.files.front().tracks.size(); ++t) {
    const FileInfo& info = join.files.front().tracks[t].info;
    TrackSettings track{info.time_base, info.track_name, info.configuration};
    for (const SourceFile& file : join.files) {
      const auto base = commonBase(track.time_base, file.tracks[t].info.time_base);
      if (!base) {
        return {
            ErrorCode::kLimit,
            fmt::format("{}: its time base and those before it have no common one of 32 bits", file.path)};
      }
      track.time_base = *base;
    }
    join.tracks.push_back(std::move(track));
  }
  return join;
}

/// Joins them, one after the other.
class Joiner {
 public:
  Joiner(const Join& join, Writer& writer) : join_(join), writer_(writer), copier_(writer) {}

  Status add(SourceFile& file, Times times) {
    std::vector<Cut> cuts;
    std::vector<std::uint64_t> tracks;
    std::vector<TimeMap> maps;
    for (std::size_t t = 0; t < file.tracks.size(); ++t) {
      const Input& input = file.tracks[t];
      cuts.push_back(wholeTrack(*input.packets));
      tracks.push_back(t);
      maps.push_back({ticksOf(join_.tracks[t].time_base, input.info.time_base), 0});
    }
    if (times == Times::kShift) ISOREEL_TRY(shift(*file.tracks.front().packets, maps).at(file.path));
    ISOREEL_TRY(copier_.copy(file, cuts, tracks, maps));
    for (Chapter chapter : file.info().chapters) {
      FrameHeader moved;  // what a time is moved by
      moved.time = chapter.start;
      moved.duration = chapter.length;
      ISOREEL_TRY(maps.front().apply(moved).at(file.path));
      chapter.start = moved.time;
      chapter.length = moved.duration;
      chapters_.push_back(std::move(chapter));
    }
    return {};
  }
  Status finish() {
    if (!chapters_.empty()) ISOREEL_TRY(writer_.setChapters(std::move(chapters_)));
    return writer_.finish();
  }
  const PacketCopier::Counts& counts() const { return copier_.counts(); }

 private:
  /// So that the first track's first frame begins where the last one ended; the other tracks as far.
  Status shift(const PacketSource& packets, std::vector<TimeMap>& maps) const {
    const FrameHeader* last = writer_.lastFrame(0);
    if (last == nullptr || packets.frameCount() == 0) return {};
    FrameHeader first = packets.header(0);
    ISOREEL_TRY(maps.front().apply(first));
    std::int64_t end = 0, by = 0;
    const TimeBase base = join_.tracks.front().time_base;
    std::int64_t seconds = 0;
    if (__builtin_add_overflow(last->time, last->duration, &end) ||
        __builtin_sub_overflow(end, first.time, &by) ||
        __builtin_mul_overflow(by, std::int64_t{base.numerator}, &seconds)) {
      return {ErrorCode::kLimit, "its times in the new file are beyond 63 bits"};
    }
    for (std::size_t t = 0; t < maps.size(); ++t) {
      const TimeBase own = join_.tracks[t].time_base;
      maps[t].shift = own == base ? by : own.tickAt(seconds, base.denominator);
    }
    return {};
  }

  const Join& join_;
  Writer& writer_;
  PacketCopier copier_;
  std::vector<Chapter> chapters_;
};

Status concat(const ConcatOptions& options) {
  const Stopwatch watch;
  ISOREEL_TRY(mayWrite(options.output, options.force));
  ISOREEL_ASSIGN(Join join, prepare(options));
  ISOREEL_ASSIGN(const std::unique_ptr<Writer> writer,
                 Writer::create(options.output, {.time_base = join.tracks.front().time_base,
                                                 .track_name = join.tracks.front().name,
                                                 .configuration = join.tracks.front().configuration,
                                                 .tags = join.tags,
                                                 .overwrite = options.force,
                                                 .options = writerOptions(options.parity)}));
  Joiner joiner(join, *writer);
  Progress progress("concat", join.files.size());
  const auto fill = [&]() -> Status {
    for (std::size_t t = 1; t < join.tracks.size(); ++t)
      ISOREEL_TRY(writer->addTrack(join.tracks[t]).status());
    for (SourceFile& file : join.files) {
      ISOREEL_TRY(joiner.add(file, join.shards ? Times::kKeep : options.times));
      progress.advance();
    }
    for (SourceFile& file : join.files) ISOREEL_TRY(copyAttachments(file, *writer));
    return joiner.finish();
  };
  if (Status status = fill(); !status.ok()) {
    writer->discard();
    return status;
  }
  progress.clear();
  const PacketCopier::Counts& counts = joiner.counts();
  if (options.json) {
    fmt::print("{}\n", dumped({{"files", join.files.size()},
                               {"shards", join.shards},
                               {"frames", counts.frames},
                               {"hidden", counts.hidden},
                               {"bytes", writer->bytesWritten()},
                               {"seconds", watch.seconds()}}));
    return {};
  }
  fmt::print("{}: {} of {}, {} bytes{}\n", options.output, counted(counts.frames, "frame"),
             counted(join.files.size(), join.shards ? "shard" : "file"), writer->bytesWritten(),
             join.shards ? ", those of a single encode" : "");
  if (counts.hidden > 0)
    fmt::print("  and {} that frames behind cuts need, not shown\n", counted(counts.hidden, "packet"));
  return {};
}

}  // namespace

void addConcatCommand(CLI::App& app, Action& chosen) {
  CLI::App* verb = app.add_subcommand(
      "concat",
      "Join files of one grid, packets bit for bit; shards of one encode (encode --frames) become the "
      "very file that a single encode gives, in whatever order they are named");
  const auto options = std::make_shared<ConcatOptions>();
  verb->add_option("inputs", options->inputs, "The files, in order: each as other verbs read it")
      ->required()
      ->default_str("");
  verb->add_option("-o,--output", options->output, "The .isr file to write")->required();
  verb->add_option_function<std::string>(
          "--times",
          [options = options.get()](const std::string& text) {
            options->times = choice("--times", kTimes, text);
          },
          "Times of the second file and those behind it: so that each begins where the one before it ends, "
          "or "
          "as they are, and then they must rise")
      ->default_str("shift")
      ->type_name("shift|keep");
  verb->add_flag("!--no-shards", options->shards, "Join shards like any other files");
  verb->add_option("--parity", options->parity,
                   "Percent of parity in the new file, for 'isoreel repair'; 0: none")
      ->check(CLI::Range(0, 100));
  verb->add_flag("--force", options->force, "Replace the output when it is there already");
  verb->add_flag("--json", options->json, "End with the totals as one JSON object");
  verb->callback([options, &chosen] { chosen = [options] { return concat(*options); }; });
}

}  // namespace isoreel::cli
