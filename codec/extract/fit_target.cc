// SPDX-License-Identifier: BSD-3-Clause
#include "extract/fit_target.h"

#include <cmath>

namespace isoreel {
namespace {

constexpr float kFarthest = 1.25f;  // that is looked along a normal, in cells
constexpr float kProbe = 0.125f;
constexpr float kNear = 0.002f;       // of the change over a probe: no need to come nearer
constexpr int kSteps = 3;             // of following the gradient
constexpr float kNearEnough = 0.02f;  // cells: the last step is a small one
constexpr float kTouching = 1e-4f;    // cells: nearer than this has no direction

Vec3f operator-(const Vec3f& a, const Vec3f& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Vec3f along(const Vec3f& a, const Vec3f& direction, float way) {
  return {a[0] + way * direction[0], a[1] + way * direction[1], a[2] + way * direction[2]};
}
Vec3f cross(const Vec3f& a, const Vec3f& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// The point of a triangle that is nearest to p, by the region of the triangle's plane it is in (Ericson,
/// Real-Time Collision Detection, 5.1.5).
Vec3f nearestOf(const Vec3f& p, const Vec3f& a, const Vec3f& b, const Vec3f& c) {
  const Vec3f ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const float d1 = dot(ab, ap), d2 = dot(ac, ap), d3 = dot(ab, bp), d4 = dot(ac, bp), d5 = dot(ab, cp),
              d6 = dot(ac, cp);
  if (d1 <= 0 && d2 <= 0) return a;
  if (d3 >= 0 && d4 <= d3) return b;
  if (d6 >= 0 && d5 <= d6) return c;
  const float vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return along(a, ab, d1 / (d1 - d3));
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return along(a, ac, d2 / (d2 - d6));
  if (va <= 0 && d4 >= d3 && d5 >= d6) return along(b, c - b, (d4 - d3) / ((d4 - d3) + (d5 - d6)));
  const float sum = va + vb + vc;
  if (sum == 0) return a;
  return along(along(a, ab, vb / sum), ac, vc / sum);
}

/// Or nearly.
bool inCell(const Cell& cell, const Vec3f& p) {
  const std::array<std::uint16_t, 3> corner{cell.x, cell.y, cell.z};
  for (std::size_t k = 0; k < 3; ++k) {
    const auto low = static_cast<float>(corner[k]);
    if (!(p[k] >= low - kProbe && p[k] <= low + 1 + kProbe)) return false;
  }
  return true;
}

}  // namespace

FitTarget::Near VolumeTarget::near(const Vec3f& place, const std::array<std::uint32_t, 4>&) const {
  const VolumeField::Sample field = field_.at(place);
  const float square = dot(field.gradient, field.gradient);
  if (!(square > 0)) return {};
  const float inverse = 1 / std::sqrt(square);
  return {field.value * inverse,
          {field.gradient[0] * inverse, field.gradient[1] * inverse, field.gradient[2] * inverse}};
}

// Newton's method.
bool VolumeTarget::follow(const Cell& cell, const Vec3f& point, const Vec3f& normal, float& height) const {
  VolumeField::Sample here = field_.at(point);
  height = 0;
  for (int step = 0; step < kSteps; ++step) {
    const float slope = dot(here.gradient, normal);
    height -= here.value / slope;
    const Vec3f p = along(point, normal, height);
    if (!inCell(cell, p)) return false;  // nor is what is not a number
    here = field_.at(p);
    if (std::abs(here.value) < kNearEnough * std::abs(slope)) {
      height -= here.value / slope;
      return true;
    }
  }
  return false;
}

float VolumeTarget::height(std::uint32_t, const Cell& cell, const Vec3f& point, const Vec3f& normal) const {
  if (float height = 0; quick_ && follow(cell, point, normal, height)) return height;
  const float here = field_.at(point).value;
  float nearest = 0, least = std::abs(here);
  std::array<float, 2> last{here, here};
  for (float way = kProbe; way <= kFarthest; way += kProbe) {
    bool left = true;
    for (std::size_t side = 0; side < 2; ++side) {
      const float sign = side == 0 ? 1.0f : -1.0f;
      const Vec3f p = along(point, normal, sign * way);
      if (!inCell(cell, p)) continue;
      left = false;
      const float value = field_.at(p).value;
      if ((value < 0) != (last[side] < 0)) {
        float a = way - kProbe, b = way, fa = last[side], fb = value;
        const float near = kNear * std::abs(fa - fb);
        for (int step = 0; step < 4; ++step) {  // false position, the kept end weighed down
          const float m = a + (b - a) * (fa / (fa - fb));
          const float fm = field_.at(along(point, normal, sign * m)).value;
          if (std::abs(fm) < near) return sign * m;
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

MeshTarget::MeshTarget(std::span<const Cell> cells, std::span<const std::array<std::int32_t, 3>> vertices,
                       std::span<const Quad> quads, const Grid& grid)
    : first_(cells.size() + 1) {
  Surface surface;
  surface.grid = grid;
  for (auto& d : surface.grid.direction) d = 0;  // as quads are split in the world, but for turns
  for (std::size_t k = 0; k < 3; ++k) surface.grid.direction[4 * k] = 1;
  surface.quads.assign(quads.begin(), quads.end());
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const std::array<std::uint16_t, 3> corner{cells[i].x, cells[i].y, cells[i].z};
    Vec3f place;
    GridPosition position;
    for (std::size_t k = 0; k < 3; ++k) {
      position[k] = corner[k] * kCell + vertices[i][k];
      place[k] = static_cast<float>(position[k]) / kCell;
    }
    places_.push_back(place);
    surface.vertices.push_back(position);
  }
  triangles_ = surface.triangles();
  for (const Triangle& t : triangles_) {
    for (const std::uint32_t i : t) ++first_[i + 1];
  }
  for (std::size_t i = 0; i < cells.size(); ++i) first_[i + 1] += first_[i];
  around_.resize(first_.back());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
    for (const std::uint32_t i : triangles_[t]) around_[next[i]++] = t;
  }
}

FitTarget::Near MeshTarget::near(const Vec3f& place, const std::array<std::uint32_t, 4>& vertices) const {
  float least = 1e30f;
  Vec3f way{};
  const Triangle* nearest = nullptr;
  for (std::size_t v = 0; v < 4; ++v) {
    if (v > 0 && vertices[v] == vertices[0]) continue;
    for (std::uint32_t k = first_[vertices[v]]; k < first_[vertices[v] + 1]; ++k) {
      const Triangle& t = triangles_[around_[k]];
      const Vec3f from = place - nearestOf(place, places_[t[0]], places_[t[1]], places_[t[2]]);
      const float square = dot(from, from);
      if (square >= least) continue;
      least = square;
      way = from;
      nearest = &t;
    }
  }
  if (nearest == nullptr) return {};
  const Vec3f& a = places_[(*nearest)[0]];
  const Vec3f face = cross(places_[(*nearest)[1]] - a, places_[(*nearest)[2]] - a);
  const float distance = std::sqrt(least), area = std::sqrt(dot(face, face));
  const float side = dot(way, face) < 0 ? -1.0f : 1.0f;
  if (distance > kTouching)
    return {side * distance, {side * way[0] / distance, side * way[1] / distance, side * way[2] / distance}};
  if (area == 0) return {};
  return {0, {face[0] / area, face[1] / area, face[2] / area}};
}

float MeshTarget::height(std::uint32_t i, const Cell&, const Vec3f& point, const Vec3f& normal) const {
  return dot(places_[i] - point, normal);
}

}  // namespace isoreel
