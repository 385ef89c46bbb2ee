// SPDX-License-Identifier: BSD-3-Clause
// Values at the eight corners of a cell, and what lies between them (spec codec 8.4).
#pragma once

#include <isoreel/codec/grid.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <limits>

#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace isoreel {

/// Distances at the corners of a cell, x fastest, then y, then z: |value| below 16384, or unknown.
class CornerValues {
 public:
  static constexpr std::int16_t kUnknown = std::numeric_limits<std::int16_t>::min();

  static CornerValues unknown() { return CornerValues(); }
  /// From nodes in memory, with the distances of rows and planes given.
  template <int Row, int Plane>
  static CornerValues load(const std::int16_t* at) {
    CornerValues result;
    std::memcpy(&result.v_[0], at, 4);
    std::memcpy(&result.v_[2], at + Row, 4);
    std::memcpy(&result.v_[4], at + Plane, 4);
    std::memcpy(&result.v_[6], at + Plane + Row, 4);
    return result;
  }
  explicit CornerValues(const std::array<std::int16_t, 8>& values) : v_(values) {}

  const std::array<std::int16_t, 8>& values() const { return v_; }
  bool allKnown() const {
    // The two highest bits of what is known are the same.
    std::array<std::uint64_t, 2> bits;
    std::memcpy(bits.data(), v_.data(), sizeof bits);
    const std::uint64_t differ = (bits[0] ^ bits[0] << 1) | (bits[1] ^ bits[1] << 1);
    return (differ & 0x8000800080008000) == 0;
  }
  /// Of the known ones, 0 when there is none.
  std::int32_t sumOfKnown() const {
    std::int32_t sum = 0;
    for (const std::int16_t v : v_) sum += v == kUnknown ? 0 : v;
    return sum;
  }

  /// Trilinear value and slopes, the latter per cell, in the unit of the values.
  struct Between {
    std::int32_t value;
    std::array<std::int32_t, 3> slope;
  };
  /// At a place of the cell: its parts of a cell in 1/16384. All values known.
  std::int32_t at(const std::array<std::int32_t, 3>& place) const;
  Between slopesAt(const std::array<std::int32_t, 3>& place) const;

 private:
  CornerValues() { v_.fill(kUnknown); }

  std::array<std::int16_t, 8> v_;
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

inline std::int32_t CornerValues::at(const std::array<std::int32_t, 3>& place) const {
  const __m128i v = _mm_loadu_si128(reinterpret_cast<const __m128i*>(v_.data()));
  const __m128i on_x = sse2::between(v, v, sse2::weights(place[0]));
  const __m128i on_y = sse2::between(on_x, on_x, sse2::weights(place[1]));
  return static_cast<std::int16_t>(_mm_cvtsi128_si32(sse2::between(on_y, on_y, sse2::weights(place[2]))));
}

inline CornerValues::Between CornerValues::slopesAt(const std::array<std::int32_t, 3>& place) const {
  const __m128i v = _mm_loadu_si128(reinterpret_cast<const __m128i*>(v_.data()));
  const __m128i rise = _mm_set1_epi32(0x0001FFFF);  // -1 and 1
  const __m128i wy = sse2::weights(place[1]), wz = sse2::weights(place[2]);
  const __m128i on_x = sse2::between(v, v, sse2::weights(place[0]));  // four values, twice
  const __m128i rise_x = _mm_madd_epi16(v, rise);
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

#else

inline std::int32_t CornerValues::at(const std::array<std::int32_t, 3>& place) const {
  return definition::slopesAt(v_, place).value;
}
inline CornerValues::Between CornerValues::slopesAt(const std::array<std::int32_t, 3>& place) const {
  return definition::slopesAt(v_, place);
}

#endif

}  // namespace isoreel
