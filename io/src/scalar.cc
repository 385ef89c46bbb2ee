// SPDX-License-Identifier: BSD-3-Clause
#include "src/scalar.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>
#include <vector>

namespace isoreel::io {
namespace {

constexpr std::size_t kSlabScalars = 1u << 16;

template <class Scalar>
void convert(std::endian order, const std::uint8_t* bytes, std::span<float> out) {
  for (std::size_t i = 0; i < out.size(); ++i) {
    std::array<std::uint8_t, sizeof(Scalar)> raw;
    std::memcpy(raw.data(), bytes + i * sizeof(Scalar), sizeof(Scalar));
    if (order != std::endian::native) std::reverse(raw.begin(), raw.end());
    out[i] = static_cast<float>(std::bit_cast<Scalar>(raw));
  }
}

struct TypeRow {
  std::string_view name;
  std::size_t bytes;
  void (*convert)(std::endian, const std::uint8_t*, std::span<float>);
};

// In the order of ScalarType.
constexpr TypeRow kTypes[] = {
    {"int8", 1, convert<std::int8_t>},   {"uint8", 1, convert<std::uint8_t>},
    {"int16", 2, convert<std::int16_t>}, {"uint16", 2, convert<std::uint16_t>},
    {"int32", 4, convert<std::int32_t>}, {"uint32", 4, convert<std::uint32_t>},
    {"int64", 8, convert<std::int64_t>}, {"uint64", 8, convert<std::uint64_t>},
    {"float32", 4, convert<float>},      {"float64", 8, convert<double>},
};

const TypeRow& row(ScalarType type) { return kTypes[static_cast<std::size_t>(type)]; }

}  // namespace

std::optional<ScalarType> scalarTypeNamed(std::string_view name) {
  for (std::size_t i = 0; i < std::size(kTypes); ++i) {
    if (kTypes[i].name == name) return static_cast<ScalarType>(i);
  }
  return std::nullopt;
}

std::size_t scalarBytes(ScalarType type) { return row(type).bytes; }

void convertScalars(ScalarType type, std::endian order, const std::uint8_t* bytes, std::span<float> out) {
  row(type).convert(order, bytes, out);
}

Status readScalars(std::istream& in, ScalarType type, std::endian order, std::span<float> out) {
  std::vector<std::uint8_t> slab(std::min(out.size(), kSlabScalars) * scalarBytes(type));
  while (!out.empty()) {
    const std::size_t count = std::min(out.size(), kSlabScalars);
    const auto bytes = static_cast<std::streamsize>(count * scalarBytes(type));
    if (!in.read(reinterpret_cast<char*>(slab.data()), bytes)) {
      return {ErrorCode::kTruncated, "the file ends before its last sample"};
    }
    convertScalars(type, order, slab.data(), out.first(count));
    out = out.subspan(count);
  }
  return {};
}

}  // namespace isoreel::io
