// SPDX-License-Identifier: BSD-3-Clause
#include "encode/height_fit.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace isoreel {
namespace {

constexpr float kUsualError = 0.06f;  // cells: an error of this counts half
constexpr int kRounds = 3;
// Sums are floats for so many examples, then doubles.
constexpr std::size_t kBatch = 64;

using Four = float __attribute__((vector_size(16)));

/// What is known of a vertex, and its height, in cells.
template <std::size_t N>
struct Example {
  static constexpr std::size_t kFours = (N + 3) / 4;
  std::array<Four, kFours> inputs{};  // zeros behind the last
  float height = 0;

  void set(std::size_t k, std::int32_t value) { inputs[k / 4][k % 4] = static_cast<float>(value) / kCell; }
  float error(const std::array<Four, kFours>& weights) const {
    Four sum = weights[0] * inputs[0];
    for (std::size_t k = 1; k < kFours; ++k) sum += weights[k] * inputs[k];
    return height - ((sum[0] + sum[1]) + (sum[2] + sum[3]));
  }
};

template <std::size_t N>
using Inputs = Eigen::Matrix<double, static_cast<int>(N), 1>;

template <std::size_t N>
std::array<Four, Example<N>::kFours> inFours(const Inputs<N>& weights) {
  std::array<Four, Example<N>::kFours> result{};
  for (std::size_t k = 0; k < N; ++k) result[k / 4][k % 4] = static_cast<float>(weights[static_cast<int>(k)]);
  return result;
}

template <std::size_t N>
Inputs<N> inUnits(const std::array<std::int32_t, N>& set) {
  Inputs<N> result;
  for (std::size_t k = 0; k < N; ++k) result[static_cast<int>(k)] = set[k] / 64.0;
  return result;
}

/// What errors cost, about, in bits.
template <std::size_t N>
double costOf(std::span<const Example<N>> examples, const std::array<std::int32_t, N>& weights, double step) {
  const auto w = inFours<N>(inUnits<N>(weights));
  const double scale = 2 / (step * step);
  double bits = 0;
  for (std::size_t first = 0; first < examples.size(); first += 8) {
    double product = 1;  // eight do not overflow
    for (const Example<N>& e : examples.subspan(first, std::min<std::size_t>(8, examples.size() - first))) {
      const auto error = static_cast<double>(e.error(w));
      product *= 1 + scale * error * error;
    }
    bits += 0.5 * std::log2(product);
  }
  return bits;
}

/// Of weighed least squares: the sums of products of inputs with each other and with the height.
template <std::size_t N>
class Sums {
 public:
  void add(const Example<N>& e, float trust) {
    for (std::size_t k = 0; k < N; ++k) {
      const float scaled = trust * e.inputs[k / 4][k % 4];
      for (std::size_t four = 0; four < kFours; ++four) squares_[k][four] += scaled * e.inputs[four];
    }
    for (std::size_t four = 0; four < kFours; ++four) products_[four] += trust * e.height * e.inputs[four];
  }
  template <class Square>
  void addTo(Square& squares, Inputs<N>& products) const {
    for (std::size_t k = 0; k < N; ++k) {
      for (std::size_t other = k; other < N; ++other) {
        const auto value = static_cast<double>(squares_[k][other / 4][other % 4]);
        squares(static_cast<int>(k), static_cast<int>(other)) += value;
        if (other > k) squares(static_cast<int>(other), static_cast<int>(k)) += value;
      }
      products[static_cast<int>(k)] += static_cast<double>(products_[k / 4][k % 4]);
    }
  }

 private:
  static constexpr std::size_t kFours = Example<N>::kFours;
  std::array<std::array<Four, kFours>, N> squares_{};
  std::array<Four, kFours> products_{};
};

/// Changes weights where that pays; each example stands for `every`.
template <std::size_t N>
void fitWeights(std::span<const Example<N>> examples, double step, std::size_t every,
                std::array<std::int32_t, N>& set) {
  using Square = Eigen::Matrix<double, static_cast<int>(N), static_cast<int>(N)>;
  const Inputs<N> start = inUnits<N>(set);
  Inputs<N> weights = start;
  for (int round = 0; round < kRounds; ++round) {
    Square squares = Square::Identity() * 0.3;
    Inputs<N> products = 0.3 * start;
    const auto w = inFours<N>(weights);
    for (std::size_t first = 0; first < examples.size(); first += kBatch) {
      Sums<N> sums;
      for (const Example<N>& e : examples.subspan(first, std::min(kBatch, examples.size() - first))) {
        const float error = e.error(w) / kUsualError;
        sums.add(e, 1 / (1 + error * error));
      }
      sums.addTo(squares, products);
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
                         const HeightWeights& before, const ParallelFor& parallel) {
  HeightWeights result = before;
  parallel(2, [&](std::size_t colour) {
    std::vector<Example<HeightWeights::kInputs>> examples;
    std::array<std::vector<Example<HeightWeights::kMovedInputs>>, 2> moved;
    for (const Surroundings::Run& run : frame.around.runs) {
      const Surroundings::Colour& list = run.colours[colour];
      Surroundings::Links links(run, static_cast<std::uint32_t>(colour));
      for (std::size_t n = 0; n < list.cells.size(); ++n) {
        const std::uint32_t i = list.cells[n];
        const std::uint32_t* const own_links = links.next(list.counts[n]);
        if (n % every != 0) continue;
        const heights::Coded coded = heights::around(frame.parts.data(), colour, list.counts[n], own_links,
                                                     tools, !frame.moved.empty());
        const float height = static_cast<float>(frame.heights[i]) / kCell;
        if (frame.moved.empty()) {
          Example<HeightWeights::kInputs>& example = examples.emplace_back();
          example.height = height;
          example.set(0, coded.near);
          example.set(1, coded.far);
          for (std::size_t k = 0; k < SignInputs::kCount; ++k)
            example.set(k + 2, frame.predicted.inputs[i].v[k]);
        } else if (frame.moved[i].confidence != MovedHeight::kNone) {
          Example<HeightWeights::kMovedInputs>& example =
              moved[frame.moved[i].confidence >= 4].emplace_back();
          example.height = height;
          const auto values = heights::movedInputs(frame, i, coded);
          for (std::size_t k = 0; k < values.size(); ++k) example.set(k, values[k]);
        }
      }
    }
    if (frame.moved.empty()) fitWeights<HeightWeights::kInputs>(examples, step, every, result.plain[colour]);
    for (std::size_t kind = 0; kind < 2; ++kind)
      fitWeights<HeightWeights::kMovedInputs>(moved[kind], step, every, result.moved[colour][kind]);
  });
  return result;
}

}  // namespace isoreel
