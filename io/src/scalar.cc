// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/io/scalar.h>

#include <algorithm>
#include <array>
#include <cstring>

namespace isoreel::io {
namespace {

template <class Scalar>
void convert(std::endian order, const std::uint8_t* bytes, std::span<float> out, const Rescale& rescale) {
  const bool same = rescale == Rescale();
  for (std::size_t i = 0; i < out.size(); ++i) {
    std::array<std::uint8_t, sizeof(Scalar)> raw;
    std::memcpy(raw.data(), bytes + i * sizeof(Scalar), sizeof(Scalar));
    if (order != std::endian::native) std::reverse(raw.begin(), raw.end());
    const auto scalar = std::bit_cast<Scalar>(raw);
    out[i] = same ? static_cast<float>(scalar)
                  : static_cast<float>(rescale.slope * static_cast<double>(scalar) + rescale.intercept);
  }
}

struct TypeRow {
  std::string_view name;
  std::size_t bytes;
  void (*convert)(std::endian, const std::uint8_t*, std::span<float>, const Rescale&);
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

void convertScalars(ScalarType type, std::endian order, const std::uint8_t* bytes, std::span<float> out,
                    const Rescale& rescale) {
  row(type).convert(order, bytes, out, rescale);
}

}  // namespace isoreel::io
