// SPDX-License-Identifier: BSD-3-Clause
// What is measured on: the frames of one set, in memory.
#pragma once

#include <nlohmann/json.hpp>

#include "coder.h"

namespace isoreel::bench {

using Json = nlohmann::ordered_json;

struct Sequence {
  Configuration configuration;
  std::vector<Frame> frames;  // those whose surface has triangles
  double contrast =
      1;  // median difference of samples over an edge that the surface crosses, in the first frame

  std::size_t vertices() const;
};

/// Reads a set: {"inputs": [paths], "grid": name, "isovalues": [numbers], "inside": "below" or "above"}. All
/// but the inputs may be left out for level sets. One isovalue serves all volumes; several belong to one
/// volume, or one to each.
Result<Sequence> loadSequence(const Json& set);

}  // namespace isoreel::bench
