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
/// diagonals, centroids of triangles), as a function of the vertices' heights: linear around the heights at
/// linearise(). What is kept of it are its derivatives, two for each vertex and one for each pair of
/// a quad's corners, so that nobody goes through the samples again.
class SurfaceFit {
 public:
  /// Everything must outlive it; `quads` are the dual mesh of `cells`. `sparse`: at
  /// the vertices and the quads' middles only.
  SurfaceFit(const FitTarget& target, std::span<const Cell> cells, const HeightFrame& frame,
             std::span<const Quad> quads, const Grid& grid, bool sparse, const ParallelFor& parallel);

  /// Heights in cells.
  const std::vector<float>& heights() const { return heights_; }
  /// Where a vertex is now, in its cell, 1/16384 from corner 0.
  std::array<std::int32_t, 3> vertex(std::uint32_t i) const;
  /// Puts every vertex where its normal meets the target.
  void toSurface();
  /// Moves heights towards where the sum of squares is least: so many sweeps.
  void optimise(int rounds, int sweeps);

  /// What a vertex's height costs while all others stay: curvature · (height - best)² and a constant. `best`
  /// is not far from toSurface()'s.
  struct Bowl {
    float best = 0;
    float curvature = 0;
  };
  Bowl bowl(std::uint32_t i) const;
  void set(std::uint32_t i, float height);
  void setAll(const std::vector<float>& heights);
  /// Looks how far samples are from the target. Where that is known it is near enough, at whatever heights:
  /// looking again took a tenth of the time of encoding, and gave files 1 % larger.
  void linearise();

 private:
  /// Half the derivatives of the sum of squares over one height.
  struct Slopes {
    float first = 0, second = 0;
  };
  /// A vertex's corner of a quad: what the quad's samples say of it, and of it and each of the other corners.
  struct Use {
    struct Other {
      std::uint32_t vertex;
      float slope;  // half the derivative over both heights
    };
    Slopes own;
    std::array<Other, 3> others;
  };
  class QuadSum;

  void lookAgain();
  void findUses();
  Vec3f place(std::uint32_t i) const;
  bool splitAlongFirst(const Quad& quad) const;

  const FitTarget& target_;
  std::span<const Cell> cells_;
  std::span<const Quad> quads_;
  const std::array<float, 3> squared_spacing_;
  const bool sparse_;
  bool linear_ = false;  // the derivatives are known
  const ParallelFor& parallel_;
  std::vector<std::uint32_t> first_use_;              // in uses_, of each vertex
  std::vector<Use> uses_;                             // vertex by vertex
  std::vector<std::array<std::uint32_t, 4>> use_of_;  // by quad and corner
  std::vector<Slopes> slopes_;                        // of vertices
  std::vector<float> heights_, start_;
  std::vector<Vec3f> points_, places_, normals_;  // places_: at their heights, in linearise()
};

}  // namespace isoreel
