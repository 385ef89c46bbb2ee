// SPDX-License-Identifier: BSD-3-Clause
#include "extract/surface_fit.h"

#include <cmath>

namespace isoreel {
namespace {

constexpr std::size_t kPerTask = 4096;
constexpr float kFarthest = 1.25f;  // that toSurface() looks along the normal, in cells
constexpr float kProbe = 0.125f;
constexpr float kReach =
    0.2f;  // how far from the isosurface a vertex may be wanted: the distance is linear near it only
constexpr float kDoubtful = 0.6f;  // a sample that is farther from the isosurface says nothing

}  // namespace

SurfaceFit::SurfaceFit(const VolumeField& field, std::span<const Cell> cells, const HeightFrame& frame,
                       std::span<const Quad> quads, const Grid& grid, const ParallelFor& parallel)
    : field_(field),
      cells_(cells),
      frame_(frame),
      quads_(quads),
      grid_(grid),
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

// The triangles of a quad: split along its shorter diagonal, as Surface::triangles() does.
void SurfaceFit::splitQuads(std::span<const Quad> quads) {
  parallel_((quads.size() + kPerTask - 1) / kPerTask, [&](std::size_t task) {
    const std::size_t end = std::min(quads.size(), (task + 1) * kPerTask);
    for (std::size_t q = task * kPerTask; q < end; ++q) {
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
  parallel_((samples_.size() + kPerTask - 1) / kPerTask, [&](std::size_t task) {
    const std::size_t end = std::min(samples_.size(), (task + 1) * kPerTask);
    for (std::size_t s = task * kPerTask; s < end; ++s) {
      Sample& sample = samples_[s];
      Vec3f at{};
      for (std::size_t v = 0; v < 4; ++v) {
        const Vec3f& vertex = places_[sample.vertices[v]];
        for (std::size_t k = 0; k < 3; ++k) at[k] += sample.parts[v] * vertex[k];
      }
      const VolumeField::Sample field = field_.at(at);
      const float square = dot(field.gradient, field.gradient);
      const float inverse = square > 0 ? 1 / std::sqrt(square) : 0;
      sample.distance = field.value * inverse;
      sample.slopes.fill(0);
      if (!(std::abs(sample.distance) < kDoubtful) || inverse == 0) {
        sample.distance = 0;
        continue;
      }
      for (std::size_t v = 0; v < 4; ++v)
        sample.slopes[v] = sample.parts[v] * inverse * dot(field.gradient, normals_[sample.vertices[v]]);
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
  heights_[i] = height;
  for (std::uint32_t u = first_use_[i]; u < first_use_[i + 1]; ++u) {
    Sample& sample = samples_[uses_[u].sample];
    sample.distance += change * sample.slopes[uses_[u].vertex];
  }
}

void SurfaceFit::optimise(int rounds) {
  for (int round = 0; round < rounds; ++round) {
    linearise();
    for (int sweep = 0; sweep < 2; ++sweep) {
      for (std::uint32_t i = 0; i < heights_.size(); ++i) set(i, bowl(i).best);
    }
  }
}

float SurfaceFit::crossing(std::uint32_t i) const {
  const std::array<std::uint16_t, 3> corner{cells_[i].x, cells_[i].y, cells_[i].z};
  const auto at = [&](float h) {
    Vec3f p = points_[i];
    for (std::size_t k = 0; k < 3; ++k) p[k] += h * normals_[i][k];
    return p;
  };
  const auto inCell = [&](const Vec3f& p) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (p[k] < static_cast<float>(corner[k]) - kProbe || p[k] > static_cast<float>(corner[k]) + 1 + kProbe)
        return false;
    }
    return true;
  };
  const float here = field_.at(points_[i]).value;
  float nearest = 0, least = std::abs(here);
  std::array<float, 2> last{here, here};
  for (float way = kProbe; way <= kFarthest; way += kProbe) {
    bool left = true;
    for (std::size_t side = 0; side < 2; ++side) {
      const float sign = side == 0 ? 1.0f : -1.0f;
      const Vec3f p = at(sign * way);
      if (!inCell(p)) continue;
      left = false;
      const float value = field_.at(p).value;
      if ((value < 0) != (last[side] < 0)) {
        float a = way - kProbe, b = way, fa = last[side], fb = value;
        for (int step = 0; step < 4; ++step) {  // false position, the kept end weighed down
          const float m = a + (b - a) * (fa / (fa - fb));
          const float fm = field_.at(at(sign * m)).value;
          if ((fm < 0) == (fa < 0)) {
            a = m;
            fa = fm;
            fb /= 2;
          } else {
            b = m;
            fb = fm;
            fa /= 2;
          }
        }
        const float height = sign * (a + (b - a) * (fa / (fa - fb)));
        return std::isfinite(height) ? height : sign * way;
      }
      last[side] = value;
      if (std::abs(value) < least) {
        least = std::abs(value);
        nearest = sign * way;
      }
    }
    if (left) break;
  }
  return nearest;
}

void SurfaceFit::toSurface() {
  parallel_((heights_.size() + kPerTask - 1) / kPerTask, [&](std::size_t task) {
    const std::size_t end = std::min(heights_.size(), (task + 1) * kPerTask);
    for (std::size_t i = task * kPerTask; i < end; ++i) start_[i] = crossing(static_cast<std::uint32_t>(i));
  });
  heights_ = start_;
}

}  // namespace isoreel
