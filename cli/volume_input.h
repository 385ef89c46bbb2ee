// SPDX-License-Identifier: BSD-3-Clause
// The options that say what volumes are, shared by the verbs that read them.
#pragma once

#include <isoreel/codec/encoder.h>
#include <isoreel/io/volume_reader.h>

#include <CLI/CLI.hpp>
#include <cmath>
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

/// Whether a file's surfaces are of these volumes: on their grid, or on a coarser one in the same box. Where
/// grids are equal in size their placement is not compared, since not all formats know it.
inline Status sameBox(const io::VolumeSequence& volumes, const Grid& grid, const std::string& path) {
  const Grid& finer = volumes.grid();
  bool same = true;
  for (std::size_t k = 0; k < 3; ++k) {
    const double length = finer.spacing[k] * (finer.nodes[k] - 1),
                 other = grid.spacing[k] * (grid.nodes[k] - 1);
    same = same && (finer.nodes == grid.nodes ||
                    (grid.nodes[k] <= finer.nodes[k] && std::abs(length - other) <= 1e-6 * length));
  }
  if (same) return {};
  return {ErrorCode::kInvalidArgument, "the grid of " + volumes.name(0) + " is not that of " + path};
}

}  // namespace isoreel::cli
