// SPDX-License-Identifier: BSD-3-Clause
#include "encode_target.h"

#include <fmt/format.h>
#include <isoreel/container/parity.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <filesystem>
#include <numeric>

#include "metadata.h"
#include "output.h"

namespace isoreel::cli {
namespace {

Status differs(const std::string& file, const std::string& what) {
  return {ErrorCode::kInvalidArgument,
          fmt::format("{}: {}, so the file cannot be continued with this", file, what)};
}

/// `times` in ticks of `base`, exactly.
Status convert(FrameTimes& times, const TimeBase& base, const std::string& file) {
  if (times.base == base) return {};
  std::uint64_t up = std::uint64_t{times.base.numerator} * base.denominator;
  std::uint64_t down = std::uint64_t{times.base.denominator} * base.numerator;
  const std::uint64_t common = std::gcd(up, down);
  up /= common;
  down /= common;
  const auto scale = [&](auto& value) {
    const auto divisor = static_cast<std::int64_t>(down);
    std::int64_t ticks = static_cast<std::int64_t>(value);
    if (divisor <= 0 || ticks % divisor != 0) return false;
    if (__builtin_mul_overflow(ticks / divisor, static_cast<std::int64_t>(up), &ticks)) return false;
    value = static_cast<std::remove_reference_t<decltype(value)>>(ticks);
    return true;
  };
  bool exact = true;
  for (auto& time : times.times) exact = exact && scale(time);
  for (auto& duration : times.durations) exact = exact && scale(duration);
  if (!exact) {
    return differs(file, fmt::format("its time base is {}/{} s, in which these times are no whole numbers",
                                     base.numerator, base.denominator));
  }
  times.base = base;
  return {};
}

}  // namespace

Status EncodeTarget::mayStart(const TargetOptions& options) {
  if (options.output.empty()) throw CLI::ValidationError("--output", "is empty");
  if (options.output == "-") {
    if (options.append) throw CLI::ValidationError("--append", "standard output cannot be continued");
    if (isatty(STDOUT_FILENO) != 0) throw CLI::ValidationError("--output", "standard output is a terminal");
    std::signal(SIGPIPE, SIG_IGN);  // a reader that goes away is an error that is told
    return {};
  }
  if (options.append) return {};
  ISOREEL_TRY(mayWrite(options.output, options.force));
  const std::string part = options.output + ".part";
  std::error_code ignored;
  if (options.force || !std::filesystem::exists(part, ignored)) return {};
  return {ErrorCode::kIo,
          part + ": is there already, of an encode that is at work or did not finish (--force replaces it)"};
}

WriterOptions EncodeTarget::writerOptions() const {
  WriterOptions result;
  result.sync = options_.sync == "gop";
  if (options_.parity > 0) result.parity = reedSolomonParity(options_.parity);
  return result;
}

Status EncodeTarget::open(std::vector<TargetTrack>& tracks, FrameTimes& times, std::size_t first) {
  if (!options_.append) return {};
  ISOREEL_ASSIGN(writer_, Writer::append(options_.output, writerOptions()));
  start_ = writer_->bytesWritten();
  const FileInfo& info = writer_->info();
  if (info.tracks.size() != tracks.size())
    return differs(options_.output, "it has " + counted(info.tracks.size(), "track"));
  std::int64_t due = std::numeric_limits<std::int64_t>::min(), last = due;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    TargetTrack& track = tracks[i];
    const auto same = std::find_if(info.tracks.begin(), info.tracks.end(), [&](const TrackInfo& t) {
      return t.name == track.name || (tracks.size() == 1 && track.name.empty());
    });
    if (same == info.tracks.end()) return differs(options_.output, "it has no track '" + track.name + "'");
    track.id = same->id;
    track.number = same->frames;
    ISOREEL_TRY(convert(times, same->time_base, options_.output));
    if (const FrameHeader* header = writer_->lastFrame(track.id)) {
      last = std::max(last, header->time);
      due = std::max(
          due, header->time + static_cast<std::int64_t>(std::min<std::uint64_t>(header->duration, 1u << 30)));
    }
  }
  if (first < times.times.size() && times.times[first] <= last) {
    const std::int64_t shift = due - times.times[first];
    for (std::int64_t& time : times.times) time += shift;
  }
  return {};
}

Status EncodeTarget::begin(const Configuration& configuration, const Bytes& record,
                           const std::vector<TargetTrack>& tracks, const std::string& tags, bool tags_given,
                           std::unique_ptr<ByteSink> instead) {
  if (writer_) {
    for (const TrackInfo& track : writer_->info().tracks) {
      ISOREEL_ASSIGN(const Configuration there, readConfiguration(track.configuration));
      if (!(there.grid == configuration.grid)) return differs(options_.output, "it has another grid");
      if (there.inside != configuration.inside)
        return differs(options_.output, "its surfaces have the other side inside");
    }
    if (!tags_given) return {};
    Json merged = tagsOf(writer_->info());
    if (!merged.is_object()) merged = Json::object();
    merged.update(Json::parse(tags));
    return writer_->setTags(dumped(merged));
  }
  WriterSettings settings;
  settings.time_base = configuration.time_base;
  settings.track_name = tracks.front().name;
  settings.configuration = record;
  settings.tags = tags;
  settings.overwrite = options_.force;
  settings.options = writerOptions();
  if (instead != nullptr || options_.output == "-") {
    if (instead == nullptr) instead = openStandardOutput();
    ISOREEL_ASSIGN(writer_, Writer::create(std::move(instead), std::move(settings)));
  } else {
    ISOREEL_ASSIGN(writer_, Writer::create(options_.output, std::move(settings)));
  }
  for (std::size_t i = 1; i < tracks.size(); ++i)
    ISOREEL_TRY(writer_->addTrack({configuration.time_base, tracks[i].name, record}).status());
  return {};
}

std::string EncodeTarget::giveUp(std::uint64_t frames) {
  if (!writer_) return "";
  if (frames == 0) {
    writer_->discard();
    return "";
  }
  const std::string done = counted(frames, "frame");
  if (options_.output == "-") return fmt::format(" (what was done before, {}, was written)", done);
  if (!options_.append)
    return fmt::format(" (what was done before, {}, is in {}.part)", done, options_.output);
  if (writer_->finish().ok())
    return fmt::format(" (what was done before, {}, is in {})", done, options_.output);
  writer_->discard();
  return fmt::format(" ({} is as it was)", options_.output);
}

}  // namespace isoreel::cli
