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

}  // namespace

SurfaceFit::SurfaceFit(const FitTarget& target, std::span<const Cell> cells, const HeightFrame& frame,
                       std::span<const Quad> quads, const Grid& grid, bool sparse,
                       const ParallelFor& parallel)
    : target_(target),
      cells_(cells),
      frame_(frame),
      quads_(quads),
      grid_(grid),
      sparse_(sparse),
      parallel_(parallel),
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
  makeSamples(quads);
}

void SurfaceFit::makeSamples(std::span<const Quad> quads) {
  const auto count = static_cast<std::uint32_t>(cells_.size());
  samples_.reserve(3 * cells_.size() + 3 * quads.size());
  for (std::uint32_t i = 0; i < count; ++i) {
    Sample vertex;
    vertex.vertices.fill(i);
    vertex.parts = {1, 0, 0, 0};
    samples_.push_back(vertex);
    if (sparse_) continue;
    for (const std::size_t face : {1u, 3u, 5u}) {
      const std::uint32_t j = frame_.around.across[i][face];
      if (j == i) continue;
      Sample edge;
      edge.vertices = {i, j, i, i};
      edge.parts = {0.5f, 0.5f, 0, 0};
      samples_.push_back(edge);
    }
  }
  first_of_quads_ = samples_.size();
  for (const Quad& quad : quads) {
    Sample part;
    part.vertices = quad;
    samples_.insert(samples_.end(), 3, part);
  }
  // Who is in which sample.
  const auto vertices = [&](const Sample& s, std::size_t number) -> std::size_t {
    return number >= first_of_quads_ ? 4 : s.parts[1] > 0 ? 2 : 1;
  };
  first_use_.assign(cells_.size() + 1, 0);
  for (std::size_t s = 0; s < samples_.size(); ++s) {
    for (std::size_t v = 0; v < vertices(samples_[s], s); ++v) ++first_use_[samples_[s].vertices[v] + 1];
  }
  for (std::size_t i = 0; i < cells_.size(); ++i) first_use_[i + 1] += first_use_[i];
  uses_.resize(first_use_.back());
  std::vector<std::uint32_t> next(first_use_.begin(), first_use_.end() - 1);
  for (std::size_t s = 0; s < samples_.size(); ++s) {
    for (std::size_t v = 0; v < vertices(samples_[s], s); ++v)
      uses_[next[samples_[s].vertices[v]]++] = {static_cast<std::uint32_t>(s), static_cast<std::uint32_t>(v)};
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

// The triangles of a quad: split along its shorter diagonal, as Surface::triangles() does.
void SurfaceFit::splitQuads(std::span<const Quad> quads) {
  forRuns(parallel_, quads.size(), kPerTask, [&](std::size_t first, std::size_t end) {
    for (std::size_t q = first; q < end; ++q) {
      std::array<float, 2> square{};
      for (std::size_t d = 0; d < 2; ++d) {
        const Vec3f &a = places_[quads[q][d]], &b = places_[quads[q][d + 2]];
        for (std::size_t k = 0; k < 3; ++k)
          square[d] +=
              static_cast<float>(grid_.spacing[k] * grid_.spacing[k]) * (a[k] - b[k]) * (a[k] - b[k]);
      }
      constexpr float kThird = 1.0f / 3;
      Sample* const parts = &samples_[first_of_quads_ + 3 * q];
      if (square[0] <= square[1]) {
        parts[0].parts = {0.5f, 0, 0.5f, 0};
        parts[1].parts = {kThird, kThird, kThird, 0};
        parts[2].parts = {kThird, 0, kThird, kThird};
      } else {
        parts[0].parts = {0, 0.5f, 0, 0.5f};
        parts[1].parts = {kThird, kThird, 0, kThird};
        parts[2].parts = {0, kThird, kThird, kThird};
      }
    }
  });
}

void SurfaceFit::linearise() {
  for (std::uint32_t i = 0; i < places_.size(); ++i) places_[i] = place(i);
  splitQuads(quads_);
  forRuns(parallel_, samples_.size(), kPerTask, [&](std::size_t first, std::size_t end) {
    for (std::size_t s = first; s < end; ++s) {
      Sample& sample = samples_[s];
      Vec3f at{};
      for (std::size_t v = 0; v < 4; ++v) {
        const Vec3f& vertex = places_[sample.vertices[v]];
        for (std::size_t k = 0; k < 3; ++k) at[k] += sample.parts[v] * vertex[k];
      }
      const FitTarget::Near near = target_.near(at, sample.vertices);
      sample.distance = near.distance;
      sample.slopes.fill(0);
      if (!(std::abs(sample.distance) < kDoubtful)) {
        sample.distance = 0;
        continue;
      }
      for (std::size_t v = 0; v < 4; ++v)
        sample.slopes[v] = sample.parts[v] * dot(near.normal, normals_[sample.vertices[v]]);
    }
  });
}

SurfaceFit::Bowl SurfaceFit::bowl(std::uint32_t i) const {
  float curvature = 0, slope = 0;
  for (std::uint32_t u = first_use_[i]; u < first_use_[i + 1]; ++u) {
    const Sample& sample = samples_[uses_[u].sample];
    const float c = sample.slopes[uses_[u].vertex];
    curvature += c * c;
    slope += c * sample.distance;
  }
  if (curvature < 0.01f) return {start_[i], 0.01f};
  const float best = heights_[i] - slope / curvature;
  return {std::clamp(best, start_[i] - kReach, start_[i] + kReach), curvature};
}

void SurfaceFit::set(std::uint32_t i, float height) {
  const float change = height - heights_[i];
  if (change == 0) return;
  heights_[i] = height;
  for (std::uint32_t u = first_use_[i]; u < first_use_[i + 1]; ++u) {
    Sample& sample = samples_[uses_[u].sample];
    sample.distance += change * sample.slopes[uses_[u].vertex];
  }
}

void SurfaceFit::optimise(int rounds, int sweeps) {
  for (int round = 0; round < rounds; ++round) {
    linearise();
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
