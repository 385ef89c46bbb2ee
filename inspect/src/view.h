// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/inspect/render.h>

#include "src/vec.h"

namespace isoreel::inspect {

/// A perspective camera. It works in the *stage*: the world moved and scaled so that the frame's box has its
/// centre at the origin and half its diagonal is 1 (single precision then suffices wherever the data lies).
class View {
 public:
  /// `frame` must not be empty. `pixel_aspect`: width of a pixel by its height. Settings out of range are
  /// brought into it.
  View(const Camera& camera, const Box& frame, int width, int height, double pixel_aspect = 1);

  Vec3d toStage(const Vec3d& world) const { return (world - centre_) * scale_; }
  /// Unit direction of the ray through pixel coordinates (x, y), from the upper left corner.
  Vec3d ray(double x, double y) const;
  /// Pixel coordinates (x, y, 0) of a point of the stage in front of the eye; far outside for one behind it.
  Vec3d project(const Vec3d& stage) const;

  const Vec3d& eye() const { return eye_; }
  const Vec3d& right() const { return right_; }
  /// Horizontal, away from the viewer.
  const Vec3d& ahead() const { return ahead_; }
  /// Height of the box's bottom.
  double ground() const { return ground_; }

 private:
  Vec3d centre_;
  double scale_;
  double ground_;
  Vec3d right_, up_, forward_, ahead_, eye_;
  Vec3d shift_;    // of the picture's middle from where the camera looks, to the right and up, as a tangent
  double pixel_;   // tangent of the angle of one pixel's height
  double aspect_;  // its width by its height
  double half_width_, half_height_;  // of the picture, in pixels
};

}  // namespace isoreel::inspect
