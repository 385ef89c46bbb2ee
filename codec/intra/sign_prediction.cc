// SPDX-License-Identifier: BSD-3-Clause
#include "intra/sign_prediction.h"

#include <cmath>
#include <cstring>
#include <utility>

#include "lattice/sign_tables.h"

namespace isoreel {
namespace {

constexpr int kRounds = 3;

// Of a cell before anything around it counts, by its corners.
// NOLINTNEXTLINE(cppcoreguidelines-interfaces-global-init): the frames are constinit, and there before
const auto kStarts = [] {
  std::array<Lanes, 256> starts{};
  for (std::size_t corners = 0; corners < 256; ++corners) {
    for (std::size_t k = 0; k < 3; ++k)
      starts[corners].v[k] = static_cast<std::int16_t>((kLocalFrames[corners].vertex[k] + 4) >> 3);
  }
  return starts;
}();

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

inline void add(Lanes& sum, const Lanes& part) {
  using Four = std::int16_t __attribute__((vector_size(8)));
  Four a, b;
  std::memcpy(&a, sum.v.data(), sizeof a);
  std::memcpy(&b, part.v.data(), sizeof b);
  a += b;
  std::memcpy(sum.v.data(), &a, sizeof a);
}

Lanes normalOf(std::uint64_t signs, std::uint8_t corners) {
  Lanes sum;
  for (std::size_t byte = 0; byte < 8; ++byte) add(sum, kSums[byte][signs >> 8 * byte & 0xFF]);
  const std::int32_t square = sum.v[0] * sum.v[0] + sum.v[1] * sum.v[1] + sum.v[2] * sum.v[2];
  if (square == 0) {
    for (std::size_t k = 0; k < 3; ++k) sum.v[k] = static_cast<std::int16_t>(kLocalFrames[corners].normal[k]);
    return sum;
  }
  // In doubles: the root of a number below 2^52 that is no square is never so near above a whole number that
  // it would be rounded up to it, nor is the quotient; and a double is soon divided.
  const auto root = static_cast<double>(
      static_cast<std::int64_t>(std::sqrt(static_cast<double>(std::int64_t{square} << 20))));
  const auto inverse = static_cast<std::int64_t>(static_cast<double>(std::int64_t{1} << 40) / root);
  for (std::size_t k = 0; k < 3; ++k) sum.v[k] = static_cast<std::int16_t>((sum.v[k] * inverse) >> 16);
  return sum;
}

}  // namespace

std::uint64_t SignPrediction::bytes() const {
  std::uint64_t sum = bytesOf(points) + bytesOf(normals) + bytesOf(inputs);
  for (const auto& cells : at_border_) sum += bytesOf(cells);
  return sum + bytesOf(at_border_);
}

void SignPrediction::build(std::span<const Cell> cells, const Surroundings& around,
                           const std::array<std::uint32_t, 3>& nodes, const ParallelFor& parallel) {
  const std::size_t count = cells.size();
  setSize(points, count);
  setSize(normals, count);
  setSize(inputs, count);
  // The memory for normals, which are found last, has the points of every second round.
  static_assert(kRounds % 2 == 1);
  std::vector<Lanes>*from = &normals, *to = &points;
  const std::vector<Surroundings::Run>& runs = around.runs;
  at_border_.resize(runs.size());
  parallel(runs.size(), [&](std::size_t n) {
    at_border_[n].clear();
    for (std::uint32_t i = runs[n].first; i < runs[n].end; ++i) {
      const Cell& cell = cells[i];
      (*from)[i] = kStarts[cell.corners];
      if (cell.x - 1u >= nodes[0] - 3 || cell.y - 1u >= nodes[1] - 3 || cell.z - 1u >= nodes[2] - 3)
        at_border_[n].push_back(i);
    }
  });
  const auto at = [&](const Surroundings::Run& run, std::uint32_t i) {
    return CellAround{i, run.across(i), around.faces[i]};
  };
  for (int round = 0; round < kRounds; ++round) {
    parallel(runs.size(), [&](std::size_t n) {
      const Lanes* const before = from->data();
      Lanes* const after = to->data();
      for (std::uint32_t i = runs[n].first; i < runs[n].end; ++i)
        after[i] = meanAround(before, at(runs[n], i));
      // At the grid's border the coordinate across it is kept, or the rim would shrink.
      for (const std::uint32_t i : at_border_[n]) {
        const std::array<std::uint32_t, 3> place{cells[i].x, cells[i].y, cells[i].z};
        for (std::size_t k = 0; k < 3; ++k) {
          if (place[k] == 0 || place[k] + 2 == nodes[k]) after[i].v[k] = kStarts[cells[i].corners].v[k];
        }
      }
    });
    std::swap(from, to);
  }
  parallel(runs.size(), [&](std::size_t n) {
    for (std::uint32_t i = runs[n].first; i < runs[n].end; ++i)
      normals[i] = normalOf(around.signs[i], cells[i].corners);
  });
  parallel(runs.size(), [&](std::size_t n) {
    for (std::uint32_t i = runs[n].first; i < runs[n].end; ++i)
      inputs[i] = inputsOf(points.data(), normals.data(), kStarts[cells[i].corners], at(runs[n], i));
  });
}

}  // namespace isoreel
