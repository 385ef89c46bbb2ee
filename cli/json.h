// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace isoreel::cli {

/// Keys stay in the order in which they were put in.
using Json = nlohmann::ordered_json;

/// Names of files may be no UTF-8.
inline std::string dumped(const Json& json, int indent = -1) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

/// A file's tags, or null when they are no JSON. What is nested deeper than anyone writes is left out:
/// printing recurses.
inline Json parsedTags(const std::string& tags) {
  const auto keep = [](int depth, Json::parse_event_t, Json&) { return depth < 64; };
  Json json = Json::parse(tags, keep, false);
  return json.is_discarded() ? Json(nullptr) : json;
}

}  // namespace isoreel::cli
