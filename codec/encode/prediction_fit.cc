// SPDX-License-Identifier: BSD-3-Clause
#include "encode/prediction_fit.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "inter/coded_neighbours.h"

namespace isoreel {
namespace {

std::uint8_t inSixtyFourths(double weight, double max) {
  return static_cast<std::uint8_t>(std::lround(std::clamp(weight * 64, 0.0, max)));
}

}  // namespace

void fitPrediction(std::span<const Cell> cells, const CellIndex& index, const std::vector<MovedPlane>& planes,
                   std::span<const std::array<std::int32_t, 3>> vertices,
                   std::span<const std::array<double, 3>> wanted, std::int32_t step,
                   PredictionHeader& header) {
  struct Inputs {
    Eigen::Matrix3d squares = Eigen::Matrix3d::Identity() * kCell;  // keeps classes of few vertices tame
    Eigen::Vector3d products = Eigen::Vector3d::Zero();
    double tangent_squares = kCell, tangent_products = 0;
  };
  std::array<Inputs, kConfidences> fits;
  // The decoder's neighbours are these but for the quantiser.
  CodedNeighbours neighbours(index, vertices);
  std::vector<Eigen::Vector3d> inputs(cells.size());
  for (std::uint32_t i = 0; i < cells.size(); ++i) {
    const MovedPlane& plane = planes[i];
    if (!plane.known) {
      neighbours.skip(i);
      continue;
    }
    const LocalFrame& frame = kLocalFrames[cells[i].corners];
    const CodedNeighbours::Means around = neighbours.around(i, cells[i], frame);
    const std::int32_t surface =
        plane.offset(frame, {0, std::lround(wanted[i][1]), std::lround(wanted[i][2])});
    neighbours.set(i, static_cast<std::int32_t>(wanted[i][0]) - surface);
    inputs[i] = {static_cast<double>(surface), static_cast<double>(around.error),
                 static_cast<double>(around.height)};
    Inputs& fit = fits[plane.confidence];
    fit.squares += inputs[i] * inputs[i].transpose();
    fit.products += inputs[i] * wanted[i][0];
    for (std::size_t t = 0; t < 2; ++t) {
      fit.tangent_squares += static_cast<double>(plane.tangents[t]) * plane.tangents[t];
      fit.tangent_products += plane.tangents[t] * wanted[i][t + 1];
    }
  }
  for (std::size_t c = 0; c < kConfidences; ++c) {
    const Eigen::Vector3d weights = fits[c].squares.ldlt().solve(fits[c].products);
    header.weights[c] = {inSixtyFourths(fits[c].tangent_products / fits[c].tangent_squares, 128),
                         inSixtyFourths(weights[0], 128), inSixtyFourths(weights[1], 128),
                         inSixtyFourths(weights[2], 128)};
  }

  std::array<double, 3> sums{}, counts{};
  for (std::uint32_t i = 0; i < cells.size(); ++i) {
    if (!planes[i].known) continue;
    const PredictionHeader::Weights& w = header.weights[planes[i].confidence];
    const double error = wanted[i][0] - inputs[i].dot(Eigen::Vector3d(w.normal, w.error, w.height)) / 64;
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
