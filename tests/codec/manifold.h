// SPDX-License-Identifier: BSD-3-Clause
// Whether quads are a 2-manifold, told from their corners' numbers alone.
#pragma once

#include <isoreel/codec/surface.h>

#include <algorithm>
#include <string>
#include <vector>

namespace isoreel::made {

/// Empty when each edge has one quad, or two that run along it in opposite directions, and the quads of each
/// vertex are one fan; else where that is not so. Counts edges that have one quad.
inline std::string manifoldFault(const std::vector<Quad>& quads, std::size_t* border = nullptr) {
  struct Corner {
    std::uint32_t vertex, next, before;  // in its quad
  };
  std::vector<Corner> corners;
  for (const Quad& quad : quads) {
    for (std::size_t k = 0; k < 4; ++k) corners.push_back({quad[k], quad[(k + 1) % 4], quad[(k + 3) % 4]});
  }
  std::sort(corners.begin(), corners.end(), [](const Corner& a, const Corner& b) {
    return std::pair(a.vertex, a.next) < std::pair(b.vertex, b.next);
  });
  std::size_t open = 0;
  for (auto fan = corners.begin(); fan != corners.end();) {
    const auto end =
        std::find_if(fan, corners.end(), [&](const Corner& c) { return c.vertex != fan->vertex; });
    const std::string place = "vertex " + std::to_string(fan->vertex);
    // From quad to quad across edges, from the one that has none before it if there is one.
    auto start = fan;
    std::size_t starts = 0;
    for (auto c = fan; c != end; ++c) {
      if (c + 1 != end && c->next == (c + 1)->next) return place + ": an edge with two quads on one side";
      if (c->next == c->before) return place + ": a quad that runs along an edge and back";
      const auto others = std::count_if(fan, end, [&](const Corner& o) { return o.before == c->next; });
      if (others > 1) return place + ": an edge with two quads on one side";
      if (others == 0) {
        start = c;
        ++starts;
      }
    }
    open += starts;
    auto at = start;
    std::ptrdiff_t seen = 0;
    do {
      ++seen;
      at = std::find_if(fan, end, [&](const Corner& o) { return o.next == at->before; });
    } while (at != end && at != start);
    if (seen != end - fan) return place + ": several fans of quads";
    fan = end;
  }
  if (border != nullptr) *border = open;
  return {};
}

}  // namespace isoreel::made
