// SPDX-License-Identifier: BSD-3-Clause
// The vertices of an I packet of profile main: one residual each, even cells before odd ones (spec codec 11.4
// to 11.6).
#pragma once

#include <isoreel/codec/configuration.h>

#include "intra/height_models.h"

namespace isoreel {

/// What is known of a surface before its vertices are coded; kept from frame to frame for its memory.
struct HeightFrame {
  Surroundings around;
  SignPrediction predicted;
  // As they are coded.
  std::vector<std::int16_t> heights;     // above the predicted points along their normals, 1/16384 of a cell
  std::vector<std::uint8_t> magnitudes;  // of residuals, at most 15

  void build(std::span<const Cell> cells, const CellIndex& index, const Grid& grid) {
    around.build(cells, index);
    predicted.build(cells, around, grid.nodes);
    heights.resize(cells.size());
    magnitudes.resize(cells.size());
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
};

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
  result.far = far > 0 ? mean(sums[1], far) : result.near;
  result.activity = activityOf(3 * magnitudes[0] + magnitudes[1], 3 * near + far);
  return result;
}

/// `count`, `links`: of a cell of this colour.
inline Coded around(const HeightFrame& frame, std::size_t colour, std::uint8_t count,
                    const std::uint32_t* links, std::uint32_t tools) {
  if ((tools & kToolNeighbours) == 0) return {};
  return colour == 0 ? aroundEven(frame, links, count) : aroundOdd(frame, links, count & 15u, count >> 4);
}

}  // namespace heights

/// Puts or gets all heights into frame.heights. `tools`: of the record. An encoder's choose(i, expected,
/// context) gives the residual to put. A decoder stops early when the stream is overrun.
template <class Coder, class Choose>
void codeHeights(Coder& coder, HeightModels& models, const HeightHeader& header, std::span<const Cell> cells,
                 HeightFrame& frame, std::int32_t step, std::uint32_t tools, Choose choose) {
  for (std::uint32_t colour = 0; colour < 2; ++colour) {
    const Surroundings::Colour& list = frame.around.colours[colour];
    std::array<std::int32_t, HeightHeader::kInputs> weights;
    for (std::size_t k = 0; k < weights.size(); ++k)
      weights[k] = static_cast<std::int32_t>(header.weights[colour][k]);
    const std::uint32_t* links = list.links.data();
    for (std::size_t n = 0; n < list.cells.size(); ++n) {
      const std::uint32_t i = list.cells[n];
      const heights::Coded coded = heights::around(frame, colour, list.counts[n], links, tools);
      links += Surroundings::linkCount(list.counts[n]);
      const SignInputs& inputs = frame.predicted.inputs[i];
      std::int32_t sum = 128 + weights[0] * coded.near + weights[1] * coded.far;
      for (std::size_t k = 0; k < SignInputs::kCount; ++k) sum += weights[k + 2] * inputs.v[k];
      const std::int32_t expected = std::clamp(sum >> 8, -kCell, kCell);
      const HeightContext context{colour, coded.activity, static_cast<std::uint32_t>(inputs.bend),
                                  cells[i].corners};
      const std::int32_t residual = codeHeightResidual(coder, models, context, choose(i, expected, context));
      frame.heights[i] = static_cast<std::int16_t>(std::clamp(expected + residual * step, -32767, 32767));
      frame.magnitudes[i] = static_cast<std::uint8_t>(std::min(residual < 0 ? -residual : residual, 15));
      if constexpr (!Coder::kPuts) {
        if ((n & 4095) == 0 && coder.overrun()) return;
      }
    }
  }
}

}  // namespace isoreel
