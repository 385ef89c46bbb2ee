// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include "intra/new_nodes.h"
#include "lattice/bits.h"
#include "lattice/brick_map.h"
#include "lattice/cell_block.h"
#include "lattice/cell_index.h"
#include "lattice/dual_mesh.h"
#include "lattice/sign_block.h"
#include "lattice/sign_tables.h"
#include "made.h"

namespace isoreel {
namespace {

using Place = std::array<std::int32_t, 3>;

TEST(Morton, InterleavesAndBack) {
  made::Random random(1);
  for (int trial = 0; trial < 2000; ++trial) {
    const std::uint32_t x = random() & 0xFFFF, y = random() & 0xFFFF, z = random() & 0xFFFF;
    const std::uint64_t code = mortonCode(x, y, z);
    EXPECT_EQ(gatherBits(code), x);
    EXPECT_EQ(gatherBits(code >> 1), y);
    EXPECT_EQ(gatherBits(code >> 2), z);
  }
  EXPECT_EQ(mortonCode(1, 0, 0), 1u);
  EXPECT_EQ(mortonCode(0, 1, 0), 2u);
  EXPECT_EQ(mortonCode(0, 0, 3), 4u + 32u);
}

TEST(CountBits, AgreesWithTheStandard) {
  made::Random random(5);
  for (int trial = 0; trial < 2000; ++trial) {
    std::uint64_t value = std::uint64_t{random()} << 32 | random();
    if (trial % 2 != 0) value &= std::uint64_t{random()} << 32 | random();
    ASSERT_EQ(countBits(value), static_cast<std::uint32_t>(std::popcount(value)));
  }
  EXPECT_EQ(countBits(0), 0u);
  EXPECT_EQ(countBits(~std::uint64_t{0}), 64u);
}

TEST(BrickMap, AgreesWithAMap) {
  made::Random random(2);
  BrickMap map;
  std::map<Place, std::uint32_t> expected;
  for (int trial = 0; trial < 30000; ++trial) {
    const auto coordinate = [&] {
      const std::int32_t near = static_cast<std::int32_t>(random() % 20);
      return random() % 2 == 0 ? near - 1 : 65536 - near;
    };
    const Place p{coordinate(), coordinate(), coordinate()};
    const auto found = expected.find(p);
    ASSERT_EQ(map.find(p[0], p[1], p[2]), found == expected.end() ? BrickMap::kNone : found->second);
    const std::uint32_t number =
        expected.try_emplace(p, static_cast<std::uint32_t>(expected.size())).first->second;
    ASSERT_EQ(map.findOrAdd(p[0], p[1], p[2]), number);
  }
  EXPECT_EQ(map.size(), expected.size());
  map.clear();
  EXPECT_EQ(map.size(), 0u);
  EXPECT_EQ(map.find(0, 0, 0), BrickMap::kNone);
}

TEST(CellIndex, AgreesWithAMapUpToTheHighestCells) {
  for (const std::uint32_t base : {0u, 65535u - 24u}) {
    made::Random random(3 + base);
    std::set<std::uint64_t> codes;
    for (int i = 0; i < 3000; ++i)
      codes.insert(mortonCode(base + random() % 25, base + random() % 25, base + random() % 25));
    std::vector<Cell> cells;
    std::map<Place, std::uint32_t> expected;
    for (const std::uint64_t code : codes) {
      const std::uint32_t x = gatherBits(code), y = gatherBits(code >> 1), z = gatherBits(code >> 2);
      expected[{static_cast<std::int32_t>(x), static_cast<std::int32_t>(y), static_cast<std::int32_t>(z)}] =
          static_cast<std::uint32_t>(cells.size());
      cells.push_back(
          {static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y), static_cast<std::uint16_t>(z), 1});
    }
    CellIndex index;
    index.build(cells);
    const std::int32_t low = static_cast<std::int32_t>(base) - 1;
    for (std::int32_t z = low; z <= low + 26; ++z) {
      for (std::int32_t y = low; y <= low + 26; ++y) {
        for (std::int32_t x = low; x <= low + 26; ++x) {
          const auto found = expected.find({x, y, z});
          ASSERT_EQ(index.find(x, y, z), found == expected.end() ? CellIndex::kNone : found->second);
        }
      }
    }
    std::uint32_t next = 0;
    for (const CellIndex::Brick& brick : index.bricks()) {
      EXPECT_EQ(brick.first, next);
      next += brick.count;
    }
    EXPECT_EQ(next, cells.size());
    for (std::uint32_t i = 0; i < next; ++i) {
      const CellIndex::Around places = index.placesAround(cells[i].x, cells[i].y, cells[i].z);
      for (int n = 0; n < 27; ++n) {
        const auto found =
            expected.find({cells[i].x + n % 3 - 1, cells[i].y + n / 3 % 3 - 1, cells[i].z + n / 9 - 1});
        ASSERT_EQ(places[static_cast<std::size_t>(n)],
                  found == expected.end() ? CellIndex::kNone : found->second);
      }
    }
    for (std::size_t i = 0; i < index.bricks().size(); ++i) {
      const CellIndex::Brick& brick = index.bricks()[i];
      for (int n = 0; n < 27; ++n) {
        const std::uint32_t other =
            index.brickAt(brick.x + n % 3 - 1, brick.y + n / 3 % 3 - 1, brick.z + n / 9 - 1);
        ASSERT_EQ(index.around(i)[static_cast<std::size_t>(n)],
                  other == CellIndex::kNone ? index.bricks().size() : other);
      }
    }
  }
}

TEST(CellBlock, AgreesWithASet) {
  made::Random random(6);
  for (int trial = 0; trial < 40; ++trial) {
    CellBlock block;
    std::set<Place> expected;
    for (int brick = 0; brick < 27; ++brick) {
      if (random() % 2 == 0) continue;
      const std::uint64_t rows = std::uint64_t{random()} << 32 | random();
      const Place offset{brick % 3 - 1, brick / 3 % 3 - 1, brick / 9 - 1};
      block.add(rows, static_cast<std::uint32_t>(brick));
      for (int bit = 0; bit < 64; ++bit) {
        if (rows >> bit & 1)
          expected.insert(
              {4 * offset[0] + (bit & 3), 4 * offset[1] + (bit >> 2 & 3), 4 * offset[2] + (bit >> 4)});
      }
    }
    CellBlock one;
    one.add(2, 0, 3);
    for (int z = -1; z <= 4; ++z) {
      for (int y = -1; y <= 4; ++y) {
        for (int x = -1; x <= 4; ++x) {
          ASSERT_EQ(block.has(x, y, z), expected.contains({x, y, z}));
          ASSERT_EQ(one.without(block).has(x, y, z),
                    Place({x, y, z}) == Place({2, 0, 3}) && !block.has(x, y, z));
        }
      }
    }
    for (int bit = 0; bit < 27 * 64; ++bit) {
      const int x = bit & 3, y = bit >> 2 & 3, z = bit >> 4 & 3, around = bit >> 6;
      ASSERT_EQ(
          block.around(x, y, z) >> around & 1,
          std::uint32_t{expected.contains({x + around % 3 - 1, y + around / 9 - 1, z + around / 3 % 3 - 1})});
    }
  }
}

TEST(CellBlock, HoldsABox) {
  made::Random random(12);
  for (int trial = 0; trial < 200; ++trial) {
    Place first{}, last{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      first[axis] = static_cast<std::int32_t>(random() % 6) - 1;
      last[axis] =
          first[axis] + static_cast<std::int32_t>(random() % static_cast<std::uint32_t>(5 - first[axis]));
    }
    const CellBlock box = CellBlock::box(first, last);
    for (int i = 0; i < 216; ++i) {
      const Place at{i % 6 - 1, i / 6 % 6 - 1, i / 36 - 1};
      bool in = true;
      for (std::size_t axis = 0; axis < 3; ++axis)
        in = in && at[axis] >= first[axis] && at[axis] <= last[axis];
      ASSERT_EQ(box.has(at[0], at[1], at[2]), in);
    }
  }
}

// A lattice of 2×2×2 bricks whose blocks know what they are told, next to a map of it.
class SignBlocks : public testing::Test {
 protected:
  static constexpr int kSide = 2;
  SignBlock& block(const Place& brick) {
    return blocks_[static_cast<std::size_t>(brick[0] + kSide * (brick[1] + kSide * brick[2]))];
  }
  static Place brickOf(int number) { return {number & 1, number >> 1 & 1, number >> 2}; }
  void seed(const Place& brick, int x, int y, int z, std::uint32_t known, std::uint32_t corners) {
    block(brick).seed(x, y, z, known, corners);
    for (int corner = 0; corner < 8; ++corner) {
      if ((known >> corner & 1) == 0) continue;
      expected_[{8 * brick[0] + 2 * (x + (corner & 1)), 8 * brick[1] + 2 * (y + (corner >> 1 & 1)),
                 8 * brick[2] + 2 * (z + (corner >> 2))}] = (corners >> corner & 1) != 0;
    }
  }
  void pull(const Place& brick) {
    for (int number = 0; number < 8; ++number) {
      const Place other = brickOf(number);
      if (other != brick)
        block(brick).pull(block(other),
                          static_cast<std::uint32_t>(13 + other[0] - brick[0] + 3 * (other[1] - brick[1]) +
                                                     9 * (other[2] - brick[2])));
    }
  }
  void check(const Place& brick) {
    const SignBlock& found = block(brick);
    for (int z = -1; z <= 9; ++z) {
      for (int y = -1; y <= 9; ++y) {
        for (int x = -1; x <= 9; ++x) {
          const auto known = expected_.find({8 * brick[0] + x, 8 * brick[1] + y, 8 * brick[2] + z});
          ASSERT_EQ(found.isKnown(x, y, z), known != expected_.end()) << x << " " << y << " " << z;
          ASSERT_EQ(found.isInside(x, y, z), known != expected_.end() && known->second);
        }
      }
    }
  }

  std::array<SignBlock, 8> blocks_;
  std::map<Place, bool> expected_;
};

TEST_F(SignBlocks, AgreeWithAMap) {
  made::Random random(4);
  const auto sign = [](const Place& node) { return (node[0] * 7 + node[1] * 5 + node[2] * 3) % 4 < 2; };
  for (int number = 0; number < 8; ++number) {
    const Place brick = brickOf(number);
    for (int i = 0; i < 12; ++i) {
      const Place at{static_cast<int>(random() % 4), static_cast<int>(random() % 4),
                     static_cast<int>(random() % 4)};
      std::uint32_t corners = 0;
      for (int c = 0; c < 8; ++c) {
        const Place node{8 * brick[0] + 2 * (at[0] + (c & 1)), 8 * brick[1] + 2 * (at[1] + (c >> 1 & 1)),
                         8 * brick[2] + 2 * (at[2] + (c >> 2))};
        corners |= std::uint32_t{sign(node)} << c;
      }
      seed(brick, at[0], at[1], at[2], random() & 0xFF, corners);
    }
    block(brick).agree();
  }
  // Twice: the second round brings what bricks learned after others had pulled.
  for (int round = 0; round < 2; ++round) {
    for (int number = 0; number < 8; ++number) {
      const Place brick = brickOf(number);
      pull(brick);
      if (number == 0 || round == 1) check(brick);
      if (round == 1) continue;
      for (int i = 0; i < 6; ++i) {  // all new nodes of a cell
        const int x = static_cast<int>(random() % 4), y = static_cast<int>(random() % 4),
                  z = static_cast<int>(random() % 4);
        std::uint32_t inside = 0;
        for (std::size_t n = 0; n < kNewNodes.size(); ++n) {
          const NewNode& node = kNewNodes[n];
          const Place at{8 * brick[0] + 2 * x + node.x, 8 * brick[1] + 2 * y + node.y,
                         8 * brick[2] + 2 * z + node.z};
          inside |= std::uint32_t{sign(at)} << n;
          expected_[at] = sign(at);
        }
        SignBlock::set(block(brick).windows(y, z), x, {newNodesAround(kAllNewNodes), newNodesAround(inside)});
        block(brick).share(y, z);
      }
    }
  }
}

TEST_F(SignBlocks, AnswerAsNodeByNode) {
  made::Random random(7);
  for (int i = 0; i < 20; ++i)
    seed({0, 0, 0}, static_cast<int>(random() % 4), static_cast<int>(random() % 4),
         static_cast<int>(random() % 4), random() & 0xFF, 0xF0);
  SignBlock& b = block({0, 0, 0});
  b.agree();
  for (int cell = 0; cell < 64; ++cell) {
    const int x = cell & 3, y = cell >> 2 & 3, z = cell >> 4;
    for (const NewNode& node : kNewNodes) {
      const SignWindow around = SignBlock::around(b.windows(y, z) + node.window, node.shift + 2 * x);
      for (int bit = 0; bit < 27; ++bit) {
        const Place at{2 * x + node.x + bit % 3 - 1, 2 * y + node.y + bit / 9 - 1,
                       2 * z + node.z + bit / 3 % 3 - 1};
        const int place = bit % 9 + SignWindow::kLane * (bit / 9);
        ASSERT_EQ(around.known >> place & 1, std::uint64_t{b.isKnown(at[0], at[1], at[2])});
        ASSERT_EQ(around.inside >> place & 1, std::uint64_t{b.isInside(at[0], at[1], at[2])});
      }
    }
    for (int child = 0; child < 8; ++child) {
      const int cx = child & 1, cy = child >> 1 & 1, cz = child >> 2;
      std::uint32_t known = 0, inside = 0;
      for (int node = 0; node < 64; ++node) {
        const Place at{2 * x + cx + (node & 3) - 1, 2 * y + cy + (node >> 2 & 3) - 1,
                       2 * z + cz + (node >> 4) - 1};
        known += b.isKnown(at[0], at[1], at[2]);
        inside += b.isInside(at[0], at[1], at[2]);
      }
      const auto counts =
          SignBlock::count(b.windows(y, z) + cz * SignBlock::kNextPlane, SignWindow::kLane * cy + 2 * x + cx);
      ASSERT_EQ(counts, std::pair(known, inside));
    }
  }
}

double dot(const std::array<std::int32_t, 3>& a, const std::array<std::int32_t, 3>& b) {
  double sum = 0;
  for (std::size_t k = 0; k < 3; ++k) sum += static_cast<double>(a[k]) * b[k];
  return sum / kCell / kCell;
}

TEST(LocalFrames, AreOrthonormalWithinRounding) {
  for (const LocalFrame& frame : kLocalFrames) {
    const std::array<const std::array<std::int32_t, 3>*, 3> axes{&frame.normal, &frame.tangent1,
                                                                 &frame.tangent2};
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) EXPECT_NEAR(dot(*axes[i], *axes[j]), i == j ? 1 : 0, 1.5 / kCell);
    }
    // Right-handed.
    const auto& n = frame.normal;
    const auto& t = frame.tangent1;
    const std::array<double, 3> cross{static_cast<double>(n[1]) * t[2] - static_cast<double>(n[2]) * t[1],
                                      static_cast<double>(n[2]) * t[0] - static_cast<double>(n[0]) * t[2],
                                      static_cast<double>(n[0]) * t[1] - static_cast<double>(n[1]) * t[0]};
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(cross[k] / kCell, frame.tangent2[k], 3);
  }
}

TEST(LocalFrames, KeepTheVertexInItsCellAndPointOutside) {
  for (std::size_t c = 0; c < 256; ++c) {
    const LocalFrame& frame = kLocalFrames[c];
    std::array<double, 3> gradient{};
    for (std::size_t j = 0; j < 8; ++j) {
      for (std::size_t k = 0; k < 3; ++k)
        gradient[k] += ((j >> k & 1) != 0 ? 1 : -1) * ((c >> j & 1) != 0 ? -1 : 1);
    }
    double along = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      along += gradient[k] * frame.normal[k];
      EXPECT_GE(frame.vertex[k], 0);
      EXPECT_LE(frame.vertex[k], kCell);
    }
    const double length = std::hypot(gradient[0], gradient[1], gradient[2]);
    EXPECT_NEAR(along / kCell, length, 0.001) << "configuration " << c;
    // The complement has the same vertex and the opposite normal.
    EXPECT_EQ(frame.vertex, kLocalFrames[255 - c].vertex);
    if (length > 0) {
      for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(frame.normal[k], -kLocalFrames[255 - c].normal[k]);
    }
  }
}

TEST(LocalFrames, AreThoseOfTheSpecification) {
  std::ifstream table(ISOREEL_SPEC "/tables/local_frames.csv");
  std::ostringstream expected;
  expected << "configuration,vertex_x,vertex_y,vertex_z,normal_x,normal_y,normal_z,tangent1_x,tangent1_y,"
              "tangent1_z,"
              "tangent2_x,tangent2_y,tangent2_z\n";
  for (std::size_t c = 0; c < 256; ++c) {
    expected << c;
    for (const auto* v : {&kLocalFrames[c].vertex, &kLocalFrames[c].normal, &kLocalFrames[c].tangent1,
                          &kLocalFrames[c].tangent2}) {
      for (const std::int32_t x : *v) expected << "," << x;
    }
    expected << "\n";
  }
  std::ostringstream found;
  found << table.rdbuf();
  EXPECT_EQ(found.str(), expected.str());
}

TEST(DualMesh, AgreesWithTheReference) {
  for (const made::Made& m : made::all()) {
    const made::Reference reference = made::reference(m, made::depthOf(m.volume.grid));
    std::vector<Cell> cells;
    for (const made::ReferenceCell& c : reference.cells) {
      cells.push_back({static_cast<std::uint16_t>(c.at[0]), static_cast<std::uint16_t>(c.at[1]),
                       static_cast<std::uint16_t>(c.at[2]), c.corners});
    }
    CellIndex index;
    index.build(cells);
    EXPECT_EQ(dualQuads(cells, index), reference.quads) << m.name;
  }
}

TEST(Triangles, SplitAlongTheShorterDiagonalInTheWorld) {
  const made::Made& m = made::named("sphere");
  auto surface = extractSurface(m.volume, m.isovalue, m.inside);
  ASSERT_TRUE(surface.ok());
  made::Random random(11);
  for (GridPosition& p : surface->vertices) {
    for (std::int32_t& x : p)
      x += static_cast<std::int32_t>(random() % 3) * kCell / 8;  // many equal diagonals
  }
  for (int turned = 0; turned < 2; ++turned) {
    for (const double mirror : {1.0, -1.0}) {
      Grid& grid = surface->grid;
      grid.origin = {1e6, -0.1, 3};
      grid.spacing = {0.1, 0.1, 0.3};
      grid.direction = turned != 0 ? std::array<double, 9>{0.6, -0.8, 0, 0.8, 0.6, 0, 0, 0, mirror}
                                   : std::array<double, 9>{mirror, 0, 0, 0, 1, 0, 0, 0, 1};
      std::vector<Triangle> expected;
      for (const auto& [a, b, c, d] : surface->quads) {
        const auto squared = [&](std::uint32_t i, std::uint32_t j) {
          const Vec3d p = surface->world(i), q = surface->world(j);
          const Vec3d e{p[0] - q[0], p[1] - q[1], p[2] - q[2]};
          return e[0] * e[0] + e[1] * e[1] + e[2] * e[2];
        };
        const bool first = squared(a, c) <= squared(b, d);
        expected.push_back(first ? Triangle{a, b, c} : Triangle{a, b, d});
        expected.push_back(first ? Triangle{a, c, d} : Triangle{b, c, d});
      }
      if (mirror < 0) {
        for (Triangle& t : expected) std::swap(t[1], t[2]);
      }
      ASSERT_EQ(surface->triangles(), expected);
    }
  }
}

TEST(CheckClosed, AgreesWithTheReferenceAndFindsAHole) {
  for (const made::Made& m : made::all()) {
    const auto surface = extractSurface(m.volume, m.isovalue, m.inside);
    ASSERT_TRUE(surface.ok());
    const Status status = checkClosed(*surface);
    EXPECT_TRUE(status.ok()) << m.name << ": " << status.message();
  }
  const made::Made& m = made::named("sphere");
  const auto surface = extractSurface(m.volume, m.isovalue, m.inside);
  ASSERT_TRUE(surface.ok());
  for (std::size_t i = 0; i < surface->quads.size(); i += 97) {
    Surface broken = *surface;
    broken.quads.erase(broken.quads.begin() + static_cast<std::ptrdiff_t>(i));
    EXPECT_FALSE(checkClosed(broken).ok());
    broken = *surface;
    std::swap(broken.quads[i][1], broken.quads[i][3]);
    EXPECT_FALSE(checkClosed(broken).ok()) << "a quad that faces the other way";
    broken = *surface;
    broken.quads[i][2] = static_cast<std::uint32_t>(broken.vertices.size());
    EXPECT_FALSE(checkClosed(broken).ok()) << "a vertex that is not there";
  }
}

}  // namespace
}  // namespace isoreel
