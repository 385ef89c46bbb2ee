// SPDX-License-Identifier: BSD-3-Clause
#include "src/view.h"

#include <algorithm>
#include <numbers>

namespace isoreel::inspect {
namespace {

constexpr double kMargin = 1.03;  // air around the box

double radians(double degrees) { return degrees * std::numbers::pi / 180; }

}  // namespace

View::View(const Camera& camera, const Box& frame, int width, int height, double pixel_aspect)
    : aspect_(std::clamp(pixel_aspect, 1e-3, 1e3)), half_width_(width / 2.0), half_height_(height / 2.0) {
  centre_ = (frame.min + frame.max) * 0.5;
  const Vec3d half = (frame.max - frame.min) * 0.5;
  scale_ = length(half) > 0 ? 1 / length(half) : 1;
  ground_ = -half[2] * scale_;

  const double azimuth = radians(camera.azimuth);
  const double elevation = radians(std::clamp(camera.elevation, -90.0, 90.0));
  right_ = {std::cos(azimuth), std::sin(azimuth), 0};
  ahead_ = {-std::sin(azimuth), std::cos(azimuth), 0};
  forward_ = ahead_ * std::cos(elevation) + Vec3d{0, 0, -std::sin(elevation)};
  up_ = cross(right_, forward_);

  // The field of view is that of the shorter side, before the zoom.
  const double tangent = std::tan(radians(std::clamp(camera.field_of_view, 1.0, 150.0)) / 2);
  const double half_span = half_width_ * aspect_;  // in heights of a pixel
  const double shorter = std::min(half_span, half_height_);
  const double wide = tangent * half_span / shorter, high = tangent * half_height_ / shorter;
  // A turning box sweeps a cylinder; the square around it is aligned with the camera, so the fit is the same
  // from everywhere.
  const double radius = std::hypot(half[0], half[1]);
  std::array<Vec3d, 8> corners;  // to the right, up and forward from the box's centre
  double distance = 1e-3;
  for (unsigned i = 0; i < 8; ++i) {
    const Vec3d corner{i & 1 ? 1.0 : -1.0, i & 2 ? 1.0 : -1.0, i & 4 ? 1.0 : -1.0};
    const Vec3d p = camera.turning ? (right_ * (corner[0] * radius) + ahead_ * (corner[1] * radius) +
                                      Vec3d{0, 0, corner[2] * half[2]}) *
                                         scale_
                                   : half * scale_ * corner;
    corners[i] = {dot(p, right_), dot(p, up_), dot(p, forward_)};
    distance = std::max(
        distance, std::max(std::abs(corners[i][0]) / wide, std::abs(corners[i][1]) / high) - corners[i][2]);
  }
  eye_ = forward_ * -distance;

  // Near corners look larger, so the box is not in the middle yet: shift the lens, and come as close as it
  // then allows.
  Vec3d low{1e9, 1e9, 0}, top{-1e9, -1e9, 0};
  for (const Vec3d& corner : corners) {
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double seen = corner[axis] / std::max(distance + corner[2], 1e-6);
      low[axis] = std::min(low[axis], seen);
      top[axis] = std::max(top[axis], seen);
    }
  }
  shift_ = (low + top) * 0.5;
  const double fit =
      std::max({(top[0] - low[0]) / (2 * half_span), (top[1] - low[1]) / (2 * half_height_), 1e-9});
  pixel_ = kMargin * fit / std::max(camera.zoom, 1e-3);
}

Vec3d View::ray(double x, double y) const {
  return normalized(forward_ + right_ * (shift_[0] + (x - half_width_) * aspect_ * pixel_) +
                    up_ * (shift_[1] + (half_height_ - y) * pixel_));
}

Vec3d View::project(const Vec3d& stage) const {
  const Vec3d seen = stage - eye_;
  const double depth = std::max(dot(seen, forward_), 1e-6);
  return {half_width_ + (dot(seen, right_) / depth - shift_[0]) / (aspect_ * pixel_),
          half_height_ - (dot(seen, up_) / depth - shift_[1]) / pixel_, 0};
}

}  // namespace isoreel::inspect
