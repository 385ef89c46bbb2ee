// SPDX-License-Identifier: BSD-3-Clause
// What a decoder finds in an .isr file, as the manifest of the vectors lists it (spec/README.md).
#pragma once

#include <isoreel/codec/surface.h>

#include <nlohmann/json.hpp>
#include <string>

namespace isoreel::cli {

/// Counts and hash of a surface: "vertices", "faces", "hash".
nlohmann::ordered_json summaryOf(const Surface& surface);

/// All that readers by index, scan and pipe give of the file at `path`: "indexed", "tags", "chapters",
/// "attachments", "tracks" with their frames decoded, "damage", "pipe". What is wrong with a single frame is
/// told there; the error is that of a file that cannot be opened at all.
Result<nlohmann::ordered_json> observeFile(const std::string& path);

}  // namespace isoreel::cli
