// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>

#include "command.h"
#include "copy.h"
#include "frame_range.h"
#include "input.h"
#include "metadata.h"
#include "output.h"
#include "progress.h"
#include "recode.h"
#include "shards.h"

namespace isoreel::cli {
namespace {

struct TrimOptions {
  std::string input, output;
  std::string from, to;
  std::string track;
  bool shift = false;
  bool recode = false;
  unsigned parity = 0;
  bool force = false;
  bool json = false;
};

constexpr std::int64_t kLatest = std::numeric_limits<std::int64_t>::max();

/// Half-open, in ticks of the first track's base.
struct Span {
  std::int64_t begin = 0, end = 0;
};

/// A time of one track in ticks of another, rounded up: what begins at that tick or later begins at that time
/// or later.
std::int64_t upInto(TimeBase to, std::int64_t ticks, TimeBase from) {
  std::int64_t seconds = 0;
  if (from == to || __builtin_mul_overflow(ticks, -std::int64_t{from.numerator}, &seconds)) return ticks;
  return ~to.tickAt(seconds, from.denominator) + 1;
}

/// The frames of a track that begin in the span.
FrameRange framesIn(const Input& input, const Span& span, TimeBase base) {
  const auto first = [&](std::int64_t time) {
    const std::int64_t ticks = upInto(input.info.time_base, time, base);
    const auto before =
        ticks == std::numeric_limits<std::int64_t>::min() ? std::nullopt : frameAt(*input.packets, ticks - 1);
    return before ? *before + 1 : 0;
  };
  return {first(span.begin), first(span.end)};
}

/// Those that the span touches, cut to it.
std::vector<Chapter> chaptersIn(const std::vector<Chapter>& chapters, const Span& span, std::int64_t shift) {
  std::vector<Chapter> result;
  for (const Chapter& chapter : chapters) {
    const bool marker = chapter.kind == Chapter::Kind::kMarker && chapter.length == 0;
    std::int64_t end = chapter.start;
    if (chapter.length > 0) {
      if (__builtin_add_overflow(chapter.start, chapter.length, &end)) end = span.end;
    } else if (!marker) {  // up to the next chapter
      end = span.end;
      for (const Chapter& other : chapters) {
        if (other.kind == Chapter::Kind::kChapter && other.start > chapter.start)
          end = std::min(end, other.start);
      }
    }
    if (chapter.start >= span.end || (marker ? end < span.begin : end <= span.begin)) continue;
    Chapter cut = chapter;
    cut.start = std::max(chapter.start, span.begin);
    if (chapter.length > 0)
      cut.length =
          static_cast<std::uint64_t>(std::min(end, span.end)) - static_cast<std::uint64_t>(cut.start);
    if (__builtin_add_overflow(cut.start, shift, &cut.start)) continue;  // times no file has
    result.push_back(std::move(cut));
  }
  return result;
}

Status trim(const TrimOptions& options) {
  const Stopwatch watch;
  if (options.from.empty() && options.to.empty()) throw CLI::ValidationError("--from", "or --to is required");
  ISOREEL_TRY(mayWrite(options.output, options.force));
  ISOREEL_ASSIGN(SourceFile source, openSource(options.input, options.track));
  const PacketSource& first = *source.tracks.front().packets;
  const TimeBase base = source.info().time_base;
  const FrameRange range = parseFromTo(options.from, options.to, timelineOf(first, base));
  Span span{first.header(range.begin).time, 0};
  if (range.end < first.frameCount()) {
    span.end = first.header(range.end).time;
  } else if (const FrameHeader& last = first.header(range.end - 1);
             __builtin_add_overflow(last.time, last.duration, &span.end)) {
    span.end = kLatest;
  }

  std::vector<Cut> cuts;
  std::vector<std::uint64_t> tracks;
  std::vector<TimeMap> times;
  std::vector<TrackSettings> settings;
  std::vector<Replacements> recoded;
  double moved = 0;  // at most, by coding again
  for (const Input& input : source.tracks) {
    const FrameRange frames = cuts.empty() ? range : framesIn(input, span, base);
    Result<Cut> cut = cutOf(*input.packets, frames.begin, frames.end);
    if (!cut) return named(cut.status(), options.input);
    Result<Bytes> configuration = configurationOf(input, *cut);
    if (!configuration) return named(configuration.status(), options.input);
    const TimeBase own = input.info.time_base;
    if (options.recode) {
      Result<Recoded> again = recode(*input.packets, *cut);
      if (!again) return named(again.status(), options.input);
      moved = std::max(moved, again->max);
      recoded.push_back(std::move(again->packets));
      cut->begin = cut->shown;
    }
    tracks.push_back(cuts.size());
    cuts.push_back(*cut);
    times.push_back({1, options.shift ? -std::max(upInto(own, span.begin, base), -kLatest) : 0});
    settings.push_back({own, input.info.track_name, *std::move(configuration)});
  }
  ISOREEL_ASSIGN(const std::unique_ptr<Writer> writer,
                 Writer::create(options.output, {.time_base = base,
                                                 .track_name = settings.front().name,
                                                 .configuration = settings.front().configuration,
                                                 .tags = withoutShard(source.info().tags),
                                                 .overwrite = options.force,
                                                 .options = writerOptions(options.parity)}));
  PacketCopier copier(*writer);
  const auto fill = [&]() -> Status {
    for (std::size_t t = 1; t < settings.size(); ++t) ISOREEL_TRY(writer->addTrack(settings[t]).status());
    ISOREEL_TRY(copier.copy(source, cuts, tracks, times, recoded));
    ISOREEL_TRY(copyAttachments(source, *writer));
    if (!source.info().chapters.empty())
      ISOREEL_TRY(writer->setChapters(chaptersIn(source.info().chapters, span, times.front().shift)));
    return writer->finish();
  };
  if (Status status = fill(); !status.ok()) {
    writer->discard();
    return status;
  }
  const PacketCopier::Counts& counts = copier.counts();
  std::uint64_t again = 0;
  for (const Replacements& packets : recoded) again += packets.size();
  if (options.json) {
    fmt::print("{}\n", dumped({{"frames", counts.frames},
                               {"hidden", counts.hidden},
                               {"recoded", again},
                               {"moved", moved},
                               {"bytes", writer->bytesWritten()},
                               {"seconds", watch.seconds()}}));
  } else {
    fmt::print("{}: {}, {} bytes\n", options.output, counted(counts.frames, "frame"), writer->bytesWritten());
    if (counts.hidden > 0) {
      fmt::print("  and {} that the first of them needs, not shown\n", counted(counts.hidden, "packet"));
    }
    if (again > 0)
      fmt::print("  {} coded again: vertices moved by {:.4f} cells at most\n", counted(again, "frame"),
                 moved);
  }
  return {};
}

}  // namespace

void addTrimCommand(CLI::App& app, Action& chosen) {
  CLI::App* verb = app.add_subcommand(
      "trim",
      "Copy a range of frames, packets bit for bit; what a cut inside a GOP needs is kept, and not shown");
  const auto options = std::make_shared<TrimOptions>();
  verb->add_option("input", options->input, kInputHelp)->required();
  verb->add_option("-o,--output", options->output, "The .isr file to write")->required();
  verb->add_option("--from", options->from,
                   "First frame, counted from 0; or a time with its unit (2.5s, 40ms): frames that begin "
                   "then or later")
      ->default_str("the first");
  verb->add_option("--to", options->to, "The frame, or the time, to stop in front of")
      ->default_str("the end");
  verb->add_option("--track", options->track, "Only the track of this name or id")->default_str("all");
  verb->add_flag("--shift", options->shift, "Let the first frame begin at 0 s; otherwise times stay");
  verb->add_flag(
      "--recode", options->recode,
      "Code the frames up to the first key again from their surfaces, instead of keeping what they need: "
      "the same faces, but vertices are rounded to the step once more");
  verb->add_option("--parity", options->parity,
                   "Percent of parity in the new file, for 'isoreel repair'; 0: none")
      ->check(CLI::Range(0, 100));
  verb->add_flag("--force", options->force, "Replace the output when it is there already");
  verb->add_flag("--json", options->json, "End with the totals as one JSON object");
  verb->callback([options, &chosen] { chosen = [options] { return trim(*options); }; });
}

}  // namespace isoreel::cli
