// SPDX-License-Identifier: BSD-3-Clause
// Models and contexts of heights: how far a vertex lies from its predicted place along the predicted normal
// (spec codec 11.5, 11.6).
#pragma once

#include <isoreel/base/syntax.h>

#include <vector>

#include "entropy/mixer.h"
#include "entropy/residual.h"
#include "intra/sign_prediction.h"

namespace isoreel {

/// What an I packet of profile main says of its prediction: the head of its vertex section.
struct HeightHeader {
  static constexpr const char* kName = "vertex header";
  static constexpr const char* kSpec = "codec 11.5";
  static constexpr std::size_t kInputs = SignInputs::kCount + 2;
  static constexpr std::int64_t kMaxWeight = 1023;
  using Weights = std::array<std::int64_t, kInputs>;

  /// For even and odd cells, in 1/256: of the mean height of coded neighbours, nearer and further, then of
  /// the inputs.
  std::array<Weights, 2> weights{{{64, 0, 64, 0, 0, 0, 0, 0}, {192, 0, 0, 0, 0, 0, 0, 0}}};

  template <class V>
  void fields(V& v) {
    for (Weights& colour : weights) {
      for (std::int64_t& w : colour) {
        v.signedVarint("weight", w);
        v.require(w >= -kMaxWeight && w <= kMaxWeight, "weight is not from -1023 to 1023");
      }
    }
  }
};

/// What is known of a vertex before its residual.
struct HeightContext {
  std::uint32_t colour = 0;    // 0: even, 1: odd
  std::uint32_t activity = 0;  // of coded neighbours' residuals, below kActivities
  std::uint32_t bend = 0;      // 0 to 15
  std::uint32_t corners = 0;   // the cell's configuration

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
    magnitudes_.fill({});
  }

  /// Whether the residual is 0.
  Mix zero(const HeightContext& c) {
    return {by_activity_[(c.activity * 16 + c.bend) * 2 + c.colour], by_corners_[c.corners * 2 + c.colour],
            zero_weights_[weightSet(c)]};
  }
  /// Whether a magnitude is above `magnitude`, 1 or 2.
  Mix more(const HeightContext& c, std::uint32_t magnitude) {
    const std::uint32_t k = magnitude - 1;
    return {more_[((c.activity * 4 + c.bend / 4) * 2 + c.colour) * 2 + k],
            by_corners_[512 + (c.corners * 2 + c.colour) * 2 + k], more_weights_[weightSet(c) * 2 + k]};
  }
  BitModel& negative(const HeightContext& c) { return negative_[c.corners * 2 + c.colour]; }
  /// Of what a magnitude is above 2.
  MagnitudeModels& magnitude(const HeightContext& c) { return magnitudes_[c.activity / 4]; }

 private:
  static std::size_t weightSet(const HeightContext& c) { return c.activity / 4 * 2 + c.colour; }

  std::vector<BitModel> by_activity_ = std::vector<BitModel>(HeightContext::kActivities * 16 * 2);
  std::vector<BitModel> by_corners_ = std::vector<BitModel>(512 * 3);
  std::array<BitModel, HeightContext::kActivities * 4 * 2 * 2> more_;
  std::array<BitModel, 512> negative_;
  std::array<MixWeights, 18> zero_weights_;
  std::array<MixWeights, 36> more_weights_;
  std::array<MagnitudeModels, 9> magnitudes_;
};

/// Puts or gets a residual, |value| <= 65535.
template <class Coder>
std::int32_t codeHeightResidual(Coder& coder, HeightModels& models, const HeightContext& context,
                                std::int32_t value) {
  if (codeMixed(coder, models.zero(context), value == 0)) return 0;
  const bool negative = coder.code(models.negative(context), value < 0);
  std::uint32_t magnitude = static_cast<std::uint32_t>(value < 0 ? -value : value);
  std::uint32_t result = 1;
  while (result <= 2 && codeMixed(coder, models.more(context, result), magnitude > result)) ++result;
  if (result > 2) result = 2 + codeMagnitude(coder, models.magnitude(context), magnitude - 2);
  return negative ? -static_cast<std::int32_t>(result) : static_cast<std::int32_t>(result);
}

}  // namespace isoreel
