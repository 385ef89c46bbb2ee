// SPDX-License-Identifier: BSD-3-Clause
// Heights for which the mesh, not only its vertices, lies close to a surface. Encoder only;
// floating point.
#pragma once

#include <isoreel/base/parallel.h>
#include <isoreel/codec/surface.h>

#include <vector>

#include "extract/fit_target.h"
#include "intra/height_stream.h"

namespace isoreel {

/// The squared distance of the mesh to the target at samples of it (vertices, middles of edges and
/// diagonals, centroids of triangles), as a function of the vertices' heights: linear around the heights of
/// the last linearise().
class SurfaceFit {
 public:
  /// Everything must outlive it; `quads` are the dual mesh of `cells`. `sparse`: without the middles of
  /// edges.
  SurfaceFit(const FitTarget& target, std::span<const Cell> cells, const HeightFrame& frame,
             std::span<const Quad> quads, const Grid& grid, bool sparse, const ParallelFor& parallel);

  /// Heights in cells.
  const std::vector<float>& heights() const { return heights_; }
  /// Where a vertex is now, in its cell, 1/16384 from corner 0.
  std::array<std::int32_t, 3> vertex(std::uint32_t i) const;
  /// Puts every vertex where its normal meets the target.
  void toSurface();
  /// Moves heights towards where the sum of squares is least: so many rounds of a linearise() and sweeps.
  void optimise(int rounds, int sweeps);

  /// What a vertex's height costs while all others stay: curvature · (height - best)² and a constant. `best`
  /// is not far from toSurface()'s.
  struct Bowl {
    float best = 0;
    float curvature = 0;
  };
  Bowl bowl(std::uint32_t i) const;
  void set(std::uint32_t i, float height);
  void setAll(const std::vector<float>& heights) { heights_ = heights; }
  void linearise();

 private:
  /// A weighted mean of up to four vertices.
  struct Sample {
    std::array<std::uint32_t, 4> vertices{};
    std::array<float, 4> parts{};
    std::array<float, 4> slopes{};  // of the distance over their heights
    float distance = 0;
  };
  /// A vertex's place in a sample.
  struct Use {
    std::uint32_t sample;
    std::uint32_t vertex;
  };

  void makeSamples(std::span<const Quad> quads);
  void splitQuads(std::span<const Quad> quads);
  Vec3f place(std::uint32_t i) const;

  const FitTarget& target_;
  std::span<const Cell> cells_;
  const HeightFrame& frame_;
  std::span<const Quad> quads_;
  const Grid& grid_;
  const bool sparse_;
  const ParallelFor& parallel_;
  std::vector<Sample> samples_;
  std::size_t first_of_quads_ = 0;
  std::vector<std::uint32_t> first_use_;
  std::vector<Use> uses_;
  std::vector<float> heights_, start_;
  std::vector<Vec3f> points_, places_, normals_;  // places_: at their heights, in linearise()
};

}  // namespace isoreel
