// SPDX-License-Identifier: BSD-3-Clause
#include "inter/prediction.h"

namespace isoreel {
namespace {

// How the spread of the planes' distances grades: variances of 0.03, 0.08 and 0.15 cells squared, 1/2^20.
constexpr std::array<std::int64_t, 3> kSpreads{944, 6711, 23593};
// The surface may meet the local frame's normal at no flatter an angle than this: cosine 0.4 in 1/4096.
constexpr std::int64_t kFlattest = 1638;

// Which configurations' normals look the same way: cosine above 0.2.
const auto kSameWay = [] {
  std::array<std::array<std::uint64_t, 4>, 256> table{};
  for (std::size_t a = 0; a < 256; ++a) {
    for (std::size_t b = 0; b < 256; ++b) {
      std::int64_t cosine = 0;
      for (std::size_t k = 0; k < 3; ++k)
        cosine += std::int64_t{kLocalFrames[a].normal[k]} * kLocalFrames[b].normal[k];
      if (cosine > 53687091) table[a][b / 64] |= std::uint64_t{1} << (b % 64);
    }
  }
  return table;
}();

}  // namespace

SurfacePrediction predictFromSurface(const Reference& reference, Neighbours& neighbours, const Cell& cell,
                                     const std::array<std::int32_t, 3>& in_cell,
                                     const std::array<std::int32_t, 3>& motion) {
  const LocalFrame& frame = kLocalFrames[cell.corners];
  const std::array<std::int32_t, 3> corner{cell.x * kCell, cell.y * kCell, cell.z * kCell};
  std::array<std::int32_t, 3> at{};
  for (std::size_t k = 0; k < 3; ++k) at[k] = corner[k] + in_cell[k] + motion[k];
  const PlaneSums planes = reference.planesAround(at, frame, neighbours);
  if (planes.weight == 0) return {};

  SurfacePrediction result;
  std::int64_t along = 0;
  for (std::size_t k = 0; k < 3; ++k) along += planes.normal[k] * frame.normal[k];
  const std::int64_t offset =
      -planes.distance * 4096 / std::max(along >> kPositionBits, kFlattest * planes.weight);
  if (offset < -kCell || offset > kCell) return {};
  result.offset = static_cast<std::int32_t>(offset);

  std::int64_t at_corner = planes.distance * 4096;
  for (std::size_t k = 0; k < 3; ++k) at_corner -= planes.normal[k] * in_cell[k];
  int wrong = 0;
  for (std::uint32_t j = 0; j < 8; ++j) {
    std::int64_t distance = at_corner;
    for (std::size_t k = 0; k < 3; ++k) {
      if (j >> k & 1) distance += planes.normal[k] * kCell;
    }
    wrong += (distance < 0) != ((cell.corners >> j & 1) != 0);
  }
  const std::int64_t mean = planes.distance >> 4, weight = planes.weight;
  const std::int64_t spread = planes.squares * weight - mean * mean;
  std::size_t grade = 0;
  while (grade < kSpreads.size() && spread >= kSpreads[grade] * weight * weight) ++grade;
  result.confidence = static_cast<std::uint8_t>(std::min(wrong, 3) * 4 + static_cast<int>(grade));
  return result;
}

void Decoded::set(std::uint32_t i, const std::array<std::int32_t, 3>& in_cell, std::int32_t error) {
  vertices_[i] = {
      {cells_[i].x * kCell + in_cell[0], cells_[i].y * kCell + in_cell[1], cells_[i].z * kCell + in_cell[2]},
      error == kNone ? kNone : std::clamp(error, -kCell, kCell)};
}

CodedNeighbours Decoded::around(std::uint32_t i) {
  const Cell& cell = cells_[i];
  const LocalFrame& frame = kLocalFrames[cell.corners];
  const auto& same_way = kSameWay[cell.corners];
  const std::array<std::int32_t, 3> base{cell.x * kCell + frame.vertex[0], cell.y * kCell + frame.vertex[1],
                                         cell.z * kCell + frame.vertex[2]};
  std::int32_t predicted = 0, errors = 0, magnitudes = 0, seen = 0;
  std::int64_t heights = 0;
  neighbours_.forEach(
      cell.x, cell.y, cell.z,
      [&](std::uint32_t j) {
        if (j >= i) return;
        const Cell& other = cells_[j];
        if ((same_way[other.corners / 64] >> (other.corners % 64) & 1) == 0) return;
        const Vertex& vertex = vertices_[j];
        const bool face =
            std::abs(other.x - cell.x) + std::abs(other.y - cell.y) + std::abs(other.z - cell.z) == 1;
        const std::int32_t weight = face ? 2 : 1;
        std::int64_t height = 0;
        for (std::size_t k = 0; k < 3; ++k)
          height += std::int64_t{vertex.position[k] - base[k]} * frame.normal[k];
        seen += weight;
        heights += weight * std::clamp<std::int64_t>(height >> kPositionBits, -kCell, kCell);
        if (vertex.error == kNone) return;
        predicted += weight;
        errors += weight * vertex.error;
        magnitudes += weight * std::abs(vertex.error);
      },
      i);
  CodedNeighbours result;
  if (seen > 0) result.height = static_cast<std::int32_t>(heights / seen);
  if (predicted > 0) {
    result.error = errors / predicted;
    result.magnitude = magnitudes / predicted;
  }
  return result;
}

}  // namespace isoreel
