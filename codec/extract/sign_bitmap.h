// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/base/parallel.h>
#include <isoreel/codec/encoder.h>

#include <span>
#include <vector>

#include "lattice/cell_index.h"

namespace isoreel {

/// One bit per node: inside or outside. Rows along x start at a word of their own.
class SignBitmap {
 public:
  /// Compares every sample with the isovalue. With NonFinite::kRefuse, fails on the first sample (x fastest)
  /// that is not-a-number or infinite, naming it.
  static Result<SignBitmap> make(const Volume& volume, double isovalue, Inside inside, NonFinite non_finite,
                                 const ParallelFor& parallel);

  /// The signs that go with `cells`, all active cells of a surface; `filled`: whether all is inside when
  /// there are none.
  static SignBitmap fromCells(const std::array<std::uint32_t, 3>& nodes, std::span<const Cell> cells,
                              bool filled);

  bool at(std::uint32_t x, std::uint32_t y, std::uint32_t z) const {
    return row(y, z)[x / 64] >> (x % 64) & 1;
  }
  /// The cells whose corners differ, in Morton order.
  std::vector<Cell> activeCells(const ParallelFor& parallel) const;
  /// Inside nodes, those on the grid's border counted half for each border they lie on: the volume inside, in
  /// cells, were every sign-changing edge crossed in its middle.
  double insideCells() const;

 private:
  static SignBitmap empty(const std::array<std::uint32_t, 3>& nodes);
  void set(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
    words_[(std::size_t{z} * nodes_[1] + y) * row_words_ + x / 64] |= std::uint64_t{1} << (x % 64);
  }
  const std::uint64_t* row(std::uint32_t y, std::uint32_t z) const {
    return words_.data() + (std::size_t{z} * nodes_[1] + y) * row_words_;
  }

  std::array<std::uint32_t, 3> nodes_{};
  std::size_t row_words_ = 0;
  std::vector<std::uint64_t> words_;
};

}  // namespace isoreel
