// SPDX-License-Identifier: BSD-3-Clause
// The octree of signs, coded level by level, coarse to fine (spec codec 4; paper, section 2): signs of the 27
// corners of a cell's eight children, then a leaf bit for each child whose corners agree. One walk serves
// both directions.
#pragma once

#include <isoreel/base/status.h>
#include <isoreel/codec/grid.h>

#include "intra/sign_context.h"
#include "lattice/cell_index.h"

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
  std::vector<Cell> takeCells() { return std::move(cells_); }

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

  /// Codes level `level` (1 to depth) from the cells of the level above.
  Status codeLevel(std::uint32_t level, Coder& signs, Coder& leaves) {
    const LevelLattice parents(grid_, level - 1), lattice(grid_, level);
    index_.build(cells_);
    lattice_.clear();
    seed(lattice);
    for (const CellIndex::Brick& brick : index_.bricks()) {
      codeSigns(brick, parents, lattice, signs);
      if constexpr (!Coder::kPuts) {
        if (signs.overrun()) return tooShort("corner signs", level);
      }
    }
    return codeChildren(level, lattice, leaves);
  }

 private:
  static Status tooShort(const char* what, std::uint32_t level) {
    return {ErrorCode::kTruncated,
            std::string(what) + " of level " + std::to_string(level) + " end too early (spec codec 4.2)"};
  }

  // Brings the signs of the parents' corners onto the lattice of their children.
  void seed(const LevelLattice& lattice) {
    SignBlock block;
    for (const CellIndex::Brick& brick : index_.bricks()) {
      block.known.fill(0);
      block.inside.fill(0);
      for (std::uint32_t i = brick.first; i < brick.first + brick.count; ++i) {
        const Cell& cell = cells_[i];
        for (int corner = 0; corner < 8; ++corner) {
          const int x = 2 * (cell.x + (corner & 1)), y = 2 * (cell.y + (corner >> 1 & 1)),
                    z = 2 * (cell.z + (corner >> 2));
          if (x > lattice.last[0] || y > lattice.last[1] || z > lattice.last[2]) continue;
          block.set(x - 8 * brick.x, y - 8 * brick.y, z - 8 * brick.z, (cell.corners >> corner & 1) != 0);
        }
      }
      lattice_.store(brick.x, brick.y, brick.z, block);
    }
  }

  // Which of the cells around a brick of parents are in the grid and not divided: 6×6 rows along x, from -1
  // to 4.
  struct Absent {
    std::array<std::uint8_t, 36> rows{};

    // The 3×3×3 cells around one of the brick's, in the order of SignBlock::neighbours.
    std::uint32_t around(int x, int y, int z) const {
      std::uint32_t bits = 0;
      for (int dz = 0, shift = 0; dz < 3; ++dz) {
        for (int dy = 0; dy < 3; ++dy, shift += 3) {
          bits |= ((std::uint32_t{rows[static_cast<std::size_t>((z + dz) * 6 + y + dy)]} >> x) & 7u) << shift;
        }
      }
      return bits;
    }
  };
  Absent absent(const CellIndex::Brick& brick, const LevelLattice& parents) const {
    Absent result;
    const auto inGrid = [](std::int32_t at, std::int32_t cells) { return at >= 0 && at < cells; };
    std::uint8_t row = 0;
    for (int x = -1; x <= 4; ++x)
      row = static_cast<std::uint8_t>(row | unsigned{inGrid(4 * brick.x + x, parents.cells[0])} << (x + 1));
    for (int z = -1; z <= 4; ++z) {
      for (int y = -1; y <= 4; ++y) {
        const bool in =
            inGrid(4 * brick.y + y, parents.cells[1]) && inGrid(4 * brick.z + z, parents.cells[2]);
        result.rows[static_cast<std::size_t>((z + 1) * 6 + y + 1)] = in ? row : 0;
      }
    }
    for (int dz = -1; dz <= 1; ++dz) {
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          const std::uint32_t number = index_.brickAt(brick.x + dx, brick.y + dy, brick.z + dz);
          if (number == BrickMap::kNone) continue;
          for (std::uint64_t mask = index_.bricks()[number].mask; mask != 0; mask &= mask - 1) {
            const std::uint64_t code = static_cast<std::uint64_t>(std::countr_zero(mask));
            const int x = static_cast<int>(gatherBits(code)) + 4 * dx,
                      y = static_cast<int>(gatherBits(code >> 1)) + 4 * dy,
                      z = static_cast<int>(gatherBits(code >> 2)) + 4 * dz;
            if (x < -1 || y < -1 || z < -1 || x > 4 || y > 4 || z > 4) continue;
            std::uint8_t& at = result.rows[static_cast<std::size_t>((z + 1) * 6 + y + 1)];
            at = static_cast<std::uint8_t>(at & ~(1u << (x + 1)));
          }
        }
      }
    }
    return result;
  }

  void codeSigns(const CellIndex::Brick& brick, const LevelLattice& parents, const LevelLattice& lattice,
                 Coder& signs) {
    const Absent undivided = absent(brick, parents);
    SignBlock block;
    lattice_.load(brick.x, brick.y, brick.z, block);
    const std::array<std::int32_t, 3> base{8 * brick.x, 8 * brick.y, 8 * brick.z};
    for (std::uint32_t i = brick.first; i < brick.first + brick.count; ++i) {
      const Cell& cell = cells_[i];
      const std::array<int, 3> local{cell.x & 3, cell.y & 3, cell.z & 3};
      const std::uint32_t undivided_around = undivided.around(local[0], local[1], local[2]);
      for (const auto& [dx, dy, dz, cells_at] : kNewNodes) {
        const int x = 2 * local[0] + dx, y = 2 * local[1] + dy, z = 2 * local[2] + dz;
        if (base[0] + x > lattice.last[0] || base[1] + y > lattice.last[1] || base[2] + z > lattice.last[2])
          continue;
        if (block.isKnown(x, y, z)) continue;
        bool sign;
        if (undivided_around & cells_at) {
          // The node also lies on a cell of this level that is not divided: its sign is that of the corners
          // they share.
          sign = block.isInside(2 * local[0] + (dx & 2), 2 * local[1] + (dy & 2), 2 * local[2] + (dz & 2));
        } else {
          const std::uint32_t known = SignBlock::neighbours(block.known, x, y, z);
          const std::uint32_t inside = SignBlock::neighbours(block.inside, x, y, z);
          sign = signs.code(models_.signs.at(known, inside),
                            truth_.sign(lattice, base[0] + x, base[1] + y, base[2] + z));
        }
        block.set(x, y, z, sign);
      }
    }
    lattice_.store(brick.x, brick.y, brick.z, block);
  }

  // The children that hold a sign change become the cells of this level.
  Status codeChildren(std::uint32_t level, const LevelLattice& lattice, Coder& leaves) {
    children_.clear();
    SignBlock block;
    for (const CellIndex::Brick& brick : index_.bricks()) {
      lattice_.load(brick.x, brick.y, brick.z, block);
      const std::array<std::int32_t, 3> base{8 * brick.x, 8 * brick.y, 8 * brick.z};
      for (std::uint32_t i = brick.first; i < brick.first + brick.count; ++i) {
        const std::array<int, 3> first{2 * cells_[i].x, 2 * cells_[i].y, 2 * cells_[i].z};
        const std::uint32_t signs = signsOfChildren(block, base, first, lattice);
        for (int number = 0; number < 8; ++number) {
          const std::array<int, 3> at{first[0] + (number & 1), first[1] + (number >> 1 & 1),
                                      first[2] + (number >> 2)};
          if (at[0] >= lattice.cells[0] || at[1] >= lattice.cells[1] || at[2] >= lattice.cells[2]) continue;
          const std::uint32_t from = signs >> ((number & 1) + 3 * (number >> 1 & 1) + 9 * (number >> 2));
          const Cell child{static_cast<std::uint16_t>(at[0]), static_cast<std::uint16_t>(at[1]),
                           static_cast<std::uint16_t>(at[2]),
                           static_cast<std::uint8_t>((from & 3) | (from >> 1 & 12) | (from >> 5 & 48) |
                                                     (from >> 6 & 192))};
          if (!isActive(child)) {
            if (level == depth_) continue;
            const bool sign = child.corners != 0;
            const auto [around, around_inside] =
                surroundings(block, at[0] - base[0], at[1] - base[1], at[2] - base[2]);
            BitModel& model = models_.leaves.at(around, around_inside, sign, depth_ - level);
            if (!leaves.code(model, truth_.divided(level, child))) continue;
          }
          if (children_.size() >= max_cells_) {
            return {ErrorCode::kBadData, "more cells at level " + std::to_string(level) +
                                             " than the header's " + std::to_string(max_cells_) +
                                             " vertices (spec codec 4.1)"};
          }
          children_.push_back(child);
        }
      }
      if constexpr (!Coder::kPuts) {
        if (leaves.overrun()) return tooShort("leaf bits", level);
      }
    }
    cells_.swap(children_);
    return {};
  }

  // Inside bits of the 3×3×3 nodes of a parent's children, in the order of SignBlock::neighbours. A node
  // outside the grid is as the last one inside.
  static std::uint32_t signsOfChildren(const SignBlock& block, const std::array<std::int32_t, 3>& base,
                                       const std::array<int, 3>& first, const LevelLattice& lattice) {
    std::uint32_t signs = SignBlock::neighbours(block.inside, first[0] - base[0] + 1, first[1] - base[1] + 1,
                                                first[2] - base[2] + 1);
    constexpr std::array<std::uint32_t, 3> kPlanes{0x1249249, 0x1C0E07,
                                                   0x1FF};  // the lowest nodes along each axis
    constexpr std::array<int, 3> kStrides{1, 3, 9};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (int node = 1; node <= 2; ++node) {
        if (first[axis] + node <= lattice.last[axis]) continue;
        const std::uint32_t inside = signs >> (kStrides[axis] * (node - 1)) & kPlanes[axis];
        signs = (signs & ~(kPlanes[axis] << kStrides[axis] * node)) | inside << kStrides[axis] * node;
      }
    }
    return signs;
  }

  // Known and inside bits of the 4×4×4 nodes from -1 to 2 around a child's corner 0.
  static std::pair<std::uint64_t, std::uint64_t> surroundings(const SignBlock& block, int x, int y, int z) {
    std::uint64_t known = 0, inside = 0;
    for (int dz = -1, shift = 0; dz <= 2; ++dz) {
      for (int dy = -1; dy <= 2; ++dy, shift += 4) {
        const std::size_t row = SignBlock::row(y + dy, z + dz);
        known |= static_cast<std::uint64_t>((block.known[row] >> x) & 15) << shift;
        inside |= static_cast<std::uint64_t>((block.inside[row] >> x) & 15) << shift;
      }
    }
    return {known, inside};
  }

  // A node that children add to their parent's corners, and the parent-level cells that it lies on besides
  // their parent (bits as of Absent::around).
  struct NewNode {
    int x, y, z;
    std::uint32_t cells;
  };
  // The 19 of them: the parent's middle, the middles of its faces, then of its edges.
  static constexpr auto kNewNodes = [] {
    std::array<NewNode, 19> nodes{{{1, 1, 1, 0},
                                   {1, 1, 0, 0},
                                   {1, 0, 1, 0},
                                   {0, 1, 1, 0},
                                   {1, 1, 2, 0},
                                   {1, 2, 1, 0},
                                   {2, 1, 1, 0},
                                   {1, 0, 0, 0},
                                   {0, 1, 0, 0},
                                   {0, 0, 1, 0},
                                   {1, 2, 0, 0},
                                   {2, 1, 0, 0},
                                   {1, 0, 2, 0},
                                   {0, 1, 2, 0},
                                   {2, 0, 1, 0},
                                   {0, 2, 1, 0},
                                   {1, 2, 2, 0},
                                   {2, 1, 2, 0},
                                   {2, 2, 1, 0}}};
    for (NewNode& node : nodes) {
      for (int z = std::min(node.z, 1); z <= std::max(node.z, 1); ++z) {
        for (int y = std::min(node.y, 1); y <= std::max(node.y, 1); ++y) {
          for (int x = std::min(node.x, 1); x <= std::max(node.x, 1); ++x) {
            if (x != 1 || y != 1 || z != 1) node.cells |= 1u << (x + 3 * y + 9 * z);
          }
        }
      }
    }
    return nodes;
  }();

  const Grid& grid_;
  std::uint32_t depth_;
  Truth truth_;
  std::size_t max_cells_;
  std::vector<Cell> cells_;
  std::vector<Cell> children_;
  CellIndex index_;
  SignLattice lattice_;
  SignTreeModels& models_;
};

}  // namespace isoreel
