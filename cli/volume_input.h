// SPDX-License-Identifier: BSD-3-Clause
// The options that say what volumes are, shared by the verbs that read them.
#pragma once

#include <isoreel/codec/encoder.h>
#include <isoreel/io/volume_reader.h>

#include <CLI/CLI.hpp>
#include <map>
#include <string>
#include <vector>

namespace isoreel::cli {

inline const std::map<std::string, VertexPlacement> kPlacements{{"qef", VertexPlacement::kQef},
                                                                {"centroid", VertexPlacement::kCentroid}};
inline const std::map<std::string, NonFinite> kNonFinite{{"error", NonFinite::kRefuse},
                                                         {"outside", NonFinite::kOutside}};

/// The value that `text` names; throws CLI::ValidationError for any other text.
template <class Value>
Value choice(const std::string& option, const std::map<std::string, Value>& values, const std::string& text) {
  if (const auto found = values.find(text); found != values.end()) return found->second;
  std::string names;
  for (const auto& [name, value] : values) names += (names.empty() ? "" : " or ") + name;
  throw CLI::ValidationError(option, "'" + text + "' is not " + names);
}

/// Adds INPUT... (or an option of another name that takes them, which may be left out), --array and --nan.
struct VolumeInput {
  std::vector<std::string> paths;
  io::VolumeOptions options;
  NonFinite non_finite = NonFinite::kRefuse;

  void add(CLI::App& verb, const std::string& name = "input") {
    std::string formats;
    for (const std::string& format : io::volumeFormats()) formats += (formats.empty() ? "" : ", ") + format;
    verb.add_option(name, paths,
                    "Volume files in order, a 4-D file, a folder, or a pattern such as frame_%04d.vdb or "
                    "'frame_*.vdb'; formats: " +
                        formats)
        ->required(!name.starts_with('-'))
        ->default_str("");
    verb.add_option("--array,--grid", options.array,
                    "The array (VTI) or grid (OpenVDB) to read in files that hold several (default: the only "
                    "scalar one, or OpenVDB's only level set)");
    verb.add_option_function<std::string>(
            "--nan", [this](const std::string& text) { non_finite = choice("--nan", kNonFinite, text); },
            "Samples that are not finite: an error, or outside")
        ->default_str("error")
        ->type_name("error|outside");
  }
};

}  // namespace isoreel::cli
