// SPDX-License-Identifier: BSD-3-Clause
// Slices: parts of a list of cells that are coded by themselves, so that threads can share the work (spec
// codec 11.10).
#pragma once

#include <isoreel/codec/configuration.h>

#include <algorithm>
#include <span>
#include <vector>

#include "lattice/cell_index.h"

namespace isoreel {

/// How many slices a list of so many cells or vertices has.
inline std::size_t sliceCount(std::size_t cells, const Slices& slices) {
  return std::clamp<std::size_t>(cells / slices.least_cells, 1, slices.most);
}

/// Where each of `count` slices begins in the bricks of a list, and where the last one ends.
inline std::vector<std::uint32_t> sliceStarts(std::span<const CellIndex::Brick> bricks, std::size_t count) {
  std::vector<std::uint32_t> starts{0};
  const std::uint64_t cells = bricks.empty() ? 0 : bricks.back().first + bricks.back().count;
  for (std::uint32_t number = 0; number < bricks.size(); ++number) {
    if (count * bricks[number].first / cells == starts.size()) starts.push_back(number);
  }
  starts.push_back(static_cast<std::uint32_t>(bricks.size()));
  return starts;
}

}  // namespace isoreel
