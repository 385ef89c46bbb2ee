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

#include "intra/new_nodes.h"
#include "intra/sign_context.h"
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

/// The tree while it is coded. Truth answers for the encoder, asked in Morton order within a level:
///   bool sign(const LevelLattice&, int x, int y, int z)   whether a lattice node is inside
///   bool divided(std::uint32_t level, const Cell&)        whether a cell whose corners agree holds a sign
///   change
template <class Coder, class Truth>
class SignTree {
 public:
  /// `grid` and `models` must outlive the tree.
  SignTree(const Grid& grid, Truth truth, std::size_t max_cells, SignTreeModels& models)
      : grid_(grid), depth_(octreeDepth(grid)), truth_(truth), max_cells_(max_cells), models_(models) {}

  std::uint32_t depth() const { return depth_; }
  /// The heterogeneous cells of the level coded last, in Morton order. Those of the deepest level are all
  /// active.
  const std::vector<Cell>& cells() const { return cells_; }
  /// At most so many bricks of 4×4×4 are they in: the cells two levels above.
  std::size_t bricks() const { return bricks_; }
  /// The same, when nothing more is coded: the memory of everything else is given back.
  std::vector<Cell> takeCells() {
    children_ = {};
    blocks_ = {};
    index_ = {};
    return std::move(cells_);
  }
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
      lookAround(index_.bricks()[number]);
      pull(number, 0);
      codeSigns(number, parents, lattice, signs, moved);
      if constexpr (!Coder::kPuts) {
        if (signs.overrun()) return tooShort("corner signs", level);
      }
      // No leaf bits there: the children follow from the signs while these are at hand.
      if (deepest) ISOREEL_TRY(addChildren(number, level, lattice, leaves));
    }
    for (std::uint32_t number = 0; number < blocks_.size() && !deepest; ++number) {
      lookAround(index_.bricks()[number]);
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
  void lookAround(const CellIndex::Brick& brick) {
    around_count_ = 0;
    for (int dz = -1; dz <= 1; ++dz) {
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          const std::uint32_t number = index_.brickAt(brick.x + dx, brick.y + dy, brick.z + dz);
          around_[around_count_] = {number, dx, dy, dz};
          around_count_ += number != BrickMap::kNone;
        }
      }
    }
  }
  struct Neighbour {
    std::uint32_t number;
    int dx, dy, dz;
  };
  std::span<const Neighbour> around() const { return std::span(around_).first(around_count_); }

  // Brings what the bricks around know into a brick's block, from those with numbers of at least `from`.
  void pull(std::uint32_t number, std::uint32_t from) {
    for (const auto& [other, dx, dy, dz] : around()) {
      if (other >= from && other != number) blocks_[number].pull(blocks_[other], dx, dy, dz);
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
    for (const auto& [other, dx, dy, dz] : around()) {
      cells.add(index_.bricks()[other].rows, dx, dy, dz);
      if (other < number) done.add(index_.bricks()[other].rows, dx, dy, dz);
    }
    const CellBlock undivided = cellsInGrid(brick, parents).without(cells);
    for (std::uint32_t i = brick.first; i < brick.first + brick.count; ++i) {
      const Cell& cell = cells_[i];
      moved.goTo(cell);
      const int x = cell.x & 3, y = cell.y & 3, z = cell.z & 3;
      const std::uint32_t nodes = newNodesWithin({lattice.last[0] - 2 * cell.x, lattice.last[1] - 2 * cell.y,
                                                  lattice.last[2] - 2 * cell.z}) &
                                  ~newNodesOn(done.around(x, y, z));
      const std::uint32_t beside_leaf = newNodesOn(undivided.around(x, y, z));
      SignWindow* const windows = block.windows(y, z);
      for (std::uint32_t left = nodes; left != 0; left &= left - 1) {
        const int which = std::countr_zero(left);
        const NewNode& node = kNewNodes[static_cast<std::size_t>(which)];
        SignWindow* const at = windows + node.window;
        const int shift = node.shift + 2 * x;
        bool sign;
        if (beside_leaf >> which & 1) {
          // The node also lies on a cell of this level that is not divided: its sign is that of the corners
          // they share.
          sign = (cell.corners >> node.corner & 1) != 0;
        } else {
          const SignWindow around = SignBlock::around(at, shift);
          BitModel& model = models_.signs.at(around.known, around.inside);
          const int at_x = 2 * cell.x + node.x, at_y = 2 * cell.y + node.y, at_z = 2 * cell.z + node.z;
          const bool truth = truth_.sign(lattice, at_x, at_y, at_z);
          const MovedOpinion other = moved.at(at_x, at_y, at_z, model.one);
          if (models_.mixed) {
            sign =
                other.model != nullptr
                    ? codeMixed(signs, SignOpinions::mix(model, other, cell.corners), truth)
                    : codeMixed(signs,
                                models_.opinions.mix(model, cell.corners, static_cast<std::uint32_t>(which),
                                                     lattice.shift == 0),
                                truth);
          } else if (other.model != nullptr) {
            sign = signs.code(*other.model, truth);
            model.update(sign);
          } else {
            sign = signs.code(model, truth);
          }
        }
        SignBlock::setMiddle(at, shift, sign);
      }
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
      for (; kept != 0; kept &= kept - 1)
        made_[count++] = child(static_cast<std::uint32_t>(std::countr_zero(kept)));
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
  std::size_t parents_ = 1, bricks_ = 1;  // how many cells the level above has, and that above it
  std::vector<Cell> cells_;
  std::vector<Cell> children_;
  CellIndex index_;
  std::vector<SignBlock> blocks_;     // one for each brick of index_
  std::array<Neighbour, 28> around_;  // of the brick at hand, itself included
  std::size_t around_count_ = 0;
  std::array<Cell, std::size_t{8} * 64> made_;  // the children of a brick
  SignTreeModels& models_;
};

}  // namespace isoreel
