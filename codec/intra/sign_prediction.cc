// SPDX-License-Identifier: BSD-3-Clause
#include "intra/sign_prediction.h"

#include <algorithm>
#include <cmath>

#include "lattice/sign_tables.h"

namespace isoreel {
namespace {

constexpr std::int32_t kUnit = 1 << SignPrediction::kPointBits;
constexpr int kRounds = 3;
constexpr std::int16_t kMargin = 41;  // points stay a fiftieth of a cell away from its faces

Lanes startOf(const Cell& cell) {
  Lanes result;
  for (std::size_t k = 0; k < 3; ++k)
    result.v[k] = static_cast<std::int16_t>((kLocalFrames[cell.corners].vertex[k] + 4) >> 3);
  return result;
}

// By the faces that have another cell: what brings the sum of points to the cell's own coordinates, and keeps
// it positive.
constexpr std::int32_t kBias = 6 * 1024;
constexpr auto kOffsets = [] {
  std::array<Lanes, 64> offsets{};
  for (std::size_t faces = 0; faces < 64; ++faces) {
    for (std::size_t k = 0; k < 3; ++k) {
      const int high = static_cast<int>(faces >> (2 * k + 1) & 1), low = static_cast<int>(faces >> 2 * k & 1);
      offsets[faces].v[k] = static_cast<std::int16_t>(kBias + kUnit * (high - low));
    }
  }
  return offsets;
}();

// The mean of the six points across the faces, or the cell's own where there is none.
inline Lanes meanAround(const std::vector<Lanes>& points, const std::array<std::uint32_t, 6>& across,
                        std::uint8_t faces) {
  Lanes sum = kOffsets[faces];
  for (const std::uint32_t j : across) {
    for (std::size_t k = 0; k < 4; ++k) sum.v[k] = static_cast<std::int16_t>(sum.v[k] + points[j].v[k]);
  }
  Lanes result;
  for (std::size_t k = 0; k < 3; ++k)
    result.v[k] = static_cast<std::int16_t>(((sum.v[k] * 10923) >> 16) - kBias / 6);
  return result;
}

// Sums over the nodes that one byte of Surroundings::signs has: by byte, then its value.
constexpr auto kSums = [] {
  std::array<std::array<Lanes, 256>, 8> sums{};
  for (int byte = 0; byte < 8; ++byte) {
    auto& of = sums[static_cast<std::size_t>(byte)];
    for (int bit = 0; bit < 8; ++bit) {
      const int node = 8 * byte + bit;
      const std::array<int, 4> parts{2 * (node & 3) - 3, 2 * (node >> 2 & 3) - 3, 2 * (node >> 4) - 3, 1};
      const int far = (parts[0] * parts[0] > 1) + (parts[1] * parts[1] > 1) + (parts[2] * parts[2] > 1);
      const int weight = std::array<int, 4>{44, 16, 6, 2}[static_cast<std::size_t>(far)];
      const std::size_t inside = std::size_t{1} << bit;
      for (std::size_t others = 0; others < inside; ++others) {
        for (std::size_t k = 0; k < 4; ++k) {
          const int before = of[others].v[k], part = weight * parts[k];
          of[others].v[k] = static_cast<std::int16_t>(before + part);
          of[others | inside].v[k] = static_cast<std::int16_t>(before - part);
        }
      }
    }
  }
  return sums;
}();

/// The largest r with r² <= value, value below 2^52.
inline std::int64_t squareRoot(std::int64_t value) {
  auto root = static_cast<std::int64_t>(std::sqrt(static_cast<double>(value)));
  root -= root * root > value;
  root += (root + 1) * (root + 1) <= value;
  return root;
}

Lanes normalOf(std::uint64_t signs, std::uint8_t corners) {
  Lanes sum;
  for (std::size_t byte = 0; byte < 8; ++byte) {
    const Lanes& part = kSums[byte][signs >> 8 * byte & 0xFF];
    for (std::size_t k = 0; k < 4; ++k) sum.v[k] = static_cast<std::int16_t>(sum.v[k] + part.v[k]);
  }
  const std::int32_t square = sum.v[0] * sum.v[0] + sum.v[1] * sum.v[1] + sum.v[2] * sum.v[2];
  if (square == 0) {
    for (std::size_t k = 0; k < 3; ++k) sum.v[k] = static_cast<std::int16_t>(kLocalFrames[corners].normal[k]);
    return sum;
  }
  // The quotient of these is never so near below a whole number that a double would round up to it; and a
  // double is soon divided.
  const auto root = static_cast<double>(squareRoot(std::int64_t{square} << 20));
  const auto inverse = static_cast<std::int64_t>(static_cast<double>(std::int64_t{1} << 40) / root);
  for (std::size_t k = 0; k < 3; ++k) sum.v[k] = static_cast<std::int16_t>((sum.v[k] * inverse) >> 16);
  return sum;
}

inline std::int32_t dot(const Lanes& a, const Lanes& b) {
  return a.v[0] * b.v[0] + a.v[1] * b.v[1] + a.v[2] * b.v[2];
}

inline Lanes minus(const Lanes& a, const Lanes& b) {
  Lanes result;
  for (std::size_t k = 0; k < 3; ++k) result.v[k] = static_cast<std::int16_t>(a.v[k] - b.v[k]);
  return result;
}

inline std::int16_t limited(std::int32_t value) {
  return static_cast<std::int16_t>(std::clamp(value, -32767, 32767));
}

// Of a neighbour's corner 0 from the cell's own, by face.
constexpr std::array<Lanes, 6> kFaceOffsets{{{{-kUnit, 0, 0, 0}},
                                             {{kUnit, 0, 0, 0}},
                                             {{0, -kUnit, 0, 0}},
                                             {{0, kUnit, 0, 0}},
                                             {{0, 0, -kUnit, 0}},
                                             {{0, 0, kUnit, 0}}}};

}  // namespace

std::uint64_t SignPrediction::bytes() const {
  return bytesOf(points) + bytesOf(normals) + bytesOf(inputs) + bytesOf(start_) + bytesOf(other_);
}

void SignPrediction::build(std::span<const Cell> cells, const Surroundings& around,
                           const std::array<std::uint32_t, 3>& nodes) {
  const std::size_t count = cells.size();
  setSize(points, count);
  setSize(normals, count);
  setSize(inputs, count);
  setSize(start_, count);
  setSize(other_, count);
  for (std::size_t i = 0; i < count; ++i) {
    points[i] = start_[i] = startOf(cells[i]);
    normals[i] = normalOf(around.signs[i], cells[i].corners);
  }
  for (int round = 0; round < kRounds; ++round) {
    for (std::size_t i = 0; i < count; ++i) {
      Lanes next = meanAround(points, around.across[i], around.faces[i]);
      for (std::size_t k = 0; k < 3; ++k)
        next.v[k] = std::clamp(next.v[k], kMargin, static_cast<std::int16_t>(kUnit - kMargin));
      // At the grid's border the coordinate across it is kept, or the rim would shrink.
      const Cell& cell = cells[i];
      const std::array<std::uint32_t, 3> at{cell.x, cell.y, cell.z};
      for (std::size_t k = 0; k < 3; ++k) {
        if (at[k] == 0 || at[k] + 2 == nodes[k]) next.v[k] = start_[i].v[k];
      }
      other_[i] = next;
    }
    points.swap(other_);
  }
  for (std::size_t i = 0; i < count; ++i) inputs[i] = inputsOf(i, around);
}

SignInputs SignPrediction::inputsOf(std::size_t i, const Surroundings& around) const {
  const Lanes point = points[i], normal = normals[i];
  Lanes way;                // to the points across the faces, summed
  std::int32_t planes = 0;  // heights of the planes through these points, where this one is
  std::int32_t cosines = 0;
  std::int32_t balance = 0;
  for (std::size_t face = 0; face < 6; ++face) {
    const std::uint32_t j = around.across[i][face];
    const bool other = (around.faces[i] >> face & 1) != 0;
    Lanes to = minus(points[j], point);
    for (std::size_t k = 0; k < 3; ++k) {
      to.v[k] = static_cast<std::int16_t>(to.v[k] + (other ? kFaceOffsets[face].v[k] : 0));
      way.v[k] = static_cast<std::int16_t>(way.v[k] + to.v[k]);
    }
    planes += dot(to, normals[j]) >> 14;
    cosines += dot(normal, normals[j]) >> 18;
    balance += normals[j].v[3];
  }
  Lanes middle;
  for (std::size_t k = 0; k < 3; ++k) middle.v[k] = static_cast<std::int16_t>(kUnit / 2 - point.v[k]);
  SignInputs result;
  result.v = {static_cast<std::int16_t>(8 * (dot(minus(point, start_[i]), normal) >> 14)),
              limited(2 * (dot(way, normal) >> 14)),
              static_cast<std::int16_t>(8 * normal.v[3]),
              static_cast<std::int16_t>(balance),
              static_cast<std::int16_t>(8 * (dot(middle, normal) >> 14)),
              limited(2 * planes)};
  result.bend = static_cast<std::int16_t>(std::clamp((6 * 1024 - cosines) * 6 >> 10, 0, 15));
  return result;
}

}  // namespace isoreel
