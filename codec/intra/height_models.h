// SPDX-License-Identifier: BSD-3-Clause
// Models and contexts of heights: how far a vertex lies from its predicted place along the predicted normal
// (spec codec 11.5, 11.6).
#pragma once

#include <span>
#include <vector>

#include "entropy/mixer.h"
#include "entropy/residual.h"
#include "intra/sign_prediction.h"

namespace isoreel {

/// How heights are predicted: weights in 1/64.
struct HeightWeights {
  static constexpr std::int32_t kMax = 255;
  static constexpr std::size_t kInputs = SignInputs::kCount + 2, kMovedInputs = kInputs + 3;
  using Set = std::array<std::int32_t, kInputs>;
  using MovedSet = std::array<std::int32_t, kMovedInputs>;

  /// For even and odd cells: of the mean height of coded neighbours, nearer and further, then of the inputs.
  std::array<Set, 2> plain{{{16, 0, 16, 0, 0, 0, 0, 0}, {48, 0, 0, 0, 0, 0, 0, 0}}};
  /// Where the moved surface is near, for even and odd cells, then by whether it agrees with the signs: the
  /// same, then of its height, and of how far the heights of coded neighbours, nearer and further, are above
  /// it.
  std::array<std::array<MovedSet, 2>, 2> moved{
      {{{{0, 0, 0, 0, 0, 0, 0, 0, 64, 32, 0}, {0, 0, 0, 0, 0, 0, 0, 0, 32, 16, 0}}},
       {{{0, 0, 0, 0, 0, 0, 0, 0, 64, 48, 0}, {0, 0, 0, 0, 0, 0, 0, 0, 32, 24, 0}}}}};
};

/// What is known of a vertex before its residual.
struct HeightContext {
  std::uint32_t colour = 0;    // 0: even, 1: odd
  std::uint32_t activity = 0;  // of coded neighbours' residuals, below kActivities
  std::uint32_t bend = 0;      // 0 to 15
  std::uint32_t corners = 0;   // the cell's configuration
  // Where the moved previous surface is near:
  bool moved = false;
  std::uint32_t confidence = 0;  // below kConfidences: 0 is best
  std::uint32_t apart = 0;       // 0 to 7: how much it says that others don't

  static constexpr std::uint32_t kConfidences = 16;
  static constexpr std::uint32_t kNoNeighbours = 32;
  static constexpr std::uint32_t kActivities = 33;
};

/// Everything that adapts while heights are coded.
class HeightModels {
 public:
  HeightModels() { reset(); }
  void reset() {
    for (auto* models : {&by_activity_, &by_corners_}) std::fill(models->begin(), models->end(), BitModel{});
    more_.fill({});
    negative_.fill({});
    zero_weights_.fill({});
    more_weights_.fill({});
    moved_.fill({});
    weights = {};
    change_ = {};
    change_by_ = {};
    moved_weights_.fill({});
    magnitudes_.fill({});
  }

  /// Memory beyond the object itself.
  std::uint64_t bytes() const { return bytesOf(by_activity_) + bytesOf(by_corners_); }

  /// For a first look at odd cells, whose residuals an encoder chooses by their cost: what is not 0 seldom
  /// is 1.
  void expectNoOnes() {
    constexpr std::uint16_t kAboveOne = 50000;
    const auto expect = [](std::span<BitModel> models) {  // by colour, then magnitude, then whether moved
      for (std::size_t i = 4; i < models.size(); i += 8) models[i].one = models[i + 1].one = kAboveOne;
    };
    expect(more_);
    expect(std::span(by_corners_).subspan(kMoreByCorners));
  }

  /// Whether the residual is 0. N: 3 where the moved surface is near, else 2.
  template <std::size_t N>
  Mix<N> zero(const HeightContext& c) {
    BitModel* const first = &by_activity_[((c.activity * 16 + c.bend) * 2 + c.colour) * 2 + c.moved];
    BitModel* const second = &by_corners_[(c.corners * 2 + c.colour) * 2 + c.moved];
    if constexpr (N == 2) {
      return {{first, second}, zero_weights_[weightSet(c)], kVertexFloor};
    } else {
      return {{first, second, &moved_[movedModel(c, 0)]}, moved_weights_[weightSet(c) * 3], kVertexFloor};
    }
  }
  /// Whether a magnitude is above `magnitude`, 1 or 2.
  template <std::size_t N>
  Mix<N> more(const HeightContext& c, std::uint32_t magnitude) {
    const std::uint32_t k = magnitude - 1;
    BitModel* const first = &more_[(((c.activity * 4 + c.bend / 4) * 2 + c.colour) * 2 + k) * 2 + c.moved];
    BitModel* const second =
        &by_corners_[kMoreByCorners + ((c.corners * 2 + c.colour) * 2 + k) * 2 + c.moved];
    if constexpr (N == 2) {
      return {{first, second}, more_weights_[weightSet(c) * 2 + k], kVertexFloor};
    } else {
      return {{first, second, &moved_[movedModel(c, magnitude)]},
              moved_weights_[weightSet(c) * 3 + magnitude],
              kVertexFloor};
    }
  }
  /// Those of the packet before until they change.
  HeightWeights weights;
  /// Puts or gets what changes of them; `put`: what they shall be. `moved`: in P packets.
  template <class Coder>
  void codeWeights(Coder& coder, const HeightWeights& put, bool moved) {
    for (std::size_t colour = 0; colour < 2; ++colour) {
      codeWeightSet(coder, weights.plain[colour], put.plain[colour]);
      for (std::size_t kind = 0; kind < 2 && moved; ++kind)
        codeWeightSet(coder, weights.moved[colour][kind], put.moved[colour][kind]);
    }
  }
  BitModel& negative(const HeightContext& c) { return negative_[c.corners * 2 + c.colour]; }
  /// Of what a magnitude is above 2.
  MagnitudeModels& magnitude(const HeightContext& c) { return magnitudes_[c.activity / 4]; }

 private:
  template <class Coder, std::size_t N>
  void codeWeightSet(Coder& coder, std::array<std::int32_t, N>& set, const std::array<std::int32_t, N>& put) {
    if (!coder.code(change_, set != put)) return;
    for (std::size_t k = 0; k < N; ++k)
      set[k] = std::clamp(set[k] + codeResidual(coder, change_by_, put[k] - set[k]), -HeightWeights::kMax,
                          HeightWeights::kMax);
  }
  static std::size_t weightSet(const HeightContext& c) { return c.activity / 4 * 2 + c.colour; }
  static std::size_t movedModel(const HeightContext& c, std::uint32_t magnitude) {
    return ((c.confidence * 8 + c.apart) * 9 + c.activity / 4) * 3 + magnitude;
  }

  std::vector<BitModel> by_activity_ = std::vector<BitModel>(HeightContext::kActivities * 16 * 2 * 2);
  static constexpr std::size_t kMoreByCorners = 1024;  // where those of more() begin
  std::vector<BitModel> by_corners_ = std::vector<BitModel>(kMoreByCorners + 2048);
  std::array<BitModel, HeightContext::kActivities * 4 * 2 * 2 * 2> more_;
  std::array<BitModel, 512> negative_;
  std::array<MixWeights<2>, 18> zero_weights_;
  std::array<MixWeights<2>, 36> more_weights_;
  std::array<BitModel, HeightContext::kConfidences * 8 * 9 * 3> moved_;
  std::array<MixWeights<3>, 54> moved_weights_;
  std::array<MagnitudeModels, 9> magnitudes_;
  BitModel change_;  // whether a set of weights changes, and by how much each
  ResidualModels change_by_;
};

/// Puts or gets a residual, |value| <= 65535. N: of HeightModels.
template <std::size_t N, class Coder>
std::int32_t codeHeightResidual(Coder& coder, HeightModels& models, const HeightContext& context,
                                std::int32_t value) {
  if (codeMixed(coder, models.zero<N>(context), value == 0)) return 0;
  const bool negative = coder.code(models.negative(context), value < 0);
  std::uint32_t magnitude = static_cast<std::uint32_t>(value < 0 ? -value : value);
  std::uint32_t result = 1;
  while (result <= 2 && codeMixed(coder, models.more<N>(context, result), magnitude > result)) ++result;
  if (result > 2) result = 2 + codeMagnitude(coder, models.magnitude(context), magnitude - 2);
  return negative ? -static_cast<std::int32_t>(result) : static_cast<std::int32_t>(result);
}

}  // namespace isoreel
