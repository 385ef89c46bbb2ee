// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "inter/reference_field.h"

namespace isoreel {

/// The d²-tree of Mitra et al. 2004 over the reference surface: a quadratic approximant of the squared
/// distance for each grid cell near it, fitted when it is first asked for to 27 samples at twice the grid's
/// resolution (paper, section 4.2 and appendix A). Translations only move the points, so one least-squares
/// inverse serves all cells.
class DistanceTree {
 public:
  /// d²(p) ≈ ½ pᵀ H p + gᵀ p + c for p in cells from the cell's middle; `near` is false when the surface is
  /// further than about a cell.
  struct Quadratic {
    Eigen::Matrix3f hessian;
    Eigen::Vector3f gradient;
    float constant = 0;
    bool near = false;

    float at(const Eigen::Vector3f& p) const {
      return 0.5f * p.dot(hessian * p) + gradient.dot(p) + constant;
    }
  };

  explicit DistanceTree(const ReferenceField& field) : field_(field) {}

  /// The approximant of the cell that holds a place (in cells, anywhere), which it returns relative to the
  /// cell's middle.
  const Quadratic& around(const Eigen::Vector3f& place, Eigen::Vector3f& inside);

 private:
  float sample(const std::array<std::int32_t, 3>& half_node);

  ReferenceField::Cursor field_;
  BrickMap cells_, samples_;
  std::vector<Quadratic> quadratics_;
  std::vector<float> squares_;
};

}  // namespace isoreel
