// SPDX-License-Identifier: BSD-3-Clause
// Embree's handles as owners, and a committed scene of triangles made of them.
#pragma once

#include <embree3/rtcore.h>
#include <isoreel/codec/surface.h>

#include <memory>
#include <span>
#include <type_traits>

namespace isoreel::inspect {

struct EmbreeRelease {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
  void operator()(RTCGeometry geometry) const { rtcReleaseGeometry(geometry); }
};
template <class Handle>
using EmbreeOwner = std::unique_ptr<std::remove_pointer_t<Handle>, EmbreeRelease>;

/// A bounding volume hierarchy over triangles, on a device of its own; triangle i is primitive i. Queries are
/// thread-safe. Embree builds with its own oneTBB threads, so what the tree looks like may vary between runs:
/// whatever is asked of it must have one answer for every tree.
class TriangleScene {
 public:
  /// Copies the points and triangles. `query` and `filter` may be null (Embree's point query and ray filter
  /// callbacks). Throws std::bad_alloc, as a vector would, when Embree finds no memory.
  TriangleScene(std::span<const std::array<float, 3>> points, std::span<const Triangle> triangles,
                RTCPointQueryFunction query, RTCFilterFunctionN filter);

  RTCScene get() const { return scene_.get(); }

 private:
  EmbreeOwner<RTCDevice> device_;
  EmbreeOwner<RTCScene> scene_;
};

}  // namespace isoreel::inspect
