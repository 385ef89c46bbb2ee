// SPDX-License-Identifier: BSD-3-Clause
#include "src/nearest.h"

#include <algorithm>
#include <limits>

#include "src/vec.h"

namespace isoreel::inspect {
namespace {

double largestCoordinate(const Mesh& mesh) {
  double largest = 1;
  for (const auto& p : mesh.points) {
    for (const float c : p) largest = std::max(largest, std::abs(static_cast<double>(c)));
  }
  return largest;
}

double squaredToSegment(const Vec3d& ap, const Vec3d& ab) {
  const double along = dot(ap, ab);
  const double whole = dot(ab, ab);
  const double t = along <= 0 ? 0 : along >= whole ? 1 : along / whole;
  const Vec3d rest = ap - ab * t;
  return dot(rest, rest);
}

struct Search {
  const NearestTriangle& nearest;
  Vec3d p;
  double best;
  std::uint32_t triangle;
};

// The sphere in which Embree must look to find every triangle nearer than the best so far: boxes are tested
// in single precision against a point rounded to it. What rounding the point costs is in proportion to its
// coordinates, so it is covered by the mesh's margin and, for a point far outside the mesh, by the factor.
float radiusOf(double squared, double margin) {
  return static_cast<float>(std::sqrt(squared) * (1 + 4e-6) + margin);
}

}  // namespace

double squaredDistance(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  const Vec3d ab = b - a, bc = c - b, ca = a - c;
  const Vec3d ap = p - a, bp = p - b, cp = p - c;
  // From single-precision corners this normal is all but exact, however thin the triangle: so are the sides
  // below.
  const Vec3d n = cross(ab, bc);
  const double nn = dot(n, n);
  const bool flat = nn == 0;
  const bool beyond_ab = flat || dot(cross(ab, ap), n) < 0;
  const bool beyond_bc = flat || dot(cross(bc, bp), n) < 0;
  const bool beyond_ca = flat || dot(cross(ca, cp), n) < 0;
  if (!beyond_ab && !beyond_bc && !beyond_ca) {
    const double height = dot(ap, n);
    return height * height / nn;
  }
  // Over a convex outline, the nearest point lies on an edge that has p on its outer side.
  double best = std::numeric_limits<double>::infinity();
  if (beyond_ab) best = std::min(best, squaredToSegment(ap, ab));
  if (beyond_bc) best = std::min(best, squaredToSegment(bp, bc));
  if (beyond_ca) best = std::min(best, squaredToSegment(cp, ca));
  return best;
}

NearestTriangle::NearestTriangle(const Mesh& mesh)
    : mesh_(mesh),
      margin_(1e-6 * largestCoordinate(mesh)),
      scene_(mesh.points, mesh.triangles, &NearestTriangle::visit, nullptr) {}

double NearestTriangle::squaredTo(std::uint32_t triangle, const Vec3d& p) const {
  const Triangle& corners = mesh_.triangles[triangle];
  return squaredDistance(p, toDouble(mesh_.points[corners[0]]), toDouble(mesh_.points[corners[1]]),
                         toDouble(mesh_.points[corners[2]]));
}

bool NearestTriangle::visit(RTCPointQueryFunctionArguments* arguments) {
  Search& search = *static_cast<Search*>(arguments->userPtr);
  const double squared = search.nearest.squaredTo(arguments->primID, search.p);
  if (squared >= search.best) return false;
  search.best = squared;
  search.triangle = arguments->primID;
  arguments->query->radius = radiusOf(squared, search.nearest.margin_);
  return true;
}

double NearestTriangle::squared(const Vec3d& p, std::uint32_t& hint, double enough) const {
  Search search{*this, p, squaredTo(hint, p), hint};
  if (search.best <= enough) return search.best;
  const auto rounded = toFloat(p);
  RTCPointQuery query{rounded[0], rounded[1], rounded[2], 0.f, radiusOf(search.best, margin_)};
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(scene_.get(), &query, &context, nullptr, &search);
  hint = search.triangle;
  return search.best;
}

}  // namespace isoreel::inspect
