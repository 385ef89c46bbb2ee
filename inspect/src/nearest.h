// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/inspect/distance.h>

#include "src/embree.h"

namespace isoreel::inspect {

/// Squared distance of `p` to the triangle's nearest point; any triangle will do, also one without area.
double squaredDistance(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c);

/// Finds the exact distance of a point to the nearest triangle of a mesh: Embree's tree chooses the
/// candidates with a margin for its single precision, and squaredDistance() decides. Thread-safe. The mesh
/// must outlive it and have a triangle.
class NearestTriangle {
 public:
  explicit NearestTriangle(const Mesh& mesh);

  /// Squared distance of `p`, if it is above `enough`; else some value that is at most `enough` (a query ends
  /// early when the answer no longer matters). `hint` is a triangle likely to be near, 0 if unknown, and
  /// becomes the nearest one found: it makes the search quicker and never changes an answer above `enough`.
  double squared(const Vec3d& p, std::uint32_t& hint, double enough = 0) const;

 private:
  static bool visit(RTCPointQueryFunctionArguments* arguments);
  double squaredTo(std::uint32_t triangle, const Vec3d& p) const;

  const Mesh& mesh_;
  double margin_;  // of single precision, at the size of the mesh's coordinates
  TriangleScene scene_;
};

}  // namespace isoreel::inspect
