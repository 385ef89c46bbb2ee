// SPDX-License-Identifier: BSD-3-Clause
// Tags, chapters and attachments as verbs show and change them.
#pragma once

#include <isoreel/container/writer.h>

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace isoreel::cli {

using Json = nlohmann::ordered_json;

/// Names of files may be no UTF-8.
std::string dumped(const Json& json, int indent = -1);

/// The tags, or null when they are no JSON. What is nested deeper than anyone writes is left out: printing
/// recurses.
Json tagsOf(const FileInfo& info);
Json parsedTags(const std::string& tags);

/// Tags and titles come from anywhere: a terminal must not obey what is in them.
std::string printable(const Json& value);

Json chaptersJson(const FileInfo& info);
Json attachmentsJson(const FileInfo& info);
/// "chapter  1.5 s to 3 s  Title", a line each.
std::vector<std::string> chapterLines(const FileInfo& info);
/// "name, type, 12 bytes"
std::string attachmentLine(const Attachment& attachment);

/// Opens the file at `path` to be continued, lets `change` write, and finishes it. When `change` fails the
/// file is as it was.
Status editFile(const std::string& path, const std::function<Status(Writer&)>& change);

/// The content of a JSON file, which must be of the type that `like` is (an object, an array).
Result<Json> readJson(const std::string& path, const Json& like);

}  // namespace isoreel::cli
