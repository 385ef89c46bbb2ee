// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <isoreel/container/reader.h>

#include "command.h"
#include "metadata.h"

namespace isoreel::cli {
namespace {

struct TagOptions {
  std::string file;
  std::vector<std::string> set;  // KEY=VALUE
  std::vector<std::string> remove;
  std::string from;
  bool clear = false;
  bool json = false;

  bool changes() const { return clear || !set.empty() || !remove.empty() || !from.empty(); }
};

Status show(const TagOptions& options) {
  ISOREEL_ASSIGN(const auto reader, Reader::open(options.file));
  const Json tags = tagsOf(reader->info());
  if (options.json) {
    fmt::print("{}\n", dumped(tags, 2));
  } else {
    for (const auto& [key, value] : tags.items()) fmt::print("{} = {}\n", printable(key), printable(value));
  }
  return {};
}

Status changeTags(const TagOptions& options, Writer& writer) {
  Json tags = options.clear ? Json::object() : tagsOf(writer.info());
  if (!tags.is_object())
    return {ErrorCode::kBadData, options.file + ": its tags are no JSON object; --clear starts anew"};
  if (!options.from.empty()) {
    ISOREEL_ASSIGN(const Json more, readJson(options.from, Json::object()));
    tags.update(more);
  }
  for (const std::string& key : options.remove) {
    if (tags.erase(key) == 0)
      return {ErrorCode::kNotFound, fmt::format("{}: there is no tag '{}'", options.file, key)};
  }
  for (const std::string& tag : options.set) {
    const std::size_t equals = tag.find('=');
    tags[tag.substr(0, equals)] = tag.substr(equals + 1);
  }
  return writer.setTags(dumped(tags));
}

Status tag(const TagOptions& options) {
  for (const std::string& tag : options.set) {
    if (tag.find('=') == std::string::npos || tag.starts_with('='))
      throw CLI::ValidationError("tags", fmt::format("'{}' is not KEY=VALUE", tag));
  }
  if (!options.changes()) return show(options);
  return editFile(options.file, [&](Writer& writer) { return changeTags(options, writer); });
}

}  // namespace

void addTagCommand(CLI::App& app, Action& chosen) {
  CLI::App* verb = app.add_subcommand("tag", "Show or change the tags of an .isr file");
  const auto options = std::make_shared<TagOptions>();
  verb->add_option("file", options->file, "The .isr file")->required();
  verb->add_option("tags", options->set, "KEY=VALUE to set; without any change, tags are shown")
      ->default_str("");
  verb->add_option("--delete", options->remove, "A key to take away; may be repeated")
      ->take_all()
      ->default_str("");
  verb->add_option("--from", options->from, "A JSON file whose object is merged in; values may be any JSON");
  verb->add_flag("--clear", options->clear, "Take all tags away first");
  verb->add_flag("--json", options->json, "Show them as one JSON object");
  verb->callback([options, &chosen] { chosen = [options] { return tag(*options); }; });
}

}  // namespace isoreel::cli
