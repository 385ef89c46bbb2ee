// SPDX-License-Identifier: BSD-3-Clause
// The octree of signs, coded level by level, coarse to fine (spec codec 4; paper, section 2).
#pragma once

#include <isoreel/base/parallel.h>

#include <utility>

#include "intra/sign_slice.h"
#include "lattice/slices.h"

namespace isoreel {

/// The decoder's Truth: it knows nothing, and a coder that reads does not look at what it says.
struct UnknownTruth {
  static bool sign(const LevelLattice&, int, int, int) { return false; }
  static bool divided(std::uint32_t, const Cell&) { return false; }
};

/// Nothing is known of nodes but the signs around them: I packets, and coarse levels of P packets.
struct NothingMoved {
  static void goTo(const Cell&) {}
  static MovedOpinion at(int, int, int, std::uint16_t) { return {}; }
};

/// What a tree works with; kept from one to the next, it spares the memory's allocation.
struct SignTreeMemory {
  std::vector<Cell> cells, children;
  CellIndex index;
  std::vector<SignBlock> blocks;

  std::uint64_t bytes() const { return bytesOf(cells) + bytesOf(children) + bytesOf(blocks) + index.bytes(); }
};

/// The tree while it is coded. Truth answers for the encoder, asked in Morton order within a slice of a
/// level:
///   bool sign(const LevelLattice&, int x, int y, int z)   whether a lattice node is inside
///   bool divided(std::uint32_t level, const Cell&)        whether a cell whose corners agree holds a sign
///   change
template <class Coder, class Truth>
class SignTree {
 public:
  /// `grid` must outlive the tree.
  SignTree(const Grid& grid, Truth truth, std::size_t max_cells, const Slices& slices = {},
           SignTreeMemory memory = {})
      : grid_(grid),
        depth_(octreeDepth(grid)),
        truth_(truth),
        max_cells_(max_cells),
        slices_(slices),
        cells_(std::move(memory.cells)),
        children_(std::move(memory.children)),
        index_(std::move(memory.index)),
        blocks_(std::move(memory.blocks)) {}

  std::uint32_t depth() const { return depth_; }
  /// The heterogeneous cells of the level coded last, in Morton order. Those of the deepest level are all
  /// active.
  const std::vector<Cell>& cells() const { return cells_; }
  std::vector<Cell> takeCells() { return std::move(cells_); }
  /// At most so many bricks of 4×4×4 are they in: the cells two levels above.
  std::size_t bricks() const { return bricks_; }
  /// In how many slices the next level is coded.
  std::size_t sliceCount() const { return isoreel::sliceCount(cells_.size(), slices_); }
  /// Memory beyond the object itself, and how much more codeLevel() takes at most.
  std::uint64_t bytes() const {
    return bytesOf(cells_) + bytesOf(children_) + bytesOf(blocks_) + index_.bytes();
  }
  std::uint64_t bytesOfNextLevel() const {
    const auto more = [](std::uint64_t needed, std::uint64_t had) { return std::max(needed, had) - had; };
    const std::uint64_t children = std::min(max_cells_, 8 * cells_.size()) * sizeof(Cell);
    return more(CellIndex::bytesFor(bricks_), index_.bytes()) +
           more(bricks_ * sizeof(SignBlock), bytesOf(blocks_)) + more(children, bytesOf(children_)) +
           (sliceCount() > 1 ? 2 * children : 0);  // each slice has a list that doubles as it grows
  }
  /// Afterwards the tree is of no more use.
  SignTreeMemory takeMemory() {
    return {std::move(cells_), std::move(children_), std::move(index_), std::move(blocks_)};
  }

  /// Codes level 0: the root's corners, and its leaf bit when they agree.
  Status codeRoot(Coder& signs, Coder& leaves) {
    const LevelLattice lattice(grid_, 0);
    Cell root;
    for (int corner = 0; corner < 8; ++corner) {
      int inside_grid = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (corner >> axis & 1 && lattice.last[axis] >= 1) inside_grid |= 1 << axis;
      }
      bool sign =
          (root.corners >> inside_grid & 1) != 0;  // a corner outside the grid is as the last one inside
      if (inside_grid == corner)
        sign = signs.raw(1, truth_.sign(lattice, corner & 1, corner >> 1 & 1, corner >> 2));
      root.corners = static_cast<std::uint8_t>(root.corners | unsigned{sign} << corner);
    }
    cells_.clear();
    if (isActive(root) || (depth_ > 0 && leaves.raw(1, truth_.divided(0, root)))) cells_.push_back(root);
    return {};
  }

  /// Codes level `level` (1 to depth) from the cells of the level above. streamsOf(n) gives the SignStreams
  /// of each of sliceCount() slices; asked on any thread, and more than once.
  template <class StreamsOf>
  Status codeLevel(std::uint32_t level, const StreamsOf& streamsOf, const ParallelFor& parallel = serialFor) {
    index_.build(cells_, bricks_);
    clearFor(children_, std::min(max_cells_, 8 * cells_.size()));
    const LevelLattice lattice(grid_, level);
    seed(lattice);
    const SignLevel shared{level,     LevelLattice(grid_, level - 1), lattice, cells_, index_, blocks_,
                           max_cells_};
    const std::vector<std::uint32_t> starts = sliceStarts(index_.bricks(), sliceCount());
    const auto slice = [&](std::size_t n) {
      auto streams = streamsOf(n);
      using Slice = SignSlice<Coder, Truth, decltype(streams.moved)>;
      return Slice(shared, starts[n], starts[n + 1], std::move(streams), truth_);
    };
    if (starts.size() == 2) {
      auto all = slice(0);
      if (shared.deepest()) {
        ISOREEL_TRY(all.codeAll(children_));
      } else {
        ISOREEL_TRY(all.codeSigns());
        ISOREEL_TRY(all.addChildren(children_));
      }
    } else {
      ISOREEL_TRY(codeSlices(shared, starts, slice, parallel));
    }
    cells_.swap(children_);
    bricks_ = std::exchange(parents_, children_.size());
    return {};
  }

 private:
  template <class SliceOf>
  Status codeSlices(const SignLevel& level, std::span<const std::uint32_t> starts, const SliceOf& sliceOf,
                    const ParallelFor& parallel) {
    struct alignas(64) Done {
      Status status;
      std::vector<Cell> children;
    };
    std::vector<Done> results(starts.size() - 1);
    const auto inAll = [&](const auto& body) -> Status {
      exchange(starts);  // what they know of each other: corners of the level above, then all nodes
      parallel(results.size(), body);
      for (const Done& result : results) ISOREEL_TRY(result.status);
      return {};
    };
    ISOREEL_TRY(inAll([&](std::size_t n) { results[n].status = sliceOf(n).codeSigns(); }));
    ISOREEL_TRY(
        inAll([&](std::size_t n) { results[n].status = sliceOf(n).addChildren(results[n].children); }));
    for (const Done& result : results) {
      if (result.children.size() > max_cells_ - children_.size()) return level.tooManyCells();
      children_.insert(children_.end(), result.children.begin(), result.children.end());
    }
    return {};
  }

  // Brings what other slices' bricks know into the blocks of those beside them.
  void exchange(std::span<const std::uint32_t> starts) {
    std::size_t slice = 0;
    for (std::uint32_t number = 0; number < blocks_.size(); ++number) {
      slice += number == starts[slice + 1];
      const CellIndex::Around& around = index_.around(number);
      for (std::uint32_t offset = 0; offset < around.size(); ++offset) {
        const std::uint32_t other = around[offset];
        if (other < blocks_.size() && (other < starts[slice] || other >= starts[slice + 1]))
          blocks_[number].pull(blocks_[other], offset);
      }
    }
  }

  // Brings the signs of the parents' corners into their bricks' blocks.
  void seed(const LevelLattice& lattice) {
    clearFor(blocks_, index_.bricks().size());
    blocks_.resize(index_.bricks().size());
    for (std::size_t number = 0; number < blocks_.size(); ++number) {
      const CellIndex::Brick& brick = index_.bricks()[number];
      for (std::uint32_t i = brick.first; i < brick.first + brick.count; ++i) {
        const Cell& cell = cells_[i];
        const std::uint32_t in_grid = (2 * cell.x + 2 > lattice.last[0] ? 0x55u : 0xFFu) &
                                      (2 * cell.y + 2 > lattice.last[1] ? 0x33u : 0xFFu) &
                                      (2 * cell.z + 2 > lattice.last[2] ? 0x0Fu : 0xFFu);
        blocks_[number].seed(cell.x & 3, cell.y & 3, cell.z & 3, in_grid, cell.corners);
      }
      blocks_[number].agree();
    }
  }

  const Grid& grid_;
  std::uint32_t depth_;
  Truth truth_;
  std::size_t max_cells_;
  Slices slices_;
  std::vector<Cell> cells_;
  std::vector<Cell> children_;
  std::size_t parents_ = 1, bricks_ = 1;  // how many cells the level above has, and that above it
  CellIndex index_;
  std::vector<SignBlock> blocks_;  // one for each brick of index_
};

}  // namespace isoreel
