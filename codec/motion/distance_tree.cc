// SPDX-License-Identifier: BSD-3-Clause
#include "motion/distance_tree.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace isoreel {
namespace {

constexpr float kFar = 2.25f;  // squared: beyond what the field knows
constexpr int kTerms = 10, kSamples = 27;

// Monomials of a quadratic: xx yy zz xy xz yz x y z 1.
Eigen::Matrix<float, kTerms, 1> monomials(const Eigen::Vector3f& p) {
  Eigen::Matrix<float, kTerms, 1> m;
  m << p.x() * p.x(), p.y() * p.y(), p.z() * p.z(), p.x() * p.y(), p.x() * p.z(), p.y() * p.z(), p.x(), p.y(),
      p.z(), 1;
  return m;
}

Eigen::Vector3f samplePlace(int i) {
  return Eigen::Vector3f(static_cast<float>(i % 3 - 1), static_cast<float>(i / 3 % 3 - 1),
                         static_cast<float>(i / 9 - 1)) *
         0.5f;
}

// From the 27 samples of a cell to the ten coefficients, the same for every cell.
const Eigen::Matrix<float, kTerms, kSamples>& leastSquaresInverse() {
  static const Eigen::Matrix<float, kTerms, kSamples> inverse = [] {
    Eigen::Matrix<double, kSamples, kTerms> a;
    for (int i = 0; i < kSamples; ++i) a.row(i) = monomials(samplePlace(i)).cast<double>().transpose();
    const Eigen::Matrix<double, kTerms, kTerms> normal = a.transpose() * a;
    return Eigen::Matrix<float, kTerms, kSamples>((normal.ldlt().solve(a.transpose())).cast<float>());
  }();
  return inverse;
}

}  // namespace

float DistanceTree::sample(const std::array<std::int32_t, 3>& half_node) {
  const std::uint32_t number = samples_.findOrAdd(half_node[0], half_node[1], half_node[2]);
  if (number < squares_.size()) return squares_[number];
  const std::array<std::int32_t, 3> place{half_node[0] * (kCell / 2), half_node[1] * (kCell / 2),
                                          half_node[2] * (kCell / 2)};
  // The mean of the nodes that it lies between, on a node's own lattice plane only of those in it: that the
  // rest of the cell above is not known must not matter.
  const CornerValues around = field_.around(place);
  const std::array<std::int16_t, 8>& nodes = around.values();
  const std::uint32_t between =
      static_cast<std::uint32_t>((half_node[0] & 1) | (half_node[1] & 1) << 1 | (half_node[2] & 1) << 2);
  float sum = 0, count = 0;
  bool known = true;
  for (std::uint32_t corner = 0; corner < 8; ++corner) {
    if ((corner & ~between) != 0) continue;
    known &= nodes[corner] != CornerValues::kUnknown;
    sum += nodes[corner];
    ++count;
  }
  const float distance = sum / (4096 * count);
  squares_.push_back(known ? distance * distance : kFar);
  return squares_.back();
}

const DistanceTree::Quadratic& DistanceTree::around(const Eigen::Vector3f& place, Eigen::Vector3f& inside) {
  static const Quadratic nothing;
  std::array<std::int32_t, 3> cell{};
  for (int k = 0; k < 3; ++k) {
    const float at = std::floor(place[k]);
    if (!(at >= 0 && at < 65535)) return nothing;
    cell[static_cast<std::size_t>(k)] = static_cast<std::int32_t>(at);
    inside[k] = place[k] - at - 0.5f;
  }
  const std::uint32_t number = cells_.findOrAdd(cell[0], cell[1], cell[2]);
  if (number < quadratics_.size()) return quadratics_[number];

  Eigen::Matrix<float, kSamples, 1> samples;
  for (int i = 0; i < kSamples; ++i) {
    samples[i] = sample({2 * cell[0] + i % 3, 2 * cell[1] + i / 3 % 3, 2 * cell[2] + i / 9});
  }
  Quadratic fitted;
  fitted.near = samples.minCoeff() < kFar;
  if (fitted.near) {
    const Eigen::Matrix<float, kTerms, 1> c = leastSquaresInverse() * samples;
    fitted.hessian << 2 * c[0], c[3], c[4], c[3], 2 * c[1], c[5], c[4], c[5], 2 * c[2];
    fitted.gradient << c[6], c[7], c[8];
    fitted.constant = c[9];
  }
  quadratics_.push_back(fitted);
  return quadratics_.back();
}

}  // namespace isoreel
