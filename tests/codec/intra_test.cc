// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "intra/sign_tree.h"
#include "intra/vertex_coder.h"
#include "made.h"

namespace isoreel {
namespace {

/// Answers the tree coder straight from the samples; nothing is built beforehand.
struct SampleTruth {
  const made::Made* made;

  bool at(std::uint32_t x, std::uint32_t y, std::uint32_t z) const {
    return isInside(made->volume.at(x, y, z), made->isovalue, made->inside);
  }
  bool sign(const LevelLattice& lattice, int x, int y, int z) const {
    return at(static_cast<std::uint32_t>(x) << lattice.shift, static_cast<std::uint32_t>(y) << lattice.shift,
              static_cast<std::uint32_t>(z) << lattice.shift);
  }
  bool divided(std::uint32_t level, const Cell& cell) const {
    const auto& nodes = made->volume.grid.nodes;
    const std::uint32_t size = 1u << (made::depthOf(made->volume.grid) - level);
    const bool first = at(cell.x * size, cell.y * size, cell.z * size);
    for (std::uint32_t z = cell.z * size; z <= std::min((cell.z + 1) * size, nodes[2] - 1); ++z) {
      for (std::uint32_t y = cell.y * size; y <= std::min((cell.y + 1) * size, nodes[1] - 1); ++y) {
        for (std::uint32_t x = cell.x * size; x <= std::min((cell.x + 1) * size, nodes[0] - 1); ++x) {
          if (at(x, y, z) != first) return true;
        }
      }
    }
    return false;
  }
};

TEST(CellContexts, AreThoseOfTheWindows) {
  made::Random random(11);
  SignModels models;
  for (int trial = 0; trial < 300; ++trial) {
    SignBlock block;
    const auto any = [&] { return static_cast<int>(random() % 4); };
    for (int i = 0; i < 24; ++i) block.seed(any(), any(), any(), random() & 0xFF, random() & 0xFF);
    block.agree();
    const int x = any();
    SignWindow* const windows = block.windows(any(), any());
    CellContexts contexts;
    contexts.start(windows, x, kAllNewNodes);
    std::uint32_t known = 0, inside = 0;
    for (std::uint32_t i = 0; i < kNewNodes.size(); ++i) {
      SignBlock::set(windows, x, {newNodesAround(known), newNodesAround(inside)});
      const SignWindow around = SignBlock::around(windows + kNewNodes[i].window, kNewNodes[i].shift + 2 * x);
      ASSERT_EQ(&models.of(contexts[i]), &models.at(around.known, around.inside)) << trial << " " << i;
      if (random() % 4 == 0) continue;  // outside the grid, or known before
      const bool sign = random() % 2 != 0;
      contexts.add(i, sign);
      known |= 1u << i;
      inside |= std::uint32_t{sign} << i;
    }
  }
}

template <class Tree, class Coder>
Status codeLevel(Tree& tree, std::uint32_t level, Coder& signs, Coder& leaves, SignTreeModels& models) {
  if (level == 0) return tree.codeRoot(signs, leaves);
  return tree.codeLevel(level, [&](std::size_t) {
    return SignStreams{signs, leaves, models, NothingMoved{}};
  });
}

TEST(SignTree, DecodesTheCellsOfEveryLevel) {
  for (const made::Made& m : made::all()) {
    SCOPED_TRACE(m.name);
    const Grid& grid = m.volume.grid;
    SignTreeModels put_models, get_models;
    SignTree<RangePut, SampleTruth> put(grid, {&m}, 1u << 20);
    SignTree<RangeGet, UnknownTruth> get(grid, {}, 1u << 20);
    ASSERT_EQ(put.depth(), made::depthOf(grid));
    for (std::uint32_t level = 0; level <= put.depth(); ++level) {
      Bytes sign_bytes, leaf_bytes;
      RangePut signs(sign_bytes), leaves(leaf_bytes);
      ASSERT_TRUE(codeLevel(put, level, signs, leaves, put_models).ok());
      signs.finish();
      leaves.finish();
      RangeGet get_signs(sign_bytes), get_leaves(leaf_bytes);
      const Status status = codeLevel(get, level, get_signs, get_leaves, get_models);
      ASSERT_TRUE(status.ok()) << status.message();
      EXPECT_TRUE(get_signs.finished());
      EXPECT_TRUE(get_leaves.finished());

      const made::Reference expected = made::reference(m, level);
      std::size_t next = 0;
      for (const Cell& cell : get.cells()) {
        if (!isActive(cell)) continue;
        ASSERT_LT(next, expected.cells.size());
        const made::ReferenceCell& e = expected.cells[next++];
        ASSERT_EQ((std::array<std::uint32_t, 3>{cell.x, cell.y, cell.z}), e.at);
        ASSERT_EQ(cell.corners, e.corners);
      }
      EXPECT_EQ(next, expected.cells.size()) << "level " << level;
      if (get.cells().empty()) break;
    }
  }
}

TEST(SignTree, StopsAtMoreCellsThanAllowed) {
  const made::Made& m = made::named("sphere");
  SignTreeModels models;
  SignTree<RangePut, SampleTruth> tree(m.volume.grid, {&m}, 10);
  Status status;
  for (std::uint32_t level = 0; level <= tree.depth() && status.ok(); ++level) {
    Bytes bytes, more;
    RangePut signs(bytes), leaves(more);
    status = codeLevel(tree, level, signs, leaves, models);
  }
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.message().find("than the header's 10 vertices (spec codec 4.1)"), std::string_view::npos)
      << status.message();
}

TEST(SignTree, EndlessZerosEnd) {
  // The widest grid and a stream that has ended: the coder must give up soon, not walk 2^48 nodes.
  const Grid grid = made::gridOf(kMaxNodes, kMaxNodes, kMaxNodes);
  for (const std::uint8_t byte : {std::uint8_t{0}, std::uint8_t{0x80}, std::uint8_t{0xFF}}) {
    SignTreeModels models;
    SignTree<RangeGet, UnknownTruth> tree(grid, {}, 1u << 20);
    const Bytes bytes(20, byte);
    Status status;
    for (std::uint32_t level = 0; level <= tree.depth() && status.ok(); ++level) {
      RangeGet signs(bytes), leaves(bytes);
      status = codeLevel(tree, level, signs, leaves, models);
      if (tree.cells().empty()) break;
    }
    EXPECT_TRUE(!status.ok() || tree.cells().empty());
  }
}

// The bit of the neighbour at (dx, dy, dz) in what SignBlock::around gives.
std::uint64_t nodeAt(int dx, int dy, int dz) {
  return std::uint64_t{1} << (dx + 1 + 3 * (dz + 1) + SignWindow::kLane * (dy + 1));
}

TEST(SignModels, StartFromTheVoteOfTheirContext) {
  SignModels models;
  const std::uint64_t all = 0x1FF * SignWindow::kLanes & ~nodeAt(0, 0, 0);
  EXPECT_EQ(models.at(0, 0).one, 32768);
  EXPECT_EQ(models.at(all, all).one, 62259);
  EXPECT_EQ(models.at(all, 0).one, 3277);
  const std::uint64_t face = nodeAt(0, 0, -1), edge = nodeAt(0, -1, -1), corner = nodeAt(1, 1, 1);
  EXPECT_EQ(models.at(face, face).one, 32768 + 4 * 1638);
  EXPECT_EQ(models.at(edge, 0).one, 32768 - 2 * 1638);
  EXPECT_EQ(models.at(corner, corner).one, 32768 + 1638);
  models.at(0, 0).update(true);
  models.reset();
  EXPECT_EQ(models.at(0, 0).one, 32768);
}

TEST(SignModels, TellTheContextsOfTheSpecificationApart) {
  SignModels models;
  made::Random random(8);
  std::map<std::array<int, 8>, BitModel*> expected;
  for (int trial = 0; trial < 30000; ++trial) {
    std::uint64_t known = 0, inside = 0;
    std::array<int, 8> context{};  // the six states, then the two balances
    int face = 0;
    for (int dz = -1; dz <= 1; ++dz) {
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          const int axes = std::abs(dx) + std::abs(dy) + std::abs(dz);
          const int state = axes == 0 ? 0 : static_cast<int>(random() % 3);
          if (state != 0) known |= nodeAt(dx, dy, dz);
          if (state == 2) inside |= nodeAt(dx, dy, dz);
          if (axes == 1) context[static_cast<std::size_t>(face++)] = state;
          if (axes > 1) context[static_cast<std::size_t>(axes + 4)] += state == 0 ? 0 : state == 2 ? 1 : -1;
        }
      }
    }
    context[6] = std::clamp(context[6], -4, 4);
    context[7] = std::clamp(context[7], -3, 3);
    BitModel* model = &models.at(known, inside);
    ASSERT_EQ(expected.try_emplace(context, model).first->second, model);
  }
  std::set<BitModel*> apart;
  for (const auto& [context, model] : expected) apart.insert(model);
  EXPECT_EQ(apart.size(), expected.size());
}

TEST(NewNodes, AgreeWithTheirDefinition) {
  made::Random random(9);
  for (int trial = 0; trial < 3000; ++trial) {
    const std::uint32_t cells = random() & random() & ((1u << 27) - 1);
    const std::array<std::int32_t, 3> room{static_cast<std::int32_t>(random() % 4),
                                           static_cast<std::int32_t>(random() % 4),
                                           static_cast<std::int32_t>(random() % 4)};
    std::uint32_t on = 0, within = 0;
    for (std::size_t i = 0; i < kNewNodes.size(); ++i) {
      const std::array<int, 3> node{kNewNodes[i].x, kNewNodes[i].y, kNewNodes[i].z};
      EXPECT_EQ(kNewNodes[i].corner, node[0] / 2 + 2 * (node[1] / 2) + 4 * (node[2] / 2));
      for (int cell = 0; cell < 27; ++cell) {
        const std::array<int, 3> offset{cell % 3 - 1, cell / 9 - 1, cell / 3 % 3 - 1};
        bool touches = cell != 13 && (cells >> cell & 1) != 0;
        for (std::size_t axis = 0; axis < 3; ++axis)
          touches = touches && node[axis] >= 2 * offset[axis] && node[axis] <= 2 * offset[axis] + 2;
        if (touches) on |= 1u << i;
      }
      if (node[0] <= room[0] && node[1] <= room[1] && node[2] <= room[2]) within |= 1u << i;
    }
    ASSERT_EQ(newNodesOn(cells), on);
    ASSERT_EQ(newNodesWithin(room), within);
  }
}

TEST(NewNodes, MakeTheCornersOfChildren) {
  made::Random random(10);
  for (int trial = 0; trial < 3000; ++trial) {
    const std::array<std::int32_t, 3> room{static_cast<std::int32_t>(random() % 4),
                                           static_cast<std::int32_t>(random() % 4),
                                           static_cast<std::int32_t>(random() % 4)};
    std::uint64_t signs = 0;
    for (int node = 0; node < 27; ++node) {
      if (random() & 1) signs |= nodeAt(node % 3 - 1, node / 3 % 3 - 1, node / 9 - 1);
    }
    std::uint64_t corners = 0;
    for (int child = 0; child < 8; ++child) {
      for (int corner = 0; corner < 8; ++corner) {
        const int x = std::min((child & 1) + (corner & 1), room[0]),
                  y = std::min((child >> 1 & 1) + (corner >> 1 & 1), room[1]),
                  z = std::min((child >> 2) + (corner >> 2), room[2]);
        if (signs & nodeAt(x - 1, y - 1, z - 1)) corners |= std::uint64_t{1} << (8 * child + corner);
      }
    }
    ASSERT_EQ(cornersOfChildren(signsInGrid(signs, room)), corners);
    std::uint64_t uniform = corners;  // some children with corners that agree
    for (int child = 0; child < 8; ++child) {
      if (random() % 2 == 0) continue;
      uniform &= ~(std::uint64_t{0xFF} << 8 * child);
      if (random() % 2 == 0) uniform |= std::uint64_t{0xFF} << 8 * child;
    }
    for (int child = 0; child < 8; ++child) {
      Cell cell;
      cell.corners = static_cast<std::uint8_t>(uniform >> 8 * child);
      ASSERT_EQ(activeChildren(uniform) >> child & 1, std::uint32_t{isActive(cell)});
    }
  }
}

TEST(LeafModels, TellTheContextsOfTheSpecificationApart) {
  LeafModels models;
  const auto of = [&](std::uint32_t others, std::uint32_t known, bool sign, std::uint32_t below) {
    return &models.at(known, sign ? known - others : others, sign, below);
  };
  EXPECT_EQ(of(3, 64, false, 1), of(4, 64, false, 1));
  EXPECT_NE(of(4, 64, false, 1), of(5, 64, false, 1));
  EXPECT_EQ(of(9, 64, true, 2), of(20, 64, true, 2));
  EXPECT_NE(of(1, 64, true, 2), of(1, 64, false, 2));
  EXPECT_EQ(of(0, 56, false, 1), of(0, 63, false, 1));
  EXPECT_NE(of(0, 64, false, 1), of(0, 63, false, 1));
  EXPECT_NE(of(0, 55, false, 1), of(0, 56, false, 1));
  EXPECT_EQ(of(0, 40, false, 1), of(0, 55, false, 1));
  EXPECT_NE(of(0, 39, false, 1), of(0, 40, false, 1));
  EXPECT_EQ(of(0, 64, false, 4), of(0, 64, false, 16));
  EXPECT_NE(of(0, 64, false, 3), of(0, 64, false, 4));
}

TEST(Reconstruct, StaysInTheCellAndFollowsTheFrame) {
  made::Random random(7);
  for (int trial = 0; trial < 20000; ++trial) {
    const LocalFrame& frame = kLocalFrames[random() & 255];
    const auto value = [&] { return static_cast<std::int32_t>(random() % 131071) - 65535; };
    const ResidualSteps steps{static_cast<std::int32_t>(random() % kCell) + 1,
                              static_cast<std::int32_t>(random() % kCell) + 1};
    const auto wild = reconstruct(frame, {value(), value(), value()}, steps);
    for (const std::int32_t x : wild) {
      ASSERT_GE(x, 0);
      ASSERT_LE(x, kCell);
    }
    const Residual small{static_cast<std::int32_t>(random() % 5) - 2,
                         static_cast<std::int32_t>(random() % 5) - 2,
                         static_cast<std::int32_t>(random() % 5) - 2};
    const auto near = reconstruct(frame, small, {64, 128});
    for (std::size_t k = 0; k < 3; ++k) {
      const double exact =
          frame.vertex[k] + (64.0 * small[0] * frame.normal[k] + 128.0 * small[1] * frame.tangent1[k] +
                             128.0 * small[2] * frame.tangent2[k]) /
                                kCell;
      ASSERT_NEAR(near[k], std::clamp(exact, 0.0, double{kCell}), 0.5001);
    }
    ASSERT_EQ(reconstruct(frame, {0, 0, 0}, steps), frame.vertex);
  }
}

}  // namespace
}  // namespace isoreel
