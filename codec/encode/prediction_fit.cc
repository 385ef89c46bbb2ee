// SPDX-License-Identifier: BSD-3-Clause
#include "encode/prediction_fit.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace isoreel {
namespace {

std::uint8_t inSixtyFourths(double weight, double max) {
  return static_cast<std::uint8_t>(std::lround(std::clamp(weight * 64, 0.0, max)));
}

}  // namespace

void fitPrediction(std::span<const Cell> cells, const CellIndex& index,
                   const std::vector<SurfacePrediction>& predictions,
                   std::span<const std::array<std::int32_t, 3>> vertices, std::span<const double> wanted,
                   std::int32_t step, PredictionHeader& header) {
  std::array<Eigen::Matrix3d, kConfidences> squares;
  std::array<Eigen::Vector3d, kConfidences> products;
  for (std::size_t c = 0; c < kConfidences; ++c) {
    squares[c] = Eigen::Matrix3d::Identity() * kCell;  // keeps classes of few vertices tame
    products[c] = Eigen::Vector3d::Zero();
  }
  // The decoder's neighbours are these but for the quantiser.
  Decoded neighbours(cells, index);
  std::vector<CodedNeighbours> around(cells.size());
  for (std::uint32_t i = 0; i < cells.size(); ++i) {
    if (predictions[i].offset == SurfacePrediction::kNone) {
      neighbours.set(i, vertices[i], Decoded::kNone);
      continue;
    }
    around[i] = neighbours.around(i);
    neighbours.set(i, vertices[i], static_cast<std::int32_t>(wanted[i]) - predictions[i].offset);
    const Eigen::Vector3d inputs(predictions[i].offset, around[i].error, around[i].height);
    squares[predictions[i].confidence] += inputs * inputs.transpose();
    products[predictions[i].confidence] += inputs * wanted[i];
  }
  for (std::size_t c = 0; c < kConfidences; ++c) {
    const Eigen::Vector3d weights = squares[c].ldlt().solve(products[c]);
    for (std::size_t k = 0; k < 3; ++k)
      header.weights[c][k] = inSixtyFourths(weights[static_cast<Eigen::Index>(k)], 128);
  }

  std::array<double, 3> sums{}, counts{};
  for (std::uint32_t i = 0; i < cells.size(); ++i) {
    if (predictions[i].offset == SurfacePrediction::kNone) continue;
    const double error = wanted[i] - expectedOffset(header, predictions[i], around[i]);
    const auto magnitude = static_cast<std::int32_t>(std::lround(std::abs(error) / step));
    if (magnitude < 1 || magnitude > 3) continue;
    sums[static_cast<std::size_t>(magnitude - 1)] += std::abs(error) / step;
    ++counts[static_cast<std::size_t>(magnitude - 1)];
  }
  for (std::size_t m = 0; m < 3; ++m) {
    if (counts[m] > 0) header.levels[m] = std::max<std::uint8_t>(1, inSixtyFourths(sums[m] / counts[m], 255));
  }
}

}  // namespace isoreel
