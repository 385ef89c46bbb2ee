// SPDX-License-Identifier: BSD-3-Clause
// The arithmetic of what signs predict, four lanes of 16 bits at a time (spec codec 11.2 to 11.4).
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#ifdef __SSE2__
#include <immintrin.h>
#endif

namespace isoreel {

/// Four lanes of 16 bits: x, y, z and one more.
struct alignas(8) Lanes {
  std::array<std::int16_t, 4> v{};
};

/// Inputs of the height's prediction, in 1/16384 of a cell or a like unit, and how bent the surface is.
struct alignas(16) SignInputs {
  static constexpr std::size_t kCount = 6;
  std::array<std::int16_t, kCount> v{};
  std::int16_t bend = 0;  // 0 to 15
  std::int16_t unused = 0;
};

/// What SignInputs::v count for, in the same order; the last two are 0.
struct alignas(16) InputWeights {
  std::array<std::int16_t, SignInputs::kCount + 2> v{};
};

namespace sign_lanes {

inline constexpr std::int32_t kUnit = 2048;      // points to a cell
inline constexpr std::int16_t kMargin = 41;      // points stay a fiftieth of a cell away from its faces
inline constexpr std::int32_t kBias = 6 * 1024;  // keeps sums of points positive

// By the faces that have another cell: what brings the sum of points to the cell's own coordinates, with the
// bias.
inline constexpr auto kOffsets = [] {
  std::array<Lanes, 64> offsets{};
  for (std::size_t faces = 0; faces < 64; ++faces) {
    for (std::size_t k = 0; k < 3; ++k) {
      const int high = static_cast<int>(faces >> (2 * k + 1) & 1), low = static_cast<int>(faces >> 2 * k & 1);
      offsets[faces].v[k] = static_cast<std::int16_t>(kBias + kUnit * (high - low));
    }
  }
  return offsets;
}();

inline std::int16_t limited(std::int32_t value) {
  return static_cast<std::int16_t>(std::clamp(value, -32767, 32767));
}
inline std::int16_t bendOf(std::int32_t cosines) {
  return static_cast<std::int16_t>(std::clamp((6 * 1024 - cosines) * 6 >> 10, 0, 15));
}

}  // namespace sign_lanes

/// A cell and those across its faces, as in Surroundings. Of points and normals, both see SignPrediction.
struct CellAround {
  std::uint32_t cell;
  const std::uint32_t* across;  // six
  std::uint8_t faces;
};

namespace definition {

// What section 11 says; the versions below do the same with vectors, and are tested against these.

/// The mean of the six points across the faces, or the cell's own where there is none.
inline Lanes meanAround(const Lanes* points, const CellAround& at) {
  Lanes result;
  for (std::size_t k = 0; k < 3; ++k) {
    std::int32_t sum = sign_lanes::kOffsets[at.faces].v[k];
    for (std::size_t face = 0; face < 6; ++face) sum += points[at.across[face]].v[k];
    const std::int32_t mean = ((sum * 10923) >> 16) - sign_lanes::kBias / 6;
    result.v[k] = static_cast<std::int16_t>(
        std::clamp<std::int32_t>(mean, sign_lanes::kMargin, sign_lanes::kUnit - sign_lanes::kMargin));
  }
  return result;
}

/// `start`: the point before it was smoothed.
inline SignInputs inputsOf(const Lanes* points, const Lanes* normals, const Lanes& start,
                           const CellAround& at) {
  const Lanes point = points[at.cell], normal = normals[at.cell];
  const auto along = [](const std::array<std::int32_t, 3>& to, const Lanes& n) {
    return (to[0] * n.v[0] + to[1] * n.v[1] + to[2] * n.v[2]) >> 14;
  };
  std::array<std::int32_t, 3> way{};  // to the points across the faces, summed
  std::int32_t planes = 0;            // heights of the planes through these points, where this one is
  std::int32_t cosines = 0;
  std::int32_t balance = 0;
  for (std::size_t face = 0; face < 6; ++face) {
    const Lanes &other = points[at.across[face]], &n = normals[at.across[face]];
    std::array<std::int32_t, 3> to{};
    for (std::size_t k = 0; k < 3; ++k) to[k] = other.v[k] - point.v[k];
    if ((at.faces >> face & 1) != 0) to[face / 2] += face % 2 == 0 ? -sign_lanes::kUnit : sign_lanes::kUnit;
    for (std::size_t k = 0; k < 3; ++k) way[k] += to[k];
    planes += along(to, n);
    cosines += along({normal.v[0], normal.v[1], normal.v[2]}, n) >> 4;
    balance += n.v[3];
  }
  std::array<std::int32_t, 3> moved{}, middle{};
  for (std::size_t k = 0; k < 3; ++k) {
    moved[k] = point.v[k] - start.v[k];
    middle[k] = sign_lanes::kUnit / 2 - point.v[k];
  }
  SignInputs result;
  result.v = {
      static_cast<std::int16_t>(8 * along(moved, normal)),  sign_lanes::limited(2 * along(way, normal)),
      static_cast<std::int16_t>(8 * normal.v[3]),           static_cast<std::int16_t>(balance),
      static_cast<std::int16_t>(8 * along(middle, normal)), sign_lanes::limited(2 * planes)};
  result.bend = sign_lanes::bendOf(cosines);
  return result;
}

inline std::int32_t weighed(const SignInputs& inputs, const InputWeights& weights) {
  std::int32_t sum = 0;
  for (std::size_t k = 0; k < SignInputs::kCount; ++k) sum += weights.v[k] * inputs.v[k];
  return sum;
}

/// The place of a vertex in its cell, 0 to 16384, at a height along its normal.
inline std::array<std::int32_t, 3> atHeight(const Lanes& point, const Lanes& normal, std::int16_t height) {
  std::array<std::int32_t, 3> result;
  for (std::size_t k = 0; k < 3; ++k)
    result[k] = std::clamp(8 * point.v[k] + ((height * normal.v[k] + 8192) >> 14), 0, 16384);
  return result;
}

}  // namespace definition

#ifdef __SSE2__

namespace sse2 {

inline __m128i one(const Lanes& lanes) {
  return _mm_loadl_epi64(reinterpret_cast<const __m128i*>(lanes.v.data()));
}
inline __m128i two(const Lanes& low, const Lanes& high) { return _mm_unpacklo_epi64(one(low), one(high)); }
/// Sums of neighbouring lanes, of a and then of b.
inline __m128i pairs(__m128i a, __m128i b) {
  const __m128 x = _mm_castsi128_ps(a), y = _mm_castsi128_ps(b);
  return _mm_add_epi32(_mm_castps_si128(_mm_shuffle_ps(x, y, 0x88)),
                       _mm_castps_si128(_mm_shuffle_ps(x, y, 0xDD)));
}
// By axis, then by which of its two faces have another cell: where the other cells are from this.
struct alignas(16) FacePair {
  std::array<std::int16_t, 8> v{};
};
inline constexpr auto kFacePairs = [] {
  std::array<std::array<FacePair, 4>, 3> table{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t faces = 0; faces < 4; ++faces) {
      if ((faces & 1) != 0) table[axis][faces].v[axis] = -sign_lanes::kUnit;
      if ((faces & 2) != 0) table[axis][faces].v[axis + 4] = sign_lanes::kUnit;
    }
  }
  return table;
}();

}  // namespace sse2

inline Lanes meanAround(const Lanes* points, const CellAround& at) {
  constexpr auto kBias = static_cast<std::int16_t>(sign_lanes::kBias / 6), kLow = sign_lanes::kMargin;
  constexpr auto kHigh = static_cast<std::int16_t>(sign_lanes::kUnit - kLow);
  __m128i sum = sse2::one(sign_lanes::kOffsets[at.faces]);
  for (std::size_t face = 0; face < 6; ++face) sum = _mm_add_epi16(sum, sse2::one(points[at.across[face]]));
  const __m128i mean = _mm_sub_epi16(_mm_mulhi_epi16(sum, _mm_set1_epi16(10923)),
                                     _mm_setr_epi16(kBias, kBias, kBias, 0, 0, 0, 0, 0));
  const __m128i kept = _mm_min_epi16(_mm_max_epi16(mean, _mm_setr_epi16(kLow, kLow, kLow, 0, 0, 0, 0, 0)),
                                     _mm_setr_epi16(kHigh, kHigh, kHigh, 0, 0, 0, 0, 0));
  Lanes result;
  _mm_storel_epi64(reinterpret_cast<__m128i*>(result.v.data()), kept);
  return result;
}

inline SignInputs inputsOf(const Lanes* points, const Lanes* normals, const Lanes& start,
                           const CellAround& at) {
  const __m128i point = sse2::two(points[at.cell], points[at.cell]);
  const __m128i three = _mm_setr_epi16(-1, -1, -1, 0, -1, -1, -1, 0);
  const __m128i normal = _mm_and_si128(sse2::two(normals[at.cell], normals[at.cell]), three);
  __m128i way = _mm_setzero_si128(), balance = way;
  struct Products {
    __m128i planes, cosines;  // of the two faces, two parts each
  };
  std::array<Products, 3> by_axis;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::uint32_t low = at.across[2 * axis], high = at.across[2 * axis + 1];
    const auto* offset =
        reinterpret_cast<const __m128i*>(sse2::kFacePairs[axis][at.faces >> 2 * axis & 3].v.data());
    const __m128i to =
        _mm_add_epi16(_mm_sub_epi16(sse2::two(points[low], points[high]), point), _mm_load_si128(offset));
    const __m128i n = sse2::two(normals[low], normals[high]);
    way = _mm_add_epi16(way, to);
    balance = _mm_add_epi16(balance, n);
    by_axis[axis].planes = _mm_madd_epi16(to, n);
    by_axis[axis].cosines = _mm_madd_epi16(normal, n);
  }
  const __m128i of_z = sse2::pairs(by_axis[2].planes, by_axis[2].cosines);
  const __m128i plane = _mm_add_epi32(_mm_srai_epi32(sse2::pairs(by_axis[0].planes, by_axis[1].planes), 14),
                                      _mm_move_epi64(_mm_srai_epi32(of_z, 14)));
  const __m128i cosine =
      _mm_add_epi32(_mm_srai_epi32(sse2::pairs(by_axis[0].cosines, by_axis[1].cosines), 18),
                    _mm_srli_si128(_mm_srai_epi32(of_z, 18), 8));
  const __m128i sums = sse2::pairs(plane, cosine);  // of planes in the lower half, of cosines in the upper
  way = _mm_add_epi16(way, _mm_srli_si128(way, 8));
  balance = _mm_add_epi16(balance, _mm_srli_si128(balance, 8));
  constexpr auto kHalf = static_cast<std::int16_t>(sign_lanes::kUnit / 2);
  const __m128i middle = _mm_sub_epi16(_mm_setr_epi16(kHalf, kHalf, kHalf, 0, 0, 0, 0, 0), point);
  const __m128i moved = _mm_sub_epi16(point, sse2::two(start, start));
  alignas(16) std::array<std::int32_t, 4> along, sum;  // along the normal: way, middle, moved
  _mm_store_si128(reinterpret_cast<__m128i*>(along.data()),
                  _mm_srai_epi32(sse2::pairs(_mm_madd_epi16(_mm_unpacklo_epi64(way, middle), normal),
                                             _mm_madd_epi16(moved, normal)),
                                 14));
  _mm_store_si128(reinterpret_cast<__m128i*>(sum.data()), _mm_add_epi32(sums, _mm_shuffle_epi32(sums, 0xB1)));
  SignInputs result;
  result.v = {static_cast<std::int16_t>(8 * along[2]),
              sign_lanes::limited(2 * along[0]),
              static_cast<std::int16_t>(8 * normals[at.cell].v[3]),
              static_cast<std::int16_t>(_mm_extract_epi16(balance, 3)),
              static_cast<std::int16_t>(8 * along[1]),
              sign_lanes::limited(2 * sum[0])};
  result.bend = sign_lanes::bendOf(sum[2]);
  return result;
}

inline std::array<std::int32_t, 3> atHeight(const Lanes& point, const Lanes& normal, std::int16_t height) {
  // In pairs of 16 bits, normal · height + 1 · 8192; the last sum is cut off where it is above all that is
  // kept.
  const __m128i by = _mm_set1_epi32(static_cast<std::uint16_t>(height) | 8192 << 16);
  const __m128i moved =
      _mm_srai_epi32(_mm_madd_epi16(_mm_unpacklo_epi16(sse2::one(normal), _mm_set1_epi16(1)), by), 14);
  const __m128i start = _mm_srai_epi32(_mm_unpacklo_epi16(_mm_setzero_si128(), sse2::one(point)), 13);
  __m128i place = _mm_packs_epi32(_mm_add_epi32(start, moved), _mm_setzero_si128());
  place = _mm_min_epi16(_mm_max_epi16(place, _mm_setzero_si128()), _mm_set1_epi16(16384));
  place = _mm_unpacklo_epi16(place, _mm_setzero_si128());
  alignas(16) std::array<std::int32_t, 4> result;
  _mm_store_si128(reinterpret_cast<__m128i*>(result.data()), place);
  return {result[0], result[1], result[2]};
}

inline std::int32_t weighed(const SignInputs& inputs, const InputWeights& weights) {
  const auto* all = reinterpret_cast<const __m128i*>(&inputs);
  const auto* by = reinterpret_cast<const __m128i*>(&weights);
  __m128i sum = _mm_madd_epi16(_mm_load_si128(all), _mm_load_si128(by));
  sum = _mm_add_epi32(sum, _mm_shuffle_epi32(sum, 0x4E));
  sum = _mm_add_epi32(sum, _mm_shuffle_epi32(sum, 0xB1));
  return _mm_cvtsi128_si32(sum);
}

#else

inline Lanes meanAround(const Lanes* points, const CellAround& at) {
  return definition::meanAround(points, at);
}
inline SignInputs inputsOf(const Lanes* points, const Lanes* normals, const Lanes& start,
                           const CellAround& at) {
  return definition::inputsOf(points, normals, start, at);
}
inline std::int32_t weighed(const SignInputs& inputs, const InputWeights& weights) {
  return definition::weighed(inputs, weights);
}
inline std::array<std::int32_t, 3> atHeight(const Lanes& point, const Lanes& normal, std::int16_t height) {
  return definition::atHeight(point, normal, height);
}

#endif

}  // namespace isoreel
