// SPDX-License-Identifier: BSD-3-Clause
// What the vertices coded before say of the next one (spec codec 8.7).
#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "lattice/cell_index.h"
#include "lattice/sign_tables.h"

namespace isoreel {

/// The neighbours of each cell across its three lower faces, cell by cell in order.
class CodedNeighbours {
 public:
  /// In 1/16384 of a cell.
  struct Means {
    std::int32_t error = 0;  // of what the moved surface left, where it predicted
    std::int32_t magnitude = kCell / 10;
    std::int32_t height = 0;  // above the local frame's vertex, along its normal
  };

  /// `vertices`: in their cells, as they become known. Both must outlive it.
  CodedNeighbours(const CellIndex& index, std::span<const std::array<std::int32_t, 3>> vertices)
      : index_(index), vertices_(vertices), errors_(vertices.size()) {}

  static std::uint64_t bytesFor(std::size_t cells) { return cells * sizeof(std::int32_t); }

  /// The vertex of cell i has no prediction.
  void skip(std::uint32_t i) { errors_[i] = kNone; }
  /// Its normal component less the moved surface's.
  void set(std::uint32_t i, std::int32_t error) { errors_[i] = std::clamp(error, -kCell, kCell); }

  /// For cell i; all before it have been set or skipped.
  Means around(std::uint32_t i, const Cell& cell, const LocalFrame& frame) {
    goTo(i);
    std::int32_t seen = 0, predicted = 0, errors = 0, magnitudes = 0, heights = 0;
    const std::array<std::uint16_t, 3> at{cell.x, cell.y, cell.z};
    for (std::size_t k = 0; k < 3; ++k) {
      const CellIndex::Brick* const brick = (at[k] & 3) != 0 ? brick_ : below_[k];
      const std::uint64_t bit = CellIndex::bit(cell.x - (k == 0), cell.y - (k == 1), cell.z - (k == 2));
      if ((brick->mask & bit) == 0) continue;
      const std::uint32_t j = brick->first + countBits(brick->mask & (bit - 1));
      const std::array<std::int32_t, 3>& vertex = vertices_[j];
      std::int64_t height = -std::int64_t{kCell} * frame.normal[k];
      for (std::size_t m = 0; m < 3; ++m)
        height += std::int64_t{vertex[m] - frame.vertex[m]} * frame.normal[m];
      ++seen;
      heights += std::clamp(static_cast<std::int32_t>(height >> kPositionBits), -kCell, kCell);
      if (errors_[j] == kNone) continue;
      ++predicted;
      errors += errors_[j];
      magnitudes += std::abs(errors_[j]);
    }
    Means means;
    if (seen > 0) means.height = mean(heights, seen);
    if (predicted > 0) {
      means.error = mean(errors, predicted);
      means.magnitude = mean(magnitudes, predicted);
    }
    return means;
  }

 private:
  static constexpr std::int32_t kNone = std::numeric_limits<std::int32_t>::min();

  // Division by 1, 2 or 3.
  static std::int32_t mean(std::int32_t sum, std::int32_t count) {
    constexpr std::array<std::int32_t, 4> kParts{0, 65536, 32768, 21845};
    return static_cast<std::int32_t>((std::int64_t{sum} * kParts[static_cast<std::size_t>(count)]) >> 16);
  }
  // To the brick of cell i.
  void goTo(std::uint32_t i) {
    if (brick_ != nullptr && i < brick_->first + brick_->count) return;
    const CellIndex::Brick* const bricks = index_.bricks().data();
    if (brick_ == nullptr) brick_ = bricks;
    while (i >= brick_->first + brick_->count) ++brick_;
    const CellIndex::Around& around = index_.around(static_cast<std::size_t>(brick_ - bricks));
    constexpr std::array<std::size_t, 3> kBelow{12, 10, 4};
    for (std::size_t k = 0; k < 3; ++k) below_[k] = &index_.brickOrEmpty(around[kBelow[k]]);
  }

  const CellIndex& index_;
  std::span<const std::array<std::int32_t, 3>> vertices_;
  std::vector<std::int32_t> errors_;
  const CellIndex::Brick* brick_ = nullptr;
  std::array<const CellIndex::Brick*, 3> below_{};
};

}  // namespace isoreel
