// SPDX-License-Identifier: BSD-3-Clause
#include "encode/height_fit.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace isoreel {
namespace {

constexpr auto kInputs = static_cast<int>(HeightHeader::kInputs);
using Inputs = Eigen::Matrix<double, kInputs, 1>;
using Square = Eigen::Matrix<double, kInputs, kInputs>;

constexpr double kUsualError = 0.06;  // cells: an error of this counts half
constexpr int kRounds = 3;

}  // namespace

HeightHeader fitHeights(const HeightFrame& frame, std::uint32_t tools) {
  HeightHeader header;
  for (std::size_t colour = 0; colour < 2; ++colour) {
    const Surroundings::Colour& list = frame.around.colours[colour];
    std::vector<Inputs> inputs(list.cells.size());
    const std::uint32_t* links = list.links.data();
    for (std::size_t n = 0; n < list.cells.size(); ++n) {
      const heights::Coded coded = heights::around(frame, colour, list.counts[n], links, tools);
      links += Surroundings::linkCount(list.counts[n]);
      inputs[n][0] = static_cast<double>(coded.near) / kCell;
      inputs[n][1] = static_cast<double>(coded.far) / kCell;
      for (std::size_t k = 0; k < SignInputs::kCount; ++k)
        inputs[n][static_cast<int>(k) + 2] =
            static_cast<double>(frame.predicted.inputs[list.cells[n]].v[k]) / kCell;
    }
    Inputs before;  // the weights that it has without any vertex
    for (int k = 0; k < kInputs; ++k)
      before[k] = static_cast<double>(header.weights[colour][static_cast<std::size_t>(k)]) / 256;
    Inputs weights = before;
    for (int round = 0; round < kRounds; ++round) {
      Square squares = Square::Identity() * 0.3;
      Inputs products = 0.3 * before;
      for (std::size_t n = 0; n < inputs.size(); ++n) {
        const double height = static_cast<double>(frame.heights[list.cells[n]]) / kCell;
        const double error = height - weights.dot(inputs[n]);
        const double trust = 1 / (1 + error * error / (kUsualError * kUsualError));
        squares.noalias() += trust * inputs[n] * inputs[n].transpose();
        products += trust * height * inputs[n];
      }
      weights = squares.ldlt().solve(products);
    }
    for (int k = 0; k < kInputs; ++k) {
      header.weights[colour][static_cast<std::size_t>(k)] = static_cast<std::int64_t>(
          std::clamp(std::round(256 * weights[k]), -static_cast<double>(HeightHeader::kMaxWeight),
                     static_cast<double>(HeightHeader::kMaxWeight)));
    }
  }
  return header;
}

}  // namespace isoreel
