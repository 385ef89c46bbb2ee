// SPDX-License-Identifier: BSD-3-Clause
// Several models' probabilities made one in the logistic domain, in integers (spec codec 11.6). After M.
// Mahoney, Adaptive Weighing of Context Models for Lossless Data Compression, 2005.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "entropy/range_coder.h"

namespace isoreel {

namespace logistic {

inline constexpr std::int32_t kLimit = 2047;  // of logits, in 1/256

/// 65536 / (1 + exp(-x / 256)), by lines between points 128 apart. |x| <= kLimit.
constexpr std::int32_t squash(std::int32_t x) {
  constexpr std::array<std::int32_t, 33> kPoints{
      22,    36,    60,    98,    162,   267,   439,   720,   1179,  1921,  3108,
      4971,  7812,  11955, 17625, 24743, 32768, 40793, 47911, 53581, 57724, 60565,
      62428, 63615, 64357, 64816, 65097, 65269, 65374, 65438, 65476, 65500, 65514};
  const auto at = static_cast<std::size_t>((x + 2048) >> 7);
  const std::int32_t part = (x + 2048) & 127;
  return (kPoints[at] * (128 - part) + kPoints[at + 1] * part + 64) >> 7;
}

inline constexpr auto kSquashed = [] {
  std::array<std::uint16_t, 2 * kLimit + 1> table{};
  for (std::int32_t x = -kLimit; x <= kLimit; ++x)
    table[static_cast<std::size_t>(x + kLimit)] = static_cast<std::uint16_t>(squash(x));
  return table;
}();

/// By a probability in 1/4096: the largest logit whose probability is not above it.
inline constexpr auto kStretched = [] {
  std::array<std::int16_t, 4096> table{};
  std::int32_t x = -kLimit;
  for (std::int32_t p = 0; p < 4096; ++p) {
    while (x < kLimit && squash(x + 1) <= 16 * p) ++x;
    table[static_cast<std::size_t>(p)] = static_cast<std::int16_t>(x);
  }
  return table;
}();

}  // namespace logistic

/// No mixed decision of a vertex costs less than 1/64 of a bit: see spec codec 6.1.
inline constexpr std::int32_t kVertexFloor = 720;

/// How far to trust each of N models.
template <std::size_t N>
struct MixWeights {
  static_assert(N == 2 || N == 3);
  static constexpr std::int32_t kLimit = 1 << 18;  // sums of N products with logits fit 32 bits
  static constexpr std::int32_t kStart = N == 2 ? 39322 : 26214;

  std::array<std::int32_t, N> w;  // 1/65536
  MixWeights() { w.fill(kStart); }
};

/// A decision that N models are asked about.
template <std::size_t N>
class Mix {
 public:
  /// Probabilities are kept `floor` away from 0 and 1.
  Mix(const std::array<BitModel*, N>& models, MixWeights<N>& weights, std::int32_t floor)
      : models_(models), weights_(weights) {
    std::int32_t sum = 0;
    for (std::size_t i = 0; i < N; ++i) {
      logits_[i] = logistic::kStretched[models[i]->one >> 4];
      sum += weights.w[i] * logits_[i];
    }
    const std::int32_t x = std::clamp(sum >> 16, -logistic::kLimit, logistic::kLimit);
    one_ = std::clamp<std::int32_t>(logistic::kSquashed[static_cast<std::size_t>(x + logistic::kLimit)],
                                    floor, 65536 - floor);
  }
  /// Probability of a 1, in 1/65536.
  std::int32_t one() const { return one_; }
  /// Learns what it was.
  void update(bool bit) {
    const std::int32_t error = (bit ? 65536 : 0) - one_;
    for (std::size_t i = 0; i < N; ++i) {
      std::int32_t& w = weights_.w[i];
      constexpr std::int32_t kMost = MixWeights<N>::kLimit;
      w += (logits_[i] * error + 8192) >> 14;
      if (static_cast<std::uint32_t>(w + kMost) > 2u * kMost) [[unlikely]]  // a step of less than kMost
        w = w < 0 ? -kMost : kMost;
      models_[i]->update(bit);
    }
  }

 private:
  std::array<BitModel*, N> models_;
  MixWeights<N>& weights_;
  std::array<std::int32_t, N> logits_;
  std::int32_t one_;
};

/// Puts or gets the decision.
template <class Coder, std::size_t N>
bool codeMixed(Coder& coder, Mix<N> mix, bool bit) {
  const bool result = coder.codeAt(static_cast<std::uint32_t>(mix.one()), bit);
  mix.update(result);
  return result;
}

}  // namespace isoreel
