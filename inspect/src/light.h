// SPDX-License-Identifier: BSD-3-Clause
// What the pictures look like: colours, lights and tone. Colours are linear, 1 is the white of paper.
#pragma once

#include "src/view.h"

namespace isoreel::inspect {

/// A place on the surface as the shader sees it. Vectors are unit length, in the stage.
struct Spot {
  Vec3d normal;  // on the viewer's side
  Vec3d to_viewer;
  Vec3d colour;  // of the material
  bool inner;    // the viewer sees the surface from inside
  double sky;    // how much of the hemisphere above it is open, 0 to 1
  double key;    // how much of the key light arrives, 0 to 1
};

/// Of a surface that no attribute colours, from outside and from inside.
Vec3d materialColour(bool inner);

/// Three lights that go with the camera: key from the upper left, fill from the right, rim from behind; and a
/// sky.
class Lights {
 public:
  explicit Lights(const View& view);
  /// Unit direction towards the key light.
  const Vec3d& key() const { return key_; }
  Vec3d shade(const Spot& spot) const;

 private:
  Vec3d key_, fill_, rim_;
};

/// The backdrop at `height` of the picture, 0 below to 1 above.
Vec3d backdrop(double height);
/// Brings any brightness into 0 to 1, mid-tones unchanged.
Vec3d tone(const Vec3d& colour);
/// sRGB in eight bits, of 0 to 1, and back.
std::uint8_t encodeSrgb(double linear);
double decodeSrgb(std::uint8_t encoded);

}  // namespace isoreel::inspect
