// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include "lattice/brick_map.h"
#include "lattice/cell_index.h"
#include "lattice/dual_mesh.h"
#include "lattice/sign_lattice.h"
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
  }
}

TEST(SignLattice, AgreesWithAMap) {
  made::Random random(4);
  SignLattice lattice;
  std::map<Place, bool> expected;
  for (int trial = 0; trial < 400; ++trial) {
    const Place brick{static_cast<std::int32_t>(random() % 4), static_cast<std::int32_t>(random() % 4),
                      static_cast<std::int32_t>(random() % 4)};
    SignBlock block;
    lattice.load(brick[0], brick[1], brick[2], block);
    for (int z = -1; z <= 9; ++z) {
      for (int y = -1; y <= 9; ++y) {
        for (int x = -1; x <= 9; ++x) {
          const auto found = expected.find({8 * brick[0] + x, 8 * brick[1] + y, 8 * brick[2] + z});
          ASSERT_EQ(block.isKnown(x, y, z), found != expected.end());
          ASSERT_EQ(block.isInside(x, y, z), found != expected.end() && found->second);
        }
      }
    }
    for (int i = 0; i < 20; ++i) {
      const int x = static_cast<int>(random() % 9), y = static_cast<int>(random() % 9),
                z = static_cast<int>(random() % 9);
      if (block.isKnown(x, y, z)) continue;
      const bool sign = random() & 1;
      block.set(x, y, z, sign);
      expected[{8 * brick[0] + x, 8 * brick[1] + y, 8 * brick[2] + z}] = sign;
    }
    const int nx = static_cast<int>(random() % 9), ny = static_cast<int>(random() % 9),
              nz = static_cast<int>(random() % 9);
    const std::uint32_t known = SignBlock::neighbours(block.known, nx, ny, nz);
    for (int bit = 0; bit < 27; ++bit) {
      ASSERT_EQ(known >> bit & 1,
                std::uint32_t{block.isKnown(nx + bit % 3 - 1, ny + bit / 3 % 3 - 1, nz + bit / 9 - 1)});
    }
    lattice.store(brick[0], brick[1], brick[2], block);
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
