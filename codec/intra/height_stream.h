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
  std::vector<std::int16_t> heights;  // above the predicted points along their normals, 1/16384 of a cell
  /// What each coded vertex adds to the sums of those linked to it (see heights::partOf), from place 1 on;
  /// place 0 has nothing. In the memory that around.signs have until they are of no more use.
  std::vector<std::uint64_t> parts;

  void build(std::span<const Cell> cells, const CellIndex& index, const Grid& grid, const Slices& slices = {},
             const ParallelFor& parallel = serialFor) {
    around.signs.swap(parts);
    around.build(cells, index, slices, parallel);
    predicted.build(cells, around, grid.nodes, parallel);
    around.signs.swap(parts);
    around.link(cells, index, parallel);
    moved.clear();
    setSize(heights, cells.size());
    setSize(parts, cells.size() + 1);
    parts[0] = 0;
  }
  /// Memory beyond the object itself, and the most that it takes for a frame.
  std::uint64_t bytes() const {
    return around.bytes() + predicted.bytes() + bytesOf(moved) + bytesOf(heights) + bytesOf(parts);
  }
  static std::uint64_t bytesFor(std::size_t cells, std::size_t bricks, std::size_t slices) {
    return Surroundings::bytesFor(cells, bricks, slices) + SignPrediction::bytesFor(cells) +
           cells * (sizeof(MovedHeight) + sizeof(std::int16_t)) + 16 * sizeof(std::uint64_t);
  }
};

namespace heights {

// 65536 / n, to the nearest.
inline constexpr auto kReciprocals = [] {
  std::array<std::int32_t, 33> table{};  // of 0: 0
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

/// Of a coded vertex: its height + 2^15, from bit 20 the magnitude of its residual, at most 15, and where the
/// moved surface is near, from bit 28 its height above that + 2^16, and from bit 50 a 1. Sums of 14 fit.
inline std::uint64_t partOf(std::int32_t height, std::int32_t residual, const MovedHeight* moved) {
  const auto magnitude = static_cast<std::uint64_t>(std::min(residual < 0 ? -residual : residual, 15));
  const std::uint64_t part = static_cast<std::uint64_t>(height + (1 << 15)) | magnitude << 20;
  if (moved == nullptr || moved->confidence == MovedHeight::kNone) return part;
  return part | static_cast<std::uint64_t>(height - moved->height + (1 << 16)) << 28 | std::uint64_t{1} << 50;
}

/// The sum over `count` of these. The first `Usual` are looked at in any case, since how many there are is
/// anybody's guess; as many links have to be readable.
template <std::int32_t Usual>
std::uint64_t sumOf(const std::uint64_t* parts, const std::uint32_t* links, std::int32_t count) {
  std::uint64_t sum = 0;
  for (std::int32_t n = 0; n < Usual; ++n) {
    const std::int32_t beyond = (count - 1 - n) >> 31;  // -1 from the count on
    sum += parts[1 + (static_cast<std::int32_t>(links[n]) | beyond)];
  }
  for (std::int32_t n = Usual; n < count; ++n) sum += parts[1 + links[n]];
  return sum;
}
inline std::int32_t heightsIn(std::uint64_t sum, std::uint32_t count) {
  return static_cast<std::int32_t>(sum & 0xFFFFF) - static_cast<std::int32_t>(count << 15);
}
inline std::uint32_t magnitudesIn(std::uint64_t sum) { return static_cast<std::uint32_t>(sum >> 20) & 0xFF; }
inline std::int32_t meanError(std::uint64_t sum) {
  const auto known = static_cast<std::uint32_t>(sum >> 50);
  return mean(static_cast<std::int32_t>(sum >> 28 & 0x3FFFFF) - static_cast<std::int32_t>(known << 16),
              known);
}

inline std::uint32_t activityOf(std::uint32_t sum, std::uint32_t weight) {
  return kActivityLevels[static_cast<std::size_t>(mean(static_cast<std::int32_t>(64 * sum), weight))];
}

inline Coded aroundEven(const std::uint64_t* parts, const std::uint32_t* links, std::uint32_t count,
                        bool moved) {
  Coded result;
  const std::uint64_t sum = sumOf<6>(parts, links, static_cast<std::int32_t>(count));
  if (count == 0) return result;
  result.near = mean(heightsIn(sum, count), count);
  if (moved) result.near_error = meanError(sum);
  result.activity = activityOf(magnitudesIn(sum), count);
  return result;
}

inline Coded aroundOdd(const std::uint64_t* parts, const std::uint32_t* links, std::uint32_t near,
                       std::uint32_t far, bool moved) {
  Coded result;
  const std::uint64_t nearer = sumOf<6>(parts, links, static_cast<std::int32_t>(near)),
                      further = sumOf<4>(parts, links + near, static_cast<std::int32_t>(far));
  if (near + far == 0) return result;
  const std::int32_t near_mean = mean(heightsIn(nearer, near), near),
                     far_mean = mean(heightsIn(further, far), far);
  result.near = near > 0 ? near_mean : far_mean;
  result.far = far > 0 ? far_mean : near_mean;
  if (moved) {
    result.near_error = meanError(nearer);
    result.far_error = meanError(further);
  }
  result.activity = activityOf(3 * magnitudesIn(nearer) + magnitudesIn(further), 3 * near + far);
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

/// `count`, `links`: of a cell of this colour; `moved`: in P packets.
inline Coded around(const std::uint64_t* parts, std::size_t colour, std::uint8_t count,
                    const std::uint32_t* links, std::uint32_t tools, bool moved) {
  if ((tools & kToolNeighbours) == 0) return {};
  return colour == 0 ? aroundEven(parts, links, count, moved)
                     : aroundOdd(parts, links, count & 15u, count >> 4, moved);
}

}  // namespace heights

/// Puts or gets the heights of a slice into frame.heights. `weights`: coded in front of the first slice's
/// heights. `tools`: of the record. An encoder's choose(i, expected, context) gives the residual to put. A
/// decoder stops early when the stream is overrun.
template <class Coder, class Choose>
void codeHeights(Coder& coder, HeightModels& models, const HeightWeights& weights,
                 std::span<const Surroundings::Run> runs, std::span<const Cell> cells, HeightFrame& frame,
                 std::int32_t step, std::uint32_t tools, Choose choose) {
  const SignInputs* const all_inputs = frame.predicted.inputs.data();
  const MovedHeight* const all_moved = frame.moved.empty() ? nullptr : frame.moved.data();
  std::uint64_t* const parts = frame.parts.data();
  std::int16_t* const all_heights = frame.heights.data();
  // 2^32 / step, rounded up: what is divided below is under 2^18, so the quotient is exact.
  const std::uint64_t per_step =
      ((std::uint64_t{1} << 32) + static_cast<std::uint32_t>(step) - 1) / static_cast<std::uint32_t>(step);
  for (std::uint32_t colour = 0; colour < 2; ++colour) {
    const HeightWeights::Set plain = weights.plain[colour];
    const InputWeights plain_inputs = heights::inputWeights(plain);
    const std::array<HeightWeights::MovedSet, 2> moved_weights = weights.moved[colour];
    const std::array<InputWeights, 2> moved_inputs{heights::inputWeights(moved_weights[0]),
                                                   heights::inputWeights(moved_weights[1])};
    for (const Surroundings::Run& run : runs) {
      const Surroundings::Colour& list = run.colours[colour];
      const std::uint32_t* const places = list.cells.data();
      const std::uint8_t* const counts = list.counts.data();
      Surroundings::Links links(run, colour);
      const std::size_t count = list.cells.size();
      for (std::size_t n = 0; n < count; ++n) {
        const std::uint32_t i = places[n];
        const heights::Coded coded =
            heights::around(parts, colour, counts[n], links.next(counts[n]), tools, all_moved != nullptr);
        const SignInputs& inputs = all_inputs[i];
        const std::int32_t sum =
            32 + plain[0] * coded.near + plain[1] * coded.far + weighed(inputs, plain_inputs);
        std::int32_t expected = std::clamp(sum >> 6, -kCell, kCell);
        HeightContext context{colour, coded.activity, static_cast<std::uint32_t>(inputs.bend),
                              cells[i].corners};
        const MovedHeight* const moved = all_moved != nullptr ? all_moved + i : nullptr;
        std::int32_t residual = 0;
        if (moved != nullptr && moved->confidence != MovedHeight::kNone) {
          const std::size_t kind = moved->confidence >= 4;
          const auto& w = moved_weights[kind];
          std::int32_t other =
              32 + w[0] * coded.near + w[1] * coded.far + weighed(inputs, moved_inputs[kind]);
          other += w[8] * moved->height + w[9] * coded.near_error + w[10] * coded.far_error;
          other = std::clamp(other >> 6, -kCell, kCell);
          context.moved = true;
          context.confidence = moved->confidence;
          const auto apart = static_cast<std::uint64_t>(std::abs(other - expected));
          context.apart = static_cast<std::uint32_t>(std::min<std::uint64_t>(7, 4 * apart * per_step >> 32));
          expected = other;
          residual = codeHeightResidual<3>(coder, models, context, choose(i, expected, context));
        } else {
          residual = codeHeightResidual<2>(coder, models, context, choose(i, expected, context));
        }
        const std::int32_t height = std::clamp(expected + residual * step, -32767, 32767);
        all_heights[i] = static_cast<std::int16_t>(height);
        parts[1 + i] = heights::partOf(height, residual, moved);
        if constexpr (!Coder::kPuts) {
          if ((n & 4095) == 0 && coder.overrun()) return;
        }
      }
    }
  }
}

}  // namespace isoreel
