// SPDX-License-Identifier: BSD-3-Clause
#include "metadata.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>

namespace isoreel::cli {

std::string dumped(const Json& json, int indent) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

Json tagsOf(const FileInfo& info) { return parsedTags(info.tags); }

Json parsedTags(const std::string& tags) {
  const auto keep = [](int depth, Json::parse_event_t, Json&) { return depth < 64; };
  Json json = Json::parse(tags, keep, false);
  return json.is_discarded() ? Json(nullptr) : json;
}

std::string printable(const Json& value) {
  const std::string text = value.is_string() ? value.get<std::string>() : "";
  const bool plain =
      std::none_of(text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; });
  return value.is_string() && plain ? text : dumped(value);
}

Json chaptersJson(const FileInfo& info) {
  const TimeBase base = info.tracks.empty() ? info.time_base : info.tracks.front().time_base;
  Json chapters = Json::array();
  for (const Chapter& c : info.chapters) {
    Json chapter{{"kind", c.kind == Chapter::Kind::kMarker ? "marker" : "chapter"},
                 {"start", base.seconds(c.start)},
                 {"end", nullptr},
                 {"title", c.title}};
    if (c.length > 0) chapter["end"] = base.seconds(c.start) + base.seconds(c.length);
    chapters.push_back(std::move(chapter));
  }
  return chapters;
}

Json attachmentsJson(const FileInfo& info) {
  Json attachments = Json::array();
  for (const Attachment& a : info.attachments)
    attachments.push_back({{"name", a.name}, {"type", a.media_type}, {"bytes", a.bytes}});
  return attachments;
}

std::vector<std::string> chapterLines(const FileInfo& info) {
  std::vector<std::string> lines;
  for (const Json& c : chaptersJson(info)) {
    lines.push_back(fmt::format("{:<8} {:.6g} s{}  {}", c["kind"].get<std::string>(),
                                c["start"].get<double>(),
                                c["end"].is_null() ? "" : fmt::format(" to {:.6g} s", c["end"].get<double>()),
                                printable(c["title"])));
  }
  return lines;
}

std::string attachmentLine(const Attachment& a) {
  return fmt::format("{}{}, {} bytes", printable(a.name),
                     a.media_type.empty() ? "" : ", " + printable(a.media_type), a.bytes);
}

Status editFile(const std::string& path, const std::function<Status(Writer&)>& change) {
  ISOREEL_ASSIGN(const std::unique_ptr<Writer> writer, Writer::append(path));
  Status status = change(*writer);
  if (status.ok()) status = writer->finish();
  if (!status.ok()) writer->discard();
  return status;
}

Result<Json> readJson(const std::string& path, const Json& like) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return {ErrorCode::kNotFound, path + ": cannot be opened"};
  const auto keep = [](int depth, Json::parse_event_t, Json&) { return depth < 64; };
  Json json = Json::parse(in, keep, false);
  if (json.is_discarded() || json.type() != like.type())
    return {ErrorCode::kBadData, fmt::format("{}: is no JSON {}", path, like.type_name())};
  return json;
}

}  // namespace isoreel::cli
