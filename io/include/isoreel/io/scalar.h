// SPDX-License-Identifier: BSD-3-Clause
// Samples of any scalar type and byte order, turned into floats. Every format converts through here.
#pragma once

#include <bit>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace isoreel::io {

enum class ScalarType {
  kInt8,
  kUint8,
  kInt16,
  kUint16,
  kInt32,
  kUint32,
  kInt64,
  kUint64,
  kFloat32,
  kFloat64
};

/// "int8" … "uint64", "float32", "float64"; nothing for other names.
std::optional<ScalarType> scalarTypeNamed(std::string_view name);
std::size_t scalarBytes(ScalarType type);

/// What a header may say of its scalars: value = slope * scalar + intercept.
struct Rescale {
  double slope = 1, intercept = 0;
  bool operator==(const Rescale&) const = default;
};

/// Converts out.size() scalars, which lie at `bytes` without alignment, to the nearest float, after `rescale`
/// in double precision. Not-a-number and infinities stay what they are; a finite double above the floats
/// becomes an infinity.
void convertScalars(ScalarType type, std::endian order, const std::uint8_t* bytes, std::span<float> out,
                    const Rescale& rescale = {});

}  // namespace isoreel::io
