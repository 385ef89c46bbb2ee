// SPDX-License-Identifier: BSD-3-Clause
// The octree of signs, coded level by level, coarse to fine (spec codec 4; paper, section 2): signs of the 27
// corners of a cell's eight children, then a leaf bit for each child whose corners agree. One walk serves
// both directions.
#pragma once

#include <isoreel/base/status.h>
#include <isoreel/codec/grid.h>

#include <bit>
#include <span>
#include <utility>

#include "intra/cell_contexts.h"
#include "lattice/cell_block.h"
#include "lattice/cell_index.h"
#include "lattice/sign_block.h"

namespace isoreel {

/// The lattice of one octree level over a grid: every 2^(depth - level)-th node.
struct LevelLattice {
  std::uint32_t shift = 0;              // log2 of the spacing in nodes
  std::array<std::int32_t, 3> last{};   // the highest lattice coordinate inside the grid
  std::array<std::int32_t, 3> cells{};  // cells that hold a part of the grid

  LevelLattice(const Grid& grid, std::uint32_t level) : shift(octreeDepth(grid) - level) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::uint32_t span = grid.nodes[axis] - 1;
      last[axis] = static_cast<std::int32_t>(span >> shift);
      cells[axis] = static_cast<std::int32_t>((span + (1u << shift) - 1) >> shift);
    }
  }
};

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

/// The tree while it is coded. Truth answers for the encoder, asked in Morton order within a level:
///   bool sign(const LevelLattice&, int x, int y, int z)   whether a lattice node is inside
///   bool divided(std::uint32_t level, const Cell&)        whether a cell whose corners agree holds a sign
///   change
template <class Coder, class Truth>
class SignTree {
 public:
  /// `grid` and `models` must outlive the tree.
  SignTree(const Grid& grid, Truth truth, std::size_t max_cells, SignTreeModels& models,
           SignTreeMemory memory = {})
      : grid_(grid),
        depth_(octreeDepth(grid)),
        truth_(truth),
        max_cells_(max_cells),
        cells_(std::move(memory.cells)),
        children_(std::move(memory.children)),
        index_(std::move(memory.index)),
        blocks_(std::move(memory.blocks)),
        models_(models) {}

  std::uint32_t depth() const { return depth_; }
  /// The heterogeneous cells of the level coded last, in Morton order. Those of the deepest level are all
  /// active.
  const std::vector<Cell>& cells() const { return cells_; }
  std::vector<Cell> takeCells() { return std::move(cells_); }
  /// At most so many bricks of 4×4×4 are they in: the cells two levels above.
  std::size_t bricks() const { return bricks_; }
  /// Memory beyond the object itself, and how much more codeLevel() takes at most.
  std::uint64_t bytes() const {
    return bytesOf(cells_) + bytesOf(children_) + bytesOf(blocks_) + index_.bytes();
  }
  std::uint64_t bytesOfNextLevel() const {
    const auto more = [](std::uint64_t needed, std::uint64_t had) { return std::max(needed, had) - had; };
    return more(CellIndex::bytesFor(bricks_), index_.bytes()) +
           more(bricks_ * sizeof(SignBlock), bytesOf(blocks_)) +
           more(std::min(max_cells_, 8 * cells_.size()) * sizeof(Cell), bytesOf(children_));
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

  Status codeLevel(std::uint32_t level, Coder& signs, Coder& leaves) {
    NothingMoved nothing;
    return codeLevel(level, signs, leaves, nothing);
  }
  /// Codes level `level` (1 to depth) from the cells of the level above. `moved`: what is known of its nodes
  /// from elsewhere,
  ///   void goTo(const Cell&)   asked of each cell of the level above, in Morton order
  ///   MovedOpinion at(int x, int y, int z, std::uint16_t one)   of a lattice node's sign, where the signs
  ///   around it give `one`
  template <class Moved>
  Status codeLevel(std::uint32_t level, Coder& signs, Coder& leaves, Moved& moved) {
    const LevelLattice parents(grid_, level - 1), lattice(grid_, level);
    index_.build(cells_, bricks_);
    clearFor(children_, std::min(max_cells_, 8 * cells_.size()));
    seed(lattice);
    const bool deepest = level == depth_;
    for (std::uint32_t number = 0; number < blocks_.size(); ++number) {
      lookAround(number);
      pull(number, 0);
      codeSigns(number, parents, lattice, signs, moved);
      if constexpr (!Coder::kPuts) {
        if (signs.overrun()) return tooShort("corner signs", level);
      }
      // No leaf bits there: the children follow from the signs while these are at hand.
      if (deepest) ISOREEL_TRY(addChildren(number, level, lattice, leaves));
    }
    for (std::uint32_t number = 0; number < blocks_.size() && !deepest; ++number) {
      lookAround(number);
      pull(number, number + 1);
      ISOREEL_TRY(addChildren(number, level, lattice, leaves));
      if constexpr (!Coder::kPuts) {
        if (leaves.overrun()) return tooShort("leaf bits", level);
      }
    }
    cells_.swap(children_);
    bricks_ = std::exchange(parents_, children_.size());
    return {};
  }

 private:
  static Status tooShort(const char* what, std::uint32_t level) {
    return {ErrorCode::kTruncated,
            std::string(what) + " of level " + std::to_string(level) + " end too early (spec codec 4.2)"};
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

  // Finds the bricks around one; in pull() and codeSigns(), `around_` is theirs.
  void lookAround(std::uint32_t number) {
    around_count_ = 0;
    const CellIndex::Around& numbers = index_.around(number);
    for (std::uint32_t offset = 0; offset < numbers.size(); ++offset) {
      around_[around_count_] = {numbers[offset], offset};
      around_count_ += numbers[offset] < blocks_.size();
    }
  }
  struct Neighbour {
    std::uint32_t number;
    std::uint32_t offset;  // as in CellIndex::Around
  };
  std::span<const Neighbour> around() const { return std::span(around_).first(around_count_); }

  // Brings what the bricks around know into a brick's block, from those with numbers of at least `from`.
  void pull(std::uint32_t number, std::uint32_t from) {
    for (const auto& [other, offset] : around()) {
      if (other >= from && other != number) blocks_[number].pull(blocks_[other], offset);
    }
  }

  // The cells around the brick that are in the grid.
  static CellBlock cellsInGrid(const CellIndex::Brick& brick, const LevelLattice& parents) {
    const std::array<std::int32_t, 3> base{4 * brick.x, 4 * brick.y, 4 * brick.z};
    std::array<std::int32_t, 3> first{}, last{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      first[axis] = std::max(-1, -base[axis]);
      last[axis] = std::min(4, parents.cells[axis] - 1 - base[axis]);
    }
    return CellBlock::box(first, last);
  }

  template <class Moved>
  void codeSigns(std::uint32_t number, const LevelLattice& parents, const LevelLattice& lattice, Coder& signs,
                 Moved& moved) {
    const CellIndex::Brick& brick = index_.bricks()[number];
    SignBlock& block = blocks_[number];
    CellBlock cells, done;  // done: their nodes are known
    for (const auto& [other, offset] : around()) {
      const std::uint64_t rows = index_.bricks()[other].rows;
      cells.add(rows, offset);
      done.add(other < number ? rows : 0, offset);
    }
    const CellBlock undivided = cellsInGrid(brick, parents).without(cells);
    for (std::uint32_t i = brick.first; i < brick.first + brick.count; ++i) {
      const Cell& cell = cells_[i];
      moved.goTo(cell);
      const int x = cell.x & 3, y = cell.y & 3, z = cell.z & 3;
      const std::uint32_t nodes = newNodesWithin({lattice.last[0] - 2 * cell.x, lattice.last[1] - 2 * cell.y,
                                                  lattice.last[2] - 2 * cell.z}) &
                                  ~newNodesOn(done.around(x, y, z));
      // Nodes that also lie on a cell of this level that is not divided: their sign is that of the corners
      // they share.
      const std::uint32_t given = nodes & newNodesOn(undivided.around(x, y, z)), coded = nodes & ~given;
      std::uint32_t inside = given & newNodesLike(cell.corners);
      SignWindow* const windows = block.windows(y, z);
      CellContexts contexts;
      contexts.start(windows, x, coded);
      if (coded != 0) {
        for (std::uint32_t left = given; left != 0; left &= left - 1) {
          const auto which = static_cast<std::size_t>(std::countr_zero(left));
          contexts.add(which, (inside >> which & 1) != 0);
        }
      }
      for (std::uint32_t left = coded; left != 0; left &= left - 1) {
        const auto which = static_cast<std::uint32_t>(std::countr_zero(left));
        const NewNode& node = kNewNodes[which];
        BitModel& model = models_.signs.of(contexts[which]);
        const int at_x = 2 * cell.x + node.x, at_y = 2 * cell.y + node.y, at_z = 2 * cell.z + node.z;
        const bool truth = truth_.sign(lattice, at_x, at_y, at_z);
        const MovedOpinion other = moved.at(at_x, at_y, at_z, model.one);
        bool sign;
        if (models_.mixed) {
          sign = other.model != nullptr
                     ? codeMixed(signs, SignOpinions::mix(model, other, cell.corners), truth)
                     : codeMixed(signs, models_.opinions.mix(model, cell.corners, which, lattice.shift == 0),
                                 truth);
        } else if (other.model != nullptr) {
          sign = signs.code(*other.model, truth);
          model.update(sign);
        } else {
          sign = signs.code(model, truth);
        }
        contexts.add(which, sign);
        inside |= std::uint32_t{sign} << which;
      }
      SignBlock::set(windows, x, {newNodesAround(nodes), newNodesAround(inside)});
      block.share(y, z);
      done.add(x, y, z);
    }
  }

  // The children that hold a sign change become cells of this level.
  Status addChildren(std::uint32_t number, std::uint32_t level, const LevelLattice& lattice, Coder& leaves) {
    const CellIndex::Brick& brick = index_.bricks()[number];
    SignBlock& block = blocks_[number];
    std::size_t count = 0;
    for (std::uint32_t i = brick.first; i < brick.first + brick.count; ++i) {
      const Cell& cell = cells_[i];
      const int x = cell.x & 3, y = cell.y & 3, z = cell.z & 3;
      const SignWindow* const windows = block.windows(y, z);
      const std::array<std::int32_t, 3> room{lattice.last[0] - 2 * cell.x, lattice.last[1] - 2 * cell.y,
                                             lattice.last[2] - 2 * cell.z};
      constexpr int kMiddle =
          kNewNodes[0].shift;  // all 27 nodes of the children are around the first new one
      const std::uint64_t signs = SignBlock::around(windows + SignBlock::kNextPlane, kMiddle + 2 * x).inside;
      const std::uint64_t corners = cornersOfChildren(signsInGrid(signs, room));
      const std::uint32_t in_grid = (2 * cell.x + 1 >= lattice.cells[0] ? 0x55u : 0xFFu) &
                                    (2 * cell.y + 1 >= lattice.cells[1] ? 0x33u : 0xFFu) &
                                    (2 * cell.z + 1 >= lattice.cells[2] ? 0x0Fu : 0xFFu);
      const auto child = [&](std::uint32_t c) {
        return Cell{static_cast<std::uint16_t>(2 * cell.x + (c & 1)),
                    static_cast<std::uint16_t>(2 * cell.y + (c >> 1 & 1)),
                    static_cast<std::uint16_t>(2 * cell.z + (c >> 2)),
                    static_cast<std::uint8_t>(corners >> 8 * c)};
      };
      std::uint32_t kept = activeChildren(corners) & in_grid;
      if (level < depth_) {
        for (std::uint32_t leaf = in_grid & ~kept; leaf != 0; leaf &= leaf - 1) {
          const std::uint32_t c = static_cast<std::uint32_t>(std::countr_zero(leaf));
          const auto [known, inside] = SignBlock::count(
              windows + (c >> 2) * SignBlock::kNextPlane,
              SignWindow::kLane * static_cast<int>(c >> 1 & 1) + 2 * x + static_cast<int>(c & 1));
          BitModel& model = models_.leaves.at(known, inside, (corners >> 8 * c & 1) != 0, depth_ - level);
          kept |= std::uint32_t{leaves.code(model, truth_.divided(level, child(c)))} << c;
        }
      }
      for (std::uint32_t c = 0; c < 8; ++c) {  // no branch: nobody guesses which are kept
        made_[count] = child(c);
        count += kept >> c & 1;
      }
    }
    if (count > max_cells_ - children_.size()) {
      return {ErrorCode::kBadData, "more cells at level " + std::to_string(level) + " than the header's " +
                                       std::to_string(max_cells_) + " vertices (spec codec 4.1)"};
    }
    children_.insert(children_.end(), made_.begin(), made_.begin() + static_cast<std::ptrdiff_t>(count));
    return {};
  }

  const Grid& grid_;
  std::uint32_t depth_;
  Truth truth_;
  std::size_t max_cells_;
  std::vector<Cell> cells_;
  std::vector<Cell> children_;
  std::size_t parents_ = 1, bricks_ = 1;  // how many cells the level above has, and that above it
  CellIndex index_;
  std::vector<SignBlock> blocks_;     // one for each brick of index_
  std::array<Neighbour, 28> around_;  // of the brick at hand, itself included
  std::size_t around_count_ = 0;
  std::array<Cell, std::size_t{8} * 64 + 1> made_;  // the children of a brick
  SignTreeModels& models_;
};

}  // namespace isoreel
