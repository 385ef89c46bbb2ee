// SPDX-License-Identifier: BSD-3-Clause
// The contexts of a cell's new nodes, kept up to date while these are coded (spec codec 4.4).
#pragma once

#include <bit>

#include "intra/new_nodes.h"
#include "intra/sign_context.h"

namespace isoreel {

/// Sums as of SignModels for the nodes of kNewNodes. A context is a sum over the nodes around, so a new one
/// adds its part to all that come later: these wait for nothing else.
class CellContexts {
 public:
  /// From what was known before the cell, for the nodes in `coded`; `windows`, `x`: as of SignBlock.
  void start(const SignWindow* windows, int x, std::uint32_t coded) {
    for (; coded != 0; coded &= coded - 1) {
      const auto which = static_cast<std::size_t>(std::countr_zero(coded));
      const NewNode& node = kNewNodes[which];
      const SignWindow around = SignBlock::around(windows + node.window, node.shift + 2 * x);
      sums_[which] = SignModels::sumOf(around.known, around.inside);
    }
  }
  /// The node is known now.
  void add(std::size_t which, bool inside) {
    const Sums& parts = kParts[which][inside];
    for (std::size_t i = 0; i < kRoom; ++i) sums_[i] += parts[i];
  }
  std::uint32_t operator[](std::size_t which) const { return sums_[which]; }

 private:
  static constexpr std::size_t kRoom = 20;  // of whole vectors
  using Sums = std::array<std::uint32_t, kRoom>;

  // What a node adds to those after it: by node, then whether it is inside.
  static constexpr auto kParts = [] {
    std::array<std::array<Sums, 2>, kNewNodes.size()> parts{};
    for (std::size_t from = 0; from < kNewNodes.size(); ++from) {
      for (std::size_t to = from + 1; to < kNewNodes.size(); ++to) {
        const NewNode &a = kNewNodes[from], &b = kNewNodes[to];
        const int dx = a.x - b.x, dy = a.y - b.y, dz = a.z - b.z;
        if (dx * dx > 1 || dy * dy > 1 || dz * dz > 1) continue;
        for (std::size_t inside = 0; inside < 2; ++inside)
          parts[from][inside][to] = SignModels::part(dx, dy, dz, inside != 0);
      }
    }
    return parts;
  }();

  alignas(16) Sums sums_{};
};

}  // namespace isoreel
