// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <isoreel/container/reader.h>

#include <algorithm>
#include <cmath>

#include "command.h"
#include "metadata.h"
#include "options.h"

namespace isoreel::cli {
namespace {

struct ChapterOptions {
  std::string file;
  std::vector<std::string> chapters;  // START[:END]=TITLE
  std::vector<std::string> markers;   // AT=TITLE
  std::string from;
  bool clear = false;
  bool json = false;

  bool changes() const { return clear || !chapters.empty() || !markers.empty() || !from.empty(); }
};

/// A time as people write it: a frame's number, or seconds with an s ("2.5s"). In ticks of the reader's
/// track.
Result<std::int64_t> ticks(const std::string& option, const std::string& text, const Reader& reader) {
  const TimeBase base = reader.info().time_base;
  if (text.ends_with('s')) {
    const double seconds = parseFraction(option, text.substr(0, text.size() - 1)).value();
    return static_cast<std::int64_t>(std::llround(seconds * base.denominator / base.numerator));
  }
  const Fraction frame = parseFraction(option, text);
  if (frame.denominator != 1 || frame.numerator < 0)
    throw CLI::ValidationError(option, fmt::format("'{}' is no frame, nor seconds as 2.5s", text));
  const auto number = static_cast<std::uint64_t>(frame.numerator);
  const std::uint64_t count = reader.frameCount();
  if (number > count || count == 0)
    return {ErrorCode::kNotFound, fmt::format("{}: there is no frame {}", reader.info().track_name, text)};
  if (number < count) return reader.header(number).time;
  const FrameHeader& last = reader.header(count - 1);  // the end, as the end of a chapter
  return last.time + static_cast<std::int64_t>(last.duration);
}

Result<Chapter> parsed(const std::string& option, Chapter::Kind kind, const std::string& text,
                       const Reader& reader) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0)
    throw CLI::ValidationError(option, fmt::format("'{}' is not TIME=TITLE", text));
  const std::string times = text.substr(0, equals);
  const std::size_t colon = times.find(':');
  Chapter chapter;
  chapter.kind = kind;
  chapter.title = text.substr(equals + 1);
  ISOREEL_ASSIGN(chapter.start, ticks(option, times.substr(0, colon), reader));
  if (colon == std::string::npos) return chapter;
  ISOREEL_ASSIGN(const std::int64_t end, ticks(option, times.substr(colon + 1), reader));
  if (end <= chapter.start)
    throw CLI::ValidationError(option, fmt::format("'{}' ends before it starts", times));
  chapter.length = static_cast<std::uint64_t>(end - chapter.start);
  return chapter;
}

/// As --json prints them.
Result<std::vector<Chapter>> fromJson(const Json& list, const std::string& path, const Reader& reader) {
  const TimeBase base = reader.info().time_base;
  const auto in_ticks = [&](double seconds) {
    return static_cast<std::int64_t>(std::llround(seconds * base.denominator / base.numerator));
  };
  std::vector<Chapter> chapters;
  for (const Json& entry : list) {
    if (!entry.is_object() || !entry.contains("start") || !entry["start"].is_number() ||
        !entry.value("title", Json("")).is_string() || !(std::abs(entry["start"].get<double>()) < 1e9)) {
      return {ErrorCode::kBadData,
              path + ": is no {\"chapters\": […]} of objects with start (in seconds), end, title and kind"};
    }
    Chapter& chapter = chapters.emplace_back();
    chapter.start = in_ticks(entry["start"].get<double>());
    chapter.title = entry.value("title", "");
    if (entry.value("kind", Json("chapter")) == "marker") chapter.kind = Chapter::Kind::kMarker;
    if (!entry.contains("end") || !entry["end"].is_number()) continue;
    const double end = entry["end"].get<double>();
    if (end > entry["start"].get<double>() && end < 1e9)
      chapter.length = static_cast<std::uint64_t>(in_ticks(end) - chapter.start);
  }
  return chapters;
}

Status chapter(const ChapterOptions& options) {
  std::vector<Chapter> chapters;
  {
    ISOREEL_ASSIGN(const auto reader, Reader::open(options.file));
    if (!options.changes()) {
      if (options.json) {
        fmt::print("{}\n", dumped(Json{{"chapters", chaptersJson(reader->info())}}, 2));
      } else {
        for (const std::string& line : chapterLines(reader->info())) fmt::print("{}\n", line);
      }
      return {};
    }
    if (!options.clear && options.from.empty()) chapters = reader->info().chapters;
    if (!options.from.empty()) {
      ISOREEL_ASSIGN(const Json object, readJson(options.from, Json::object()));
      ISOREEL_ASSIGN(chapters, fromJson(object.value("chapters", Json::array()), options.from, *reader));
    }
    for (const std::string& text : options.chapters) {
      ISOREEL_ASSIGN(chapters.emplace_back(), parsed("--add", Chapter::Kind::kChapter, text, *reader));
    }
    for (const std::string& text : options.markers) {
      ISOREEL_ASSIGN(chapters.emplace_back(), parsed("--marker", Chapter::Kind::kMarker, text, *reader));
    }
  }
  std::stable_sort(chapters.begin(), chapters.end(),
                   [](const Chapter& a, const Chapter& b) { return a.start < b.start; });
  return editFile(options.file, [&](Writer& writer) { return writer.setChapters(chapters); });
}

}  // namespace

void addChapterCommand(CLI::App& app, Action& chosen) {
  CLI::App* verb = app.add_subcommand("chapter", "Show or change the chapters and markers of an .isr file");
  const auto options = std::make_shared<ChapterOptions>();
  verb->add_option("file", options->file, "The .isr file")->required();
  verb->add_option("--add", options->chapters,
                   "A chapter START[:END]=TITLE; times are frames, or seconds as 2.5s; may be repeated")
      ->take_all()
      ->default_str("");
  verb->add_option("--marker", options->markers, "A marker TIME=TITLE; may be repeated")
      ->take_all()
      ->default_str("");
  verb->add_option("--from", options->from, "A JSON file as --json prints it, which replaces all");
  verb->add_flag("--clear", options->clear, "Take all away first");
  verb->add_flag("--json", options->json, "Show them as one JSON object; times are seconds");
  verb->callback([options, &chosen] { chosen = [options] { return chapter(*options); }; });
}

}  // namespace isoreel::cli
