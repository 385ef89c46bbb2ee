// SPDX-License-Identifier: BSD-3-Clause
// The vertices of an I packet of profile main: one residual each, even cells before odd ones (spec codec 11.4
// to 11.6).
#pragma once

#include <isoreel/codec/configuration.h>

#include "intra/height_models.h"

namespace isoreel {

/// Where the moved previous surface crosses a vertex's normal.
struct MovedHeight {
  static constexpr std::uint8_t kNone = 255;
  std::int16_t height = 0;          // like HeightFrame::heights
  std::uint8_t confidence = kNone;  // below HeightContext::kConfidences, 0 best; or it is not near
};

/// What is known of a surface before its vertices are coded; kept from frame to frame for its memory.
struct HeightFrame {
  Surroundings around;
  SignPrediction predicted;
  std::vector<MovedHeight> moved;  // in P packets; else empty
  // As they are coded.
  std::vector<std::int16_t> heights;     // above the predicted points along their normals, 1/16384 of a cell
  std::vector<std::uint8_t> magnitudes;  // of residuals, at most 15

  void build(std::span<const Cell> cells, const CellIndex& index, const Grid& grid) {
    around.build(cells, index);
    predicted.build(cells, around, grid.nodes);
    moved.clear();
    setSize(heights, cells.size());
    setSize(magnitudes, cells.size());
  }
  /// Memory beyond the object itself, and the most that it takes for a frame.
  std::uint64_t bytes() const {
    return around.bytes() + predicted.bytes() + bytesOf(moved) + bytesOf(heights) + bytesOf(magnitudes);
  }
  static std::uint64_t bytesFor(std::size_t cells, std::size_t bricks) {
    return Surroundings::bytesFor(cells, bricks) + SignPrediction::bytesFor(cells) +
           cells * (sizeof(MovedHeight) + sizeof(std::int16_t) + 1);
  }
};

/// The vertex in its cell that a height stands for: 0 to 16384 from the cell's corner 0.
inline std::array<std::int32_t, 3> atHeight(const SignPrediction& predicted, std::size_t i,
                                            std::int32_t height) {
  std::array<std::int32_t, 3> result;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::int32_t position =
        8 * predicted.points[i].v[k] + ((height * predicted.normals[i].v[k] + 8192) >> 14);
    result[k] = std::clamp(position, 0, kCell);
  }
  return result;
}

namespace heights {

// 65536 / n, to the nearest.
inline constexpr auto kReciprocals = [] {
  std::array<std::int32_t, 33> table{};
  for (std::int32_t n = 1; n < 33; ++n) table[static_cast<std::size_t>(n)] = (2 * 65536 + n) / (2 * n);
  return table;
}();
inline std::int32_t mean(std::int32_t sum, std::uint32_t count) {
  return static_cast<std::int32_t>((std::int64_t{sum} * kReciprocals[count]) >> 16);
}

// By the mean magnitude in 1/64: the largest level whose square is not above four times it.
inline constexpr auto kActivityLevels = [] {
  std::array<std::uint8_t, 64 * 15 + 2> table{};
  std::uint32_t level = 0;
  for (std::uint32_t mean = 0; mean < table.size(); ++mean) {
    while (level < 31 && (level + 1) * (level + 1) <= 4 * mean) ++level;
    table[mean] = static_cast<std::uint8_t>(level);
  }
  return table;
}();

/// What coded cells around say: mean heights, nearer and further, and the mean magnitude of residuals.
struct Coded {
  std::int32_t near = 0, far = 0;
  std::uint32_t activity = HeightContext::kNoNeighbours;
  // What they are above the moved surface, in the mean.
  std::int32_t near_error = 0, far_error = 0;
};

inline std::int32_t meanError(const HeightFrame& frame, const std::uint32_t* links, std::uint32_t count) {
  std::int32_t sum = 0;
  std::uint32_t known = 0;
  for (std::uint32_t n = 0; n < count; ++n) {
    const MovedHeight& moved = frame.moved[links[n]];
    if (moved.confidence == MovedHeight::kNone) continue;
    sum += frame.heights[links[n]] - moved.height;
    ++known;
  }
  return known > 0 ? mean(sum, known) : 0;
}

inline std::uint32_t activityOf(std::uint32_t sum, std::uint32_t weight) {
  return kActivityLevels[static_cast<std::size_t>(mean(static_cast<std::int32_t>(64 * sum), weight))];
}

inline Coded aroundEven(const HeightFrame& frame, const std::uint32_t* links, std::uint32_t count) {
  Coded result;
  if (count == 0) return result;
  std::int32_t sum = 0;
  std::uint32_t magnitudes = 0;
  for (std::uint32_t n = 0; n < count; ++n) {
    sum += frame.heights[links[n]];
    magnitudes += frame.magnitudes[links[n]];
  }
  result.near = mean(sum, count);
  if (!frame.moved.empty()) result.near_error = meanError(frame, links, count);
  result.activity = activityOf(magnitudes, count);
  return result;
}

inline Coded aroundOdd(const HeightFrame& frame, const std::uint32_t* links, std::uint32_t near,
                       std::uint32_t far) {
  Coded result;
  if (near + far == 0) return result;
  std::array<std::int32_t, 2> sums{};
  std::array<std::uint32_t, 2> magnitudes{};
  for (std::uint32_t n = 0; n < near; ++n) {
    sums[0] += frame.heights[links[n]];
    magnitudes[0] += frame.magnitudes[links[n]];
  }
  for (std::uint32_t n = near; n < near + far; ++n) {
    sums[1] += frame.heights[links[n]];
    magnitudes[1] += frame.magnitudes[links[n]];
  }
  result.near = near > 0 ? mean(sums[0], near) : mean(sums[1], far);
  if (!frame.moved.empty()) {
    result.near_error = meanError(frame, links, near);
    result.far_error = meanError(frame, links + near, far);
  }
  result.far = far > 0 ? mean(sums[1], far) : result.near;
  result.activity = activityOf(3 * magnitudes[0] + magnitudes[1], 3 * near + far);
  return result;
}

/// What the header's weights of predicted vertices are for.
inline std::array<std::int32_t, HeightWeights::kMovedInputs> movedInputs(const HeightFrame& frame,
                                                                         std::size_t i, const Coded& coded) {
  std::array<std::int32_t, HeightWeights::kMovedInputs> result{coded.near, coded.far};
  for (std::size_t k = 0; k < SignInputs::kCount; ++k) result[2 + k] = frame.predicted.inputs[i].v[k];
  result[8] = frame.moved[i].height;
  result[9] = coded.near_error;
  result[10] = coded.far_error;
  return result;
}

/// Those of a set that are for SignInputs.
template <std::size_t N>
InputWeights inputWeights(const std::array<std::int32_t, N>& set) {
  InputWeights result;
  for (std::size_t k = 0; k < SignInputs::kCount; ++k) result.v[k] = static_cast<std::int16_t>(set[k + 2]);
  return result;
}

/// `count`, `links`: of a cell of this colour.
inline Coded around(const HeightFrame& frame, std::size_t colour, std::uint8_t count,
                    const std::uint32_t* links, std::uint32_t tools) {
  if ((tools & kToolNeighbours) == 0) return {};
  return colour == 0 ? aroundEven(frame, links, count) : aroundOdd(frame, links, count & 15u, count >> 4);
}

}  // namespace heights

/// Puts or gets all heights into frame.heights. `weights`: an encoder's. `tools`: of the record. An encoder's
/// choose(i, expected, context) gives the residual to put. A decoder stops early when the stream is overrun.
template <class Coder, class Choose>
void codeHeights(Coder& coder, HeightModels& models, const HeightWeights& weights,
                 std::span<const Cell> cells, HeightFrame& frame, std::int32_t step, std::uint32_t tools,
                 Choose choose) {
  if (cells.empty()) return;
  models.codeWeights(coder, weights, !frame.moved.empty());
  for (std::uint32_t colour = 0; colour < 2; ++colour) {
    const Surroundings::Colour& list = frame.around.colours[colour];
    const HeightWeights::Set plain = models.weights.plain[colour];
    const InputWeights plain_inputs = heights::inputWeights(plain);
    const auto& moved_weights = models.weights.moved[colour];
    const std::array<InputWeights, 2> moved_inputs{heights::inputWeights(moved_weights[0]),
                                                   heights::inputWeights(moved_weights[1])};
    const std::uint32_t* links = list.links.data();
    for (std::size_t n = 0; n < list.cells.size(); ++n) {
      const std::uint32_t i = list.cells[n];
      const heights::Coded coded = heights::around(frame, colour, list.counts[n], links, tools);
      links += Surroundings::linkCount(list.counts[n]);
      const SignInputs& inputs = frame.predicted.inputs[i];
      const std::int32_t sum =
          32 + plain[0] * coded.near + plain[1] * coded.far + weighed(inputs, plain_inputs);
      std::int32_t expected = std::clamp(sum >> 6, -kCell, kCell);
      HeightContext context{colour, coded.activity, static_cast<std::uint32_t>(inputs.bend),
                            cells[i].corners};
      std::int32_t residual;
      if (!frame.moved.empty() && frame.moved[i].confidence != MovedHeight::kNone) {
        const MovedHeight& moved = frame.moved[i];
        const std::size_t kind = moved.confidence >= 4;
        const auto& w = moved_weights[kind];
        std::int32_t other = 32 + w[0] * coded.near + w[1] * coded.far + weighed(inputs, moved_inputs[kind]);
        other += w[8] * moved.height + w[9] * coded.near_error + w[10] * coded.far_error;
        other = std::clamp(other >> 6, -kCell, kCell);
        context.moved = true;
        context.confidence = moved.confidence;
        context.apart = static_cast<std::uint32_t>(std::min(7, std::abs(other - expected) * 4 / step));
        expected = other;
        residual = codeHeightResidual<3>(coder, models, context, choose(i, expected, context));
      } else {
        residual = codeHeightResidual<2>(coder, models, context, choose(i, expected, context));
      }
      frame.heights[i] = static_cast<std::int16_t>(std::clamp(expected + residual * step, -32767, 32767));
      frame.magnitudes[i] = static_cast<std::uint8_t>(std::min(residual < 0 ? -residual : residual, 15));
      if constexpr (!Coder::kPuts) {
        if ((n & 4095) == 0 && coder.overrun()) return;
      }
    }
  }
}

}  // namespace isoreel
