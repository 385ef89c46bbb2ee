// SPDX-License-Identifier: BSD-3-Clause
// Values at the eight corners of a cell, and what lies between them (spec codec 8.4).
#pragma once

#include <isoreel/codec/grid.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <limits>

#ifdef __SSE2__
#include <immintrin.h>
#endif

namespace isoreel {

/// Distances at the corners of a cell, x fastest, then y, then z: |value| below 16384, or unknown.
class CornerValues {
 public:
  static constexpr std::int16_t kUnknown = std::numeric_limits<std::int16_t>::min();
  using Array = std::array<std::int16_t, 8>;

  /// Trilinear value and slopes, the latter per cell, in the unit of the values.
  struct Between {
    std::int32_t value;
    std::array<std::int32_t, 3> slope;
  };

  static CornerValues unknown() {
    Array values{};
    values.fill(kUnknown);
    return CornerValues(values);
  }
  /// From nodes in memory, rows and planes apart by what is given.
  template <int Row, int Plane>
  static CornerValues load(const std::int16_t* at);
  explicit CornerValues(const Array& values);

  Array values() const;
  bool allKnown() const;
  /// Of the known ones, 0 when there is none.
  std::int32_t sumOfKnown() const {
    std::int32_t sum = 0;
    for (const std::int16_t v : values()) sum += v == kUnknown ? 0 : v;
    return sum;
  }
  /// How much the values count at a place of the cell, for any values.
  class Weights;
  /// At a place of the cell: its parts of a cell in 1/16384. All values known.
  std::int32_t at(const Weights& place) const;
  Between slopesAt(const std::array<std::int32_t, 3>& place) const;
  /// How far they are from a linear function: the squares of what they have of xy, xz, yz and xyz. All known.
  std::int64_t bend() const;

 private:
#ifdef __SSE2__
  explicit CornerValues(__m128i values) : v_(values) {}
  __m128i v_;
#else
  Array v_;
#endif
};

namespace definition {

// What section 8.4 says; the versions above do the same with vectors, and are tested against these.
inline std::int32_t between(std::int32_t a, std::int32_t b, std::int32_t part) {
  return a + (((b - a) * part) >> kPositionBits);
}
inline CornerValues::Between slopesAt(const std::array<std::int16_t, 8>& v,
                                      const std::array<std::int32_t, 3>& place) {
  constexpr std::int32_t kPart = kCell - 1;
  const std::int32_t x = place[0] & kPart, y = place[1] & kPart, z = place[2] & kPart;
  std::array<std::int32_t, 4> along_x{}, rise_x{};
  for (std::size_t i = 0; i < 4; ++i) {
    along_x[i] = between(v[2 * i], v[2 * i + 1], x);
    rise_x[i] = v[2 * i + 1] - v[2 * i];
  }
  const std::array<std::int32_t, 2> along_y{between(along_x[0], along_x[1], y),
                                            between(along_x[2], along_x[3], y)};
  return {between(along_y[0], along_y[1], z),
          {between(between(rise_x[0], rise_x[1], y), between(rise_x[2], rise_x[3], y), z),
           between(along_x[1] - along_x[0], along_x[3] - along_x[2], z), along_y[1] - along_y[0]}};
}

inline std::int64_t bendOf(const std::array<std::int16_t, 8>& v) {
  std::array<std::int32_t, 4> sum{}, difference{};  // along x
  for (std::size_t i = 0; i < 4; ++i) {
    sum[i] = v[2 * i] + v[2 * i + 1];
    difference[i] = v[2 * i] - v[2 * i + 1];
  }
  const std::int64_t yz = sum[0] - sum[1] - sum[2] + sum[3];
  const std::int64_t xz = difference[0] + difference[1] - difference[2] - difference[3];
  const std::int64_t xy = difference[0] - difference[1] + difference[2] - difference[3];
  const std::int64_t xyz = difference[0] - difference[1] - difference[2] + difference[3];
  return xy * xy + xz * xz + yz * yz + xyz * xyz;
}

}  // namespace definition

#ifdef __SSE2__

namespace sse2 {

/// Weights of the lower and the upper value for four pairs: their products with both, added and shifted, are
/// what definition::between gives.
inline __m128i weights(std::int32_t place) {
  const std::int32_t part = place & (kCell - 1);
  return _mm_set1_epi32((kCell - part) | part << 16);
}
// Between the pairs of neighbouring lanes; two sets of four, or one twice.
inline __m128i between(__m128i a, __m128i b, __m128i weights) {
  return _mm_packs_epi32(_mm_srai_epi32(_mm_madd_epi16(a, weights), kPositionBits),
                         _mm_srai_epi32(_mm_madd_epi16(b, weights), kPositionBits));
}

}  // namespace sse2

class CornerValues::Weights {
 public:
  explicit Weights(const std::array<std::int32_t, 3>& place)
      : x_(sse2::weights(place[0])), y_(sse2::weights(place[1])), z_(sse2::weights(place[2])) {}

 private:
  friend class CornerValues;
  __m128i x_, y_, z_;
};

inline CornerValues::CornerValues(const Array& values) { std::memcpy(&v_, values.data(), sizeof v_); }
inline CornerValues::Array CornerValues::values() const {
  Array result;
  std::memcpy(result.data(), &v_, sizeof v_);
  return result;
}
inline bool CornerValues::allKnown() const {
  return _mm_movemask_epi8(_mm_cmpeq_epi16(v_, _mm_set1_epi16(kUnknown))) == 0;
}
template <int Row, int Plane>
CornerValues CornerValues::load(const std::int16_t* at) {
  const auto two = [](const std::int16_t* from) {
    std::int32_t both = 0;
    std::memcpy(&both, from, sizeof both);
    return _mm_cvtsi32_si128(both);
  };
  return CornerValues(_mm_unpacklo_epi64(_mm_unpacklo_epi32(two(at), two(at + Row)),
                                         _mm_unpacklo_epi32(two(at + Plane), two(at + Plane + Row))));
}

inline std::int32_t CornerValues::at(const Weights& place) const {
  const __m128i on_x = sse2::between(v_, v_, place.x_);
  const __m128i on_y = sse2::between(on_x, on_x, place.y_);
  return static_cast<std::int16_t>(_mm_cvtsi128_si32(sse2::between(on_y, on_y, place.z_)));
}

inline CornerValues::Between CornerValues::slopesAt(const std::array<std::int32_t, 3>& place) const {
  const __m128i rise = _mm_set1_epi32(0x0001FFFF);  // -1 and 1
  const __m128i wy = sse2::weights(place[1]), wz = sse2::weights(place[2]);
  const __m128i on_x = sse2::between(v_, v_, sse2::weights(place[0]));  // four values, twice
  const __m128i rise_x = _mm_madd_epi16(v_, rise);
  // Values in the lower half, rises along x in the upper: two of each after y.
  const __m128i mixed = _mm_unpacklo_epi64(on_x, _mm_packs_epi32(rise_x, rise_x));
  const __m128i on_y = _mm_srai_epi32(_mm_madd_epi16(mixed, wy), kPositionBits);
  const __m128i rise_y = _mm_madd_epi16(on_x, rise);
  const __m128i all = _mm_packs_epi32(on_y, rise_y);  // values, rises along x, rises along y: pairs along z
  const __m128i on_z = _mm_srai_epi32(_mm_madd_epi16(all, wz), kPositionBits);
  const __m128i rise_z = _mm_madd_epi16(all, rise);
  alignas(16) std::array<std::int32_t, 4> result;
  _mm_store_si128(reinterpret_cast<__m128i*>(result.data()), on_z);
  return {result[0], {result[1], result[2], _mm_cvtsi128_si32(rise_z)}};
}

inline std::int64_t CornerValues::bend() const {
  // Sums and falls along x, then both of these along y, for either z.
  const __m128i on_x = _mm_packs_epi32(_mm_madd_epi16(v_, _mm_set1_epi16(1)),
                                       _mm_madd_epi16(v_, _mm_set1_epi32(static_cast<int>(0xFFFF0001))));
  const __m128i fall_y = _mm_madd_epi16(on_x, _mm_set1_epi32(static_cast<int>(0xFFFF0001)));
  const __m128i sum_y = _mm_madd_epi16(on_x, _mm_set1_epi16(1));
  alignas(16) std::array<std::int32_t, 4> fall, sum;
  _mm_store_si128(reinterpret_cast<__m128i*>(fall.data()), fall_y);
  _mm_store_si128(reinterpret_cast<__m128i*>(sum.data()), sum_y);
  const std::int64_t yz = fall[0] - fall[1], xz = sum[2] - sum[3];
  const std::int64_t xy = fall[2] + fall[3], xyz = fall[2] - fall[3];
  return xy * xy + xz * xz + yz * yz + xyz * xyz;
}

#else

class CornerValues::Weights {
 public:
  explicit Weights(const std::array<std::int32_t, 3>& place) : place_(place) {}

 private:
  friend class CornerValues;
  std::array<std::int32_t, 3> place_;
};

inline CornerValues::CornerValues(const Array& values) : v_(values) {}
inline CornerValues::Array CornerValues::values() const { return v_; }
inline bool CornerValues::allKnown() const { return std::find(v_.begin(), v_.end(), kUnknown) == v_.end(); }
template <int Row, int Plane>
CornerValues CornerValues::load(const std::int16_t* at) {
  return CornerValues(Array{at[0], at[1], at[Row], at[Row + 1], at[Plane], at[Plane + 1], at[Plane + Row],
                            at[Plane + Row + 1]});
}
inline std::int32_t CornerValues::at(const Weights& place) const {
  return definition::slopesAt(v_, place.place_).value;
}
inline CornerValues::Between CornerValues::slopesAt(const std::array<std::int32_t, 3>& place) const {
  return definition::slopesAt(v_, place);
}
inline std::int64_t CornerValues::bend() const { return definition::bendOf(v_); }

#endif

}  // namespace isoreel
