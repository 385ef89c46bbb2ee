// SPDX-License-Identifier: BSD-3-Clause
// Motion of a P packet: a vector for each block of the current frame's active cells, from there to the
// previous surface (spec codec 8.2 and 8.3; paper, sections 4.1, 4.2 and 4.4).
#pragma once

#include <isoreel/base/status.h>
#include <isoreel/codec/grid.h>

#include <span>
#include <vector>

#include "entropy/residual.h"
#include "lattice/cell_index.h"

namespace isoreel {

/// In units of the packet's vector step.
using MotionVector = std::array<std::int32_t, 3>;

/// The active cells of one aligned cube: neighbours in Morton order.
struct Block {
  std::int32_t x = 0, y = 0, z = 0;  // cell coordinates / block size
  std::uint32_t first = 0;           // place of its first cell
  std::uint32_t count = 0;
  bool moves = false;  // false: an I block, whose vertices are coded as in I packets
  MotionVector vector{};
};

struct MotionModels {
  // By the number of neighbours that move; 4 more where the block of the packet before counts as well.
  std::array<BitModel, 8> moves;
  std::array<std::array<ResidualModels, 8>, 3> difference;
};

/// The octree level whose divided cells are the blocks: those of 2^block_log2 grid cells a side, or the root.
inline std::uint32_t blockLevel(std::uint32_t depth, std::uint32_t block_log2) {
  return depth > block_log2 ? depth - block_log2 : 0;
}

class MotionField {
 public:
  static constexpr std::int32_t kMaxMotion = 64 * kCell;

  /// Makes a block that stands still of each cell of the level whose cells have 2^block_log2 grid cells a
  /// side (or of the root, when that is smaller). `vector_step`: 1/16384 of a cell.
  void build(std::span<const Cell> level, std::uint32_t block_log2, std::uint32_t vector_step);
  /// Memory beyond the object itself, and what build() takes.
  std::uint64_t bytes() const { return bytesOf(blocks_) + index_.bytes(); }
  static std::uint64_t bytesFor(std::size_t blocks) {
    return blocks * sizeof(Block) + CellIndex::bytesFor(blocks);
  }
  /// Gives each block its active cells; those are in Morton order, and all lie in blocks.
  void assign(std::span<const Cell> active);
  std::uint32_t blockLog2() const { return block_log2_; }
  /// Of a block that moves, in 1/16384 of a cell.
  std::array<std::int32_t, 3> motionOf(const Block& block) const {
    const auto step = static_cast<std::int32_t>(vector_step_);
    return {block.vector[0] * step, block.vector[1] * step, block.vector[2] * step};
  }

  std::vector<Block>& blocks() { return blocks_; }
  const std::vector<Block>& blocks() const { return blocks_; }

  /// What the neighbours before it say of a block's vector, and how many of them move; 4 more when the same
  /// block of the packet before counts too.
  struct Expected {
    MotionVector vector{};
    std::size_t count = 0;
  };
  /// `before`: in profile main, the blocks of the packet before; null: not known.
  Expected expected(const Block& block, const MotionField* before = nullptr) const;

  /// Puts or gets whether each block moves, and how. `before`: as above.
  template <class Coder>
  Status code(Coder& coder, MotionModels& models, const MotionField* before = nullptr) {
    const std::int32_t limit = kMaxMotion / static_cast<std::int32_t>(vector_step_);
    for (Block& block : blocks_) {
      const Expected from = expected(block, before);
      block.moves = coder.code(models.moves[from.count], block.moves);
      if (!block.moves) continue;
      for (std::size_t k = 0; k < 3; ++k) {
        block.vector[k] = from.vector[k] + codeResidual(coder, models.difference[k][from.count],
                                                        block.vector[k] - from.vector[k]);
        if (block.vector[k] < -limit || block.vector[k] > limit) {
          return {ErrorCode::kBadData, "a motion vector of more than 64 cells (spec codec 8.2)"};
        }
      }
    }
    return {};
  }

  /// Vectors inside one block that moves: those of the eight nearest blocks, interpolated between their
  /// middles. A block that is not there, or does not move, counts as one that moves like this.
  class Interpolation {
   public:
    Interpolation(const MotionField& field, const Block& block);
    /// At a cell's middle, in 1/16384 of a cell.
    std::array<std::int32_t, 3> at(const Cell& cell) {
      const std::int32_t last = side_ - 1;
      std::array<std::int32_t, 3> inside{2 * (cell.x & last) - last, 2 * (cell.y & last) - last,
                                         2 * (cell.z & last) - last};  // from the block's middle, half cells
      const std::uint32_t octant = (inside[0] > 0) | (inside[1] > 0) << 1 | (inside[2] > 0) << 2;
      if (octant != octant_) enter(octant);
      for (std::int32_t& i : inside) i = std::abs(i);
      const std::int64_t x = inside[0], y = inside[1], z = inside[2];
      std::array<std::int32_t, 3> result{};
      for (std::size_t k = 0; k < 3; ++k) {
        const auto& t = terms_[k];
        result[k] = static_cast<std::int32_t>(
            (t[0] + t[1] * x + (t[2] + t[3] * x) * y + (t[4] + t[5] * x + (t[6] + t[7] * x) * y) * z) >>
            shift_);
      }
      return result;
    }

   private:
    void enter(std::uint32_t octant);

    std::array<std::array<std::int32_t, 3>, 27> around_{};
    std::int32_t side_, shift_;
    std::uint32_t octant_ = 8;  // whose terms these are
    std::array<std::array<std::int64_t, 8>, 3>
        terms_{};  // of the vector, times (2 side)³: 1, x, y, xy, z, xz, yz, xyz
  };

 private:
  const Block* find(std::int32_t x, std::int32_t y, std::int32_t z) const {
    const std::uint32_t place = index_.find(x, y, z);
    return place == CellIndex::kNone ? nullptr : &blocks_[place];
  }

  std::uint32_t block_log2_ = 3;
  std::uint32_t vector_step_ = 1;
  std::vector<Block> blocks_;
  CellIndex index_;  // of the blocks, as cells of their level
};

}  // namespace isoreel
