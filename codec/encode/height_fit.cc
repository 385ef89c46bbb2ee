// SPDX-License-Identifier: BSD-3-Clause
#include "encode/height_fit.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace isoreel {
namespace {

constexpr double kUsualError = 0.06;  // cells: an error of this counts half
constexpr int kRounds = 3;

/// What is known of a vertex, and its height, in cells.
template <std::size_t N>
struct Example {
  Eigen::Matrix<double, static_cast<int>(N), 1> inputs;
  double height;
};

/// What errors cost, about, in bits.
template <std::size_t N>
double costOf(std::span<const Example<N>> examples, const std::array<std::int32_t, N>& weights, double step) {
  Eigen::Matrix<double, static_cast<int>(N), 1> w;
  for (std::size_t k = 0; k < N; ++k) w[static_cast<int>(k)] = weights[k] / 64.0;
  double bits = 0;
  for (const Example<N>& e : examples) {
    const double error = (e.height - w.dot(e.inputs)) / step;
    bits += 0.5 * std::log2(1 + 2 * error * error);
  }
  return bits;
}

/// Changes weights where that pays; each example stands for `every`.
template <std::size_t N>
void fitWeights(std::span<const Example<N>> examples, double step, std::size_t every,
                std::array<std::int32_t, N>& set) {
  using Inputs = Eigen::Matrix<double, static_cast<int>(N), 1>;
  using Square = Eigen::Matrix<double, static_cast<int>(N), static_cast<int>(N)>;
  Inputs start;
  for (std::size_t k = 0; k < N; ++k) start[static_cast<int>(k)] = set[k] / 64.0;
  Inputs weights = start;
  for (int round = 0; round < kRounds; ++round) {
    Square squares = Square::Identity() * 0.3;
    Inputs products = 0.3 * start;
    for (const Example<N>& e : examples) {
      const double error = e.height - weights.dot(e.inputs);
      const double trust = 1 / (1 + error * error / (kUsualError * kUsualError));
      squares.noalias() += trust * e.inputs * e.inputs.transpose();
      products += trust * e.height * e.inputs;
    }
    weights = squares.ldlt().solve(products);
  }
  std::array<std::int32_t, N> result;
  double change = 0;  // bits
  for (std::size_t k = 0; k < N; ++k) {
    result[k] = static_cast<std::int32_t>(std::lround(
        std::clamp<double>(64 * weights[static_cast<int>(k)], -HeightWeights::kMax, HeightWeights::kMax)));
    change += 2 + 2 * std::log2(1 + std::abs(result[k] - set[k]));
  }
  const double gain = costOf<N>(examples, set, step) - costOf<N>(examples, result, step);
  if (static_cast<double>(every) * gain > change) set = result;
}

}  // namespace

HeightWeights fitHeights(const HeightFrame& frame, std::uint32_t tools, double step, std::size_t every,
                         const HeightWeights& before) {
  HeightWeights result = before;
  for (std::size_t colour = 0; colour < 2; ++colour) {
    std::vector<Example<HeightWeights::kInputs>> examples;
    std::array<std::vector<Example<HeightWeights::kMovedInputs>>, 2> moved;
    for (const Surroundings::Run& run : frame.around.runs) {
      const Surroundings::Colour& list = run.colours[colour];
      const std::uint32_t* links = list.links.data();
      for (std::size_t n = 0; n < list.cells.size(); ++n) {
        const std::uint32_t i = list.cells[n];
        const std::uint32_t* const own_links = links;
        links += Surroundings::linkCount(list.counts[n]);
        if (n % every != 0) continue;
        const heights::Coded coded = heights::around(frame.parts.data(), colour, list.counts[n], own_links,
                                                     tools, !frame.moved.empty());
        const double height = static_cast<double>(frame.heights[i]) / kCell;
        Example<HeightWeights::kInputs> example;
        example.height = height;
        example.inputs[0] = static_cast<double>(coded.near) / kCell;
        example.inputs[1] = static_cast<double>(coded.far) / kCell;
        for (std::size_t k = 0; k < SignInputs::kCount; ++k)
          example.inputs[static_cast<int>(k) + 2] =
              static_cast<double>(frame.predicted.inputs[i].v[k]) / kCell;
        examples.push_back(example);
        if (frame.moved.empty() || frame.moved[i].confidence == MovedHeight::kNone) continue;
        Example<HeightWeights::kMovedInputs> other;
        other.height = height;
        const auto values = heights::movedInputs(frame, i, coded);
        for (std::size_t k = 0; k < values.size(); ++k)
          other.inputs[static_cast<int>(k)] = static_cast<double>(values[k]) / kCell;
        moved[frame.moved[i].confidence >= 4].push_back(other);
      }
    }
    if (frame.moved.empty()) fitWeights<HeightWeights::kInputs>(examples, step, every, result.plain[colour]);
    for (std::size_t kind = 0; kind < 2; ++kind)
      fitWeights<HeightWeights::kMovedInputs>(moved[kind], step, every, result.moved[colour][kind]);
  }
  return result;
}

}  // namespace isoreel
