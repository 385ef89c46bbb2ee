// SPDX-License-Identifier: BSD-3-Clause
// One slice of a level of the octree of signs (spec codec 4.3 to 4.5, 11.10): signs of the 27 corners of a
// cell's eight children, then a leaf bit for each child whose corners agree. One walk serves both directions.
#pragma once

#include <isoreel/base/status.h>
#include <isoreel/codec/grid.h>

#include <bit>
#include <span>
#include <utility>
#include <vector>

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

/// What the slices of a level share.
struct SignLevel {
  std::uint32_t level = 0;  // 1 to the depth
  LevelLattice parents, lattice;
  std::span<const Cell> cells;  // of the level above
  const CellIndex& index;       // theirs
  std::span<SignBlock> blocks;  // one for each brick of the index
  std::size_t max_cells = 0;    // that the level may have

  bool deepest() const { return lattice.shift == 0; }
  Status tooManyCells() const {
    return {ErrorCode::kBadData, "more cells at level " + std::to_string(level) + " than the header's " +
                                     std::to_string(max_cells) + " vertices (spec codec 4.1)"};
  }
};

/// What a slice is coded with. Moved: what is known of nodes from elsewhere,
///   void goTo(const Cell&)   asked of each cell of the level above, in Morton order
///   MovedOpinion at(int x, int y, int z, std::uint16_t one)   of a lattice node's sign, where the signs
///   around it give `one`
template <class Coder, class Moved>
struct SignStreams {
  Coder &signs, &leaves;
  SignTreeModels& models;
  Moved moved;
};
template <class Coder, class Moved>  // clang before 17 finds none by itself
SignStreams(Coder&, Coder&, SignTreeModels&, Moved)->SignStreams<Coder, Moved>;

/// Codes some bricks of a level, one after the other. Coder, Truth: as SignTree has them.
template <class Coder, class Truth, class Moved>
class SignSlice {
 public:
  /// For the bricks from `first`, before `end`. What is referred to must outlive the slice.
  SignSlice(const SignLevel& level, std::uint32_t first, std::uint32_t end, SignStreams<Coder, Moved> streams,
            Truth truth)
      : level_(level),
        first_(first),
        end_(end),
        signs_(streams.signs),
        leaves_(streams.leaves),
        models_(streams.models),
        moved_(std::move(streams.moved)),
        truth_(std::move(truth)) {}

  /// All corner signs. Of the bricks of other slices it knows what their blocks know, and nothing new.
  Status codeSigns() {
    for (std::uint32_t number = first_; number < end_; ++number) ISOREEL_TRY(codeSigns(number));
    return {};
  }
  /// Then the cells of the level are added to `children`, by leaf bits or, at the deepest level, by the signs
  /// alone.
  Status addChildren(std::vector<Cell>& children) {
    for (std::uint32_t number = first_; number < end_; ++number) {
      if (!level_.deepest()) {
        lookAround(number);
        pull(number, number + 1);
      }
      ISOREEL_TRY(addChildren(number, children));
    }
    return {};
  }
  /// Both at the deepest level, when there is one slice: the children follow from the signs while these are
  /// at hand.
  Status codeAll(std::vector<Cell>& children) {
    for (std::uint32_t number = first_; number < end_; ++number) {
      ISOREEL_TRY(codeSigns(number));
      ISOREEL_TRY(addChildren(number, children));
    }
    return {};
  }

 private:
  Status tooShort(const char* what) const {
    return {ErrorCode::kTruncated, std::string(what) + " of level " + std::to_string(level_.level) +
                                       " end too early (spec codec 4.2)"};
  }
  Status codeSigns(std::uint32_t number) {
    lookAround(number);
    pull(number, first_);
    codeBrick(number);
    if constexpr (!Coder::kPuts) {
      if (signs_.overrun()) return tooShort("corner signs");
    }
    return {};
  }

  // Finds the bricks around one; in pull() and codeBrick(), `around_` is theirs.
  void lookAround(std::uint32_t number) {
    around_count_ = 0;
    const CellIndex::Around& numbers = level_.index.around(number);
    for (std::uint32_t offset = 0; offset < numbers.size(); ++offset) {
      around_[around_count_] = {numbers[offset], offset};
      around_count_ += numbers[offset] < level_.blocks.size();
    }
  }
  struct Neighbour {
    std::uint32_t number;
    std::uint32_t offset;  // as in CellIndex::Around
  };
  std::span<const Neighbour> around() const { return std::span(around_).first(around_count_); }

  // Brings what the slice's bricks around know into a brick's block, from those with numbers of at least
  // `from`.
  void pull(std::uint32_t number, std::uint32_t from) {
    for (const auto& [other, offset] : around()) {
      if (other >= from && other < end_ && other != number)
        level_.blocks[number].pull(level_.blocks[other], offset);
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

  void codeBrick(std::uint32_t number) {
    const CellIndex::Brick& brick = level_.index.bricks()[number];
    SignBlock& block = level_.blocks[number];
    CellBlock cells, done;  // done: their nodes are known
    for (const auto& [other, offset] : around()) {
      const std::uint64_t rows = level_.index.bricks()[other].rows;
      cells.add(rows, offset);
      done.add(other < number ? rows : 0, offset);
    }
    const CellBlock undivided = cellsInGrid(brick, level_.parents).without(cells);
    for (std::uint32_t i = brick.first; i < brick.first + brick.count; ++i) {
      const Cell& cell = level_.cells[i];
      moved_.goTo(cell);
      const int x = cell.x & 3, y = cell.y & 3, z = cell.z & 3;
      const std::uint32_t nodes =
          newNodesWithin({level_.lattice.last[0] - 2 * cell.x, level_.lattice.last[1] - 2 * cell.y,
                          level_.lattice.last[2] - 2 * cell.z}) &
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
        const bool truth = truth_.sign(level_.lattice, at_x, at_y, at_z);
        const MovedOpinion other = moved_.at(at_x, at_y, at_z, model.one);
        bool sign = false;
        if (models_.mixed) {
          sign = other.model != nullptr
                     ? codeMixed(signs_, SignOpinions::mix(model, other, cell.corners), truth)
                     : codeMixed(signs_, models_.opinions.mix(model, cell.corners, which, level_.deepest()),
                                 truth);
        } else if (other.model != nullptr) {
          sign = signs_.code(*other.model, truth);
          model.update(sign);
        } else {
          sign = signs_.code(model, truth);
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
  Status addChildren(std::uint32_t number, std::vector<Cell>& children) {
    const LevelLattice& lattice = level_.lattice;
    const CellIndex::Brick& brick = level_.index.bricks()[number];
    SignBlock& block = level_.blocks[number];
    std::size_t count = 0;
    for (std::uint32_t i = brick.first; i < brick.first + brick.count; ++i) {
      const Cell& cell = level_.cells[i];
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
      if (!level_.deepest()) {
        for (std::uint32_t leaf = in_grid & ~kept; leaf != 0; leaf &= leaf - 1) {
          const std::uint32_t c = static_cast<std::uint32_t>(std::countr_zero(leaf));
          const auto [known, inside] = SignBlock::count(
              windows + (c >> 2) * SignBlock::kNextPlane,
              SignWindow::kLane * static_cast<int>(c >> 1 & 1) + 2 * x + static_cast<int>(c & 1));
          BitModel& model = models_.leaves.at(known, inside, (corners >> 8 * c & 1) != 0, lattice.shift);
          kept |= std::uint32_t{leaves_.code(model, truth_.divided(level_.level, child(c)))} << c;
        }
      }
      for (std::uint32_t c = 0; c < 8; ++c) {  // no branch: nobody guesses which are kept
        made_[count] = child(c);
        count += kept >> c & 1;
      }
    }
    if (count > level_.max_cells - children.size()) return level_.tooManyCells();
    children.insert(children.end(), made_.begin(), made_.begin() + static_cast<std::ptrdiff_t>(count));
    if constexpr (!Coder::kPuts) {
      if (leaves_.overrun()) return tooShort("leaf bits");
    }
    return {};
  }
  const SignLevel& level_;
  std::uint32_t first_, end_;
  Coder& signs_;
  Coder& leaves_;
  SignTreeModels& models_;
  Moved moved_;
  Truth truth_;
  std::array<Neighbour, 28> around_;  // of the brick at hand, itself included
  std::size_t around_count_ = 0;
  std::array<Cell, std::size_t{8} * 64 + 1> made_;  // the children of a brick
};

}  // namespace isoreel
