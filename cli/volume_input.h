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

inline const std::map<std::string, VertexPlacement> kPlacements{{"qef", VertexPlacement::kQef}, {"centroid", VertexPlacement::kCentroid}};
inline const std::map<std::string, NonFinite> kNonFinite{{"error", NonFinite::kRefuse}, {"outside", NonFinite::kOutside}};

/// Adds INPUT..., --grid and --nan.
struct VolumeInput {
  std::vector<std::string> paths;
  io::VolumeOptions options;
  NonFinite non_finite = NonFinite::kRefuse;

  void add(CLI::App& verb) {
    verb.add_option("input", paths, "Volume files in order, a 4-D file, a folder, or a pattern such as frame_%04d.vdb")->required();
    verb.add_option("--grid", options.grid, "OpenVDB: the grid to read (default: the only one, or the only level set)");
    verb.add_option("--nan", non_finite, "Samples that are not finite: an error, or outside")
        ->transform(CLI::CheckedTransformer(kNonFinite).description(""))
        ->default_str("error")
        ->type_name("error|outside");
  }
};

}  // namespace isoreel::cli
