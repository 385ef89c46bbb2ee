// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/inspect/manifold.h>

#include <algorithm>

namespace isoreel::inspect {
namespace {

/// A quad at one of its vertices: those before and behind it.
struct Corner {
  std::uint32_t next, before;
};

/// What is wrong with the corners of one vertex, or null; then counts the edges that begin at it and have
/// one quad.
const char* faultOf(std::span<const Corner> corners, std::size_t& border) {
  const Corner* start = corners.data();
  std::size_t starts = 0;
  for (const Corner& c : corners) {
    if (c.next == c.before) return "a quad that runs along an edge and back";
    std::size_t same = 0, others = 0;
    for (const Corner& o : corners) {
      same += o.next == c.next ? 1u : 0u;
      others += o.before == c.next ? 1u : 0u;
    }
    if (same > 1 || others > 1) return "an edge with two quads on one side";
    if (others == 1) continue;
    start = &c;
    ++starts;
  }
  // From quad to quad across edges, from the one that has none before it if there is one.
  std::size_t seen = 1;
  const auto behind = [&](const Corner& c) {
    const auto next = std::ranges::find(corners, c.before, &Corner::next);
    return next == corners.end() ? start : &*next;
  };
  for (const Corner* at = behind(*start); at != start; at = behind(*at)) ++seen;
  if (seen != corners.size()) return "several fans of quads";
  border += starts;
  return nullptr;
}

}  // namespace

Manifoldness manifoldness(std::span<const Quad> quads, std::size_t vertices) {
  std::vector<std::uint32_t> first(vertices + 1);  // corner of each vertex
  for (const Quad& quad : quads) {
    for (const std::uint32_t v : quad) ++first[v + 1];
  }
  for (std::size_t v = 0; v < vertices; ++v) first[v + 1] += first[v];
  std::vector<Corner> corners(4 * quads.size());
  std::vector<std::uint32_t> free(first.begin(), first.end() - 1);
  for (const Quad& quad : quads) {
    for (std::size_t k = 0; k < 4; ++k) corners[free[quad[k]]++] = {quad[(k + 1) % 4], quad[(k + 3) % 4]};
  }
  Manifoldness result;
  for (std::size_t v = 0; v < vertices; ++v) {
    const std::span fan = std::span(corners).subspan(first[v], first[v + 1] - first[v]);
    const char* fault = fan.empty() ? nullptr : faultOf(fan, result.border);
    if (fault == nullptr) continue;
    if (++result.faults == 1) result.first = "vertex " + std::to_string(v) + ": " + fault;
  }
  return result;
}

}  // namespace isoreel::inspect
