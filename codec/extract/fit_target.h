// SPDX-License-Identifier: BSD-3-Clause
// The surfaces for which heights may be chosen. Encoder only; floating point.
#pragma once

#include <isoreel/codec/surface.h>

#include <vector>

#include "extract/volume_field.h"

namespace isoreel {

/// A surface that decoded meshes should lie close to. Places and distances are in cells.
class FitTarget {
 public:
  /// The signed distance of a place, outside positive, as it is around there: it grows by one along `normal`,
  /// which is 0 where nothing is known.
  struct Near {
    float distance = 0;
    Vec3f normal{};
  };

  virtual ~FitTarget() = default;
  /// `vertices`: of the mesh that is fitted, those whose mean the place is.
  virtual Near near(const Vec3f& place, const std::array<std::uint32_t, 4>& vertices) const = 0;
  /// The height of vertex i, of this cell, above a point along a normal at which it is on the surface or
  /// comes nearest to it.
  virtual float height(std::uint32_t i, const Cell& cell, const Vec3f& point, const Vec3f& normal) const = 0;
};

/// The volume's own isosurface.
class VolumeTarget final : public FitTarget {
 public:
  /// `quick`: height() follows the gradient where that leads to a crossing, be it the first or not.
  VolumeTarget(const VolumeField& field, bool quick) : field_(field), quick_(quick) {}
  Near near(const Vec3f& place, const std::array<std::uint32_t, 4>& vertices) const override;
  /// Where the normal crosses the isosurface first, or comes nearest to it inside the cell.
  float height(std::uint32_t i, const Cell& cell, const Vec3f& point, const Vec3f& normal) const override;

 private:
  bool follow(const Cell& cell, const Vec3f& point, const Vec3f& normal, float& height) const;

  const VolumeField& field_;
  const bool quick_;
};

/// The mesh that was extracted: the same faces, the vertices where the extractor had them.
class MeshTarget final : public FitTarget {
 public:
  /// `vertices`: from their cells' corners, 1/16384. `quads` are the dual mesh of `cells`.
  MeshTarget(std::span<const Cell> cells, std::span<const std::array<std::int32_t, 3>> vertices,
             std::span<const Quad> quads, const Grid& grid);
  /// Looks at the triangles around the given vertices.
  Near near(const Vec3f& place, const std::array<std::uint32_t, 4>& vertices) const override;
  /// At the height of the extractor's vertex.
  float height(std::uint32_t i, const Cell& cell, const Vec3f& point, const Vec3f& normal) const override;

 private:
  std::vector<Vec3f> places_;
  std::vector<Triangle> triangles_;
  std::vector<std::uint32_t> first_;   // in around_, of each vertex
  std::vector<std::uint32_t> around_;  // triangles that have it
};

}  // namespace isoreel
