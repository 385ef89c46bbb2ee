// SPDX-License-Identifier: BSD-3-Clause
#include "extract/surface_fit.h"

#include <cmath>

#include "lattice/runs.h"

namespace isoreel {
namespace {

constexpr std::size_t kPerTask = 4096;
constexpr float kReach =
    0.2f;  // how far from the surface a vertex may be wanted: the distance is linear near it only
constexpr float kDoubtful = 0.6f;  // a sample that is farther from the surface says nothing
using Four = float __attribute__((vector_size(16)));

}  // namespace

SurfaceFit::SurfaceFit(const FitTarget& target, std::span<const Cell> cells, const HeightFrame& frame,
                       std::span<const Quad> quads, const Grid& grid, bool sparse,
                       const ParallelFor& parallel)
    : target_(target),
      cells_(cells),
      quads_(quads),
      squared_spacing_{static_cast<float>(grid.spacing[0] * grid.spacing[0]),
                       static_cast<float>(grid.spacing[1] * grid.spacing[1]),
                       static_cast<float>(grid.spacing[2] * grid.spacing[2])},
      sparse_(sparse),
      parallel_(parallel),
      slopes_(cells.size()),
      heights_(cells.size()),
      start_(cells.size()),
      points_(cells.size()),
      places_(cells.size()),
      normals_(cells.size()) {
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const std::array<std::uint16_t, 3> corner{cells[i].x, cells[i].y, cells[i].z};
    for (std::size_t k = 0; k < 3; ++k) {
      points_[i][k] =
          static_cast<float>(corner[k]) + static_cast<float>(frame.predicted.points[i].v[k]) / 2048;
      normals_[i][k] = static_cast<float>(frame.predicted.normals[i].v[k]) / kCell;
    }
  }
  findUses();
}

void SurfaceFit::findUses() {
  first_use_.assign(cells_.size() + 1, 0);
  for (const Quad& quad : quads_) {
    for (const std::uint32_t i : quad) ++first_use_[i + 1];
  }
  for (std::size_t i = 0; i < cells_.size(); ++i) first_use_[i + 1] += first_use_[i];
  uses_.resize(first_use_.back());
  use_of_.resize(quads_.size());
  std::vector<std::uint32_t> next(first_use_.begin(), first_use_.end() - 1);
  for (std::uint32_t q = 0; q < quads_.size(); ++q) {
    for (std::uint32_t corner = 0; corner < 4; ++corner) use_of_[q][corner] = next[quads_[q][corner]]++;
  }
}

Vec3f SurfaceFit::place(std::uint32_t i) const {
  Vec3f result = points_[i];
  const std::array<std::uint16_t, 3> corner{cells_[i].x, cells_[i].y, cells_[i].z};
  for (std::size_t k = 0; k < 3; ++k) {
    const auto low = static_cast<float>(corner[k]);
    result[k] = std::clamp(result[k] + heights_[i] * normals_[i][k], low, low + 1);
  }
  return result;
}

std::array<std::int32_t, 3> SurfaceFit::vertex(std::uint32_t i) const {
  const Vec3f at = place(i);
  const std::array<std::uint16_t, 3> corner{cells_[i].x, cells_[i].y, cells_[i].z};
  std::array<std::int32_t, 3> result;
  for (std::size_t k = 0; k < 3; ++k)
    result[k] = static_cast<std::int32_t>((at[k] - static_cast<float>(corner[k])) * kCell);
  return result;
}

// Adds up what the samples of one quad say.
class SurfaceFit::QuadSum {
 public:
  QuadSum(const SurfaceFit& fit, const Quad& quad) : fit_(fit) {
    const auto along = [&](const std::vector<Vec3f>& of, std::size_t k) {
      return Four{of[quad[0]][k], of[quad[1]][k], of[quad[2]][k], of[quad[3]][k]};
    };
    for (std::size_t k = 0; k < 3; ++k) {
      places_[k] = along(fit.places_, k);
      normals_[k] = along(fit.normals_, k);
    }
  }

  /// A sample at the mean of the corners so weighed. `near`: those that it is the mean of.
  void add(const Four& parts, const std::array<std::uint32_t, 4>& near) {
    Vec3f at;
    for (std::size_t k = 0; k < 3; ++k) {
      const Four along = parts * places_[k];
      at[k] = (along[0] + along[1]) + (along[2] + along[3]);
    }
    const FitTarget::Near found = fit_.target_.near(at, near);
    if (!(std::abs(found.distance) < kDoubtful)) return;
    const Four slopes = parts * (found.normal[0] * normals_[0] + found.normal[1] * normals_[1] +
                                 found.normal[2] * normals_[2]);
    first += slopes * found.distance;
    second += slopes * slopes;
    next += slopes * __builtin_shufflevector(slopes, slopes, 1, 2, 3, 0);
    across += slopes * __builtin_shufflevector(slopes, slopes, 2, 3, 0, 1);
  }

  /// The middle of the diagonal that the quad is split along, from corner 0 or 1, the triangles' centroids,
  /// and the middles of those edges that no other quad has looked at.
  void addAll(const Quad& quad, bool along_first) {
    constexpr float kThird = 1.0f / 3;
    if (along_first) {
      add(Four{0.5f, 0, 0.5f, 0}, quad);
      add(Four{kThird, kThird, kThird, 0}, quad);
      add(Four{kThird, 0, kThird, kThird}, quad);
    } else {
      add(Four{0, 0.5f, 0, 0.5f}, quad);
      add(Four{kThird, kThird, 0, kThird}, quad);
      add(Four{0, kThird, kThird, kThird}, quad);
    }
    for (std::size_t a = 0; a < 4; ++a) {
      const std::size_t b = (a + 1) % 4;
      if (quad[a] > quad[b]) continue;  // the quad on the other side has it
      Four parts{};
      parts[a] = parts[b] = 0.5f;
      add(parts, {quad[a], quad[b], quad[a], quad[a]});
    }
  }
  void countTwice() {
    for (Four* sum : {&first, &second, &next, &across}) *sum *= 2;
  }

  // Of each corner.
  Four first{}, second{};
  // Of each corner and the next one, and the one across.
  Four next{}, across{};

 private:
  const SurfaceFit& fit_;
  std::array<Four, 3> places_, normals_;
};

// A quad's triangles: whether it is split from corner 0 to 2, along the shorter diagonal, as
// Surface::triangles() does.
bool SurfaceFit::splitAlongFirst(const Quad& quad) const {
  std::array<float, 2> square{};
  for (std::size_t d = 0; d < 2; ++d) {
    const Vec3f &a = places_[quad[d]], &b = places_[quad[d + 2]];
    for (std::size_t k = 0; k < 3; ++k) square[d] += squared_spacing_[k] * (a[k] - b[k]) * (a[k] - b[k]);
  }
  return square[0] <= square[1];
}

void SurfaceFit::linearise() {
  if (!linear_) lookAgain();
}

void SurfaceFit::setAll(const std::vector<float>& heights) {
  for (std::uint32_t i = 0; i < heights.size(); ++i) set(i, heights[i]);
}

void SurfaceFit::lookAgain() {
  linear_ = true;
  forRuns(parallel_, cells_.size(), kPerTask, [&](std::size_t first, std::size_t end) {
    for (std::size_t n = first; n < end; ++n) {
      const auto i = static_cast<std::uint32_t>(n);
      places_[i] = place(i);
      const FitTarget::Near near = target_.near(places_[i], {i, i, i, i});
      slopes_[i] = {};
      if (!(std::abs(near.distance) < kDoubtful)) continue;
      const float slope = dot(near.normal, normals_[i]);
      slopes_[i] = {slope * near.distance, slope * slope};
    }
  });
  forRuns(parallel_, quads_.size(), kPerTask, [&](std::size_t first, std::size_t end) {
    for (std::size_t q = first; q < end; ++q) {
      const Quad& quad = quads_[q];
      QuadSum sum(*this, quad);
      if (sparse_) {
        sum.add(Four{0.25f, 0.25f, 0.25f, 0.25f}, quad);
        sum.countTwice();
      } else {
        sum.addAll(quad, splitAlongFirst(quad));
      }
      for (std::size_t v = 0; v < 4; ++v) {
        const std::size_t after = (v + 1) % 4, across = (v + 2) % 4, before = (v + 3) % 4;
        uses_[use_of_[q][v]] = {
            {sum.first[v], sum.second[v]},
            {{{quad[after], sum.next[v]}, {quad[across], sum.across[v]}, {quad[before], sum.next[before]}}}};
      }
    }
  });
  forRuns(parallel_, cells_.size(), kPerTask, [&](std::size_t first, std::size_t end) {
    for (std::size_t i = first; i < end; ++i) {
      for (std::uint32_t u = first_use_[i]; u < first_use_[i + 1]; ++u) {
        slopes_[i].first += uses_[u].own.first;
        slopes_[i].second += uses_[u].own.second;
      }
    }
  });
}

SurfaceFit::Bowl SurfaceFit::bowl(std::uint32_t i) const {
  const Slopes& slopes = slopes_[i];
  if (slopes.second < 0.01f) return {start_[i], 0.01f};
  const float best = heights_[i] - slopes.first / slopes.second;
  return {std::clamp(best, start_[i] - kReach, start_[i] + kReach), slopes.second};
}

void SurfaceFit::set(std::uint32_t i, float height) {
  const float change = height - heights_[i];
  if (change == 0) return;
  heights_[i] = height;
  slopes_[i].first += change * slopes_[i].second;
  for (std::uint32_t u = first_use_[i]; u < first_use_[i + 1]; ++u) {
    for (const Use::Other& other : uses_[u].others) slopes_[other.vertex].first += change * other.slope;
  }
}

void SurfaceFit::optimise(int rounds, int sweeps) {
  for (int round = 0; round < rounds; ++round) {
    lookAgain();
    for (int sweep = 0; sweep < sweeps; ++sweep) {
      for (std::uint32_t i = 0; i < heights_.size(); ++i) set(i, bowl(i).best);
    }
  }
}

void SurfaceFit::toSurface() {
  forRuns(parallel_, heights_.size(), kPerTask, [&](std::size_t first, std::size_t end) {
    for (std::size_t i = first; i < end; ++i)
      start_[i] = target_.height(static_cast<std::uint32_t>(i), cells_[i], points_[i], normals_[i]);
  });
  heights_ = start_;
}

}  // namespace isoreel
