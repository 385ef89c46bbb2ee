// SPDX-License-Identifier: BSD-3-Clause
// The distance field of the previous surface against its definition.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "extract/sign_bitmap.h"
#include "inter/reference.h"
#include "made.h"

namespace isoreel {
namespace {

/// The farthest that a node can be from a plane around it: three times 1.5 cells along a unit normal's axes.
constexpr std::int32_t kFarthest = 10642;

std::array<std::int16_t, 8> randomValues(made::Random& random) {
  std::array<std::int16_t, 8> values{};
  const auto largest = std::array{kFarthest, kFarthest, 4096, 20}[random() % 4];
  const bool extremes = random() % 4 == 0;
  for (std::int16_t& v : values) {
    const auto any = static_cast<std::int32_t>(random() % (2 * static_cast<std::uint32_t>(largest) + 1));
    v = static_cast<std::int16_t>(extremes ? std::array{-largest, 0, largest}[random() % 3] : any - largest);
  }
  return values;
}

TEST(CornerValues, AreInterpolatedAsTheDefinitionSays) {
  made::Random random(1);
  for (int trial = 0; trial < 200000; ++trial) {
    const std::array<std::int16_t, 8> values = randomValues(random);
    std::array<std::int32_t, 3> place{};
    for (std::int32_t& p : place) {
      p = random() % 8 == 0 ? std::array{0, kCell - 1, kCell, -1}[random() % 4]
                            : static_cast<std::int32_t>(random() % (1u << 30)) - (1 << 29);
    }
    const CornerValues corners(values);
    const CornerValues::Between expected = definition::slopesAt(values, place);
    const CornerValues::Between found = corners.slopesAt(place);
    ASSERT_EQ(corners.at(CornerValues::Weights(place)), expected.value) << trial;
    ASSERT_EQ(found.value, expected.value) << trial;
    ASSERT_EQ(found.slope, expected.slope) << trial;
    ASSERT_EQ(corners.bend(), definition::bendOf(values)) << trial;

    // The definition against real numbers.
    std::array<double, 3> part{};
    for (std::size_t k = 0; k < 3; ++k) part[k] = (place[k] & (kCell - 1)) / double{kCell};
    double value = 0;
    std::array<double, 3> slope{};
    for (std::size_t corner = 0; corner < 8; ++corner) {
      std::array<double, 3> weight{}, rise{};
      for (std::size_t k = 0; k < 3; ++k) {
        const bool high = (corner >> k & 1) != 0;
        weight[k] = high ? part[k] : 1 - part[k];
        rise[k] = high ? 1 : -1;
      }
      value += values[corner] * weight[0] * weight[1] * weight[2];
      slope[0] += values[corner] * rise[0] * weight[1] * weight[2];
      slope[1] += values[corner] * weight[0] * rise[1] * weight[2];
      slope[2] += values[corner] * weight[0] * weight[1] * rise[2];
    }
    ASSERT_NEAR(expected.value, value, 3);
    for (std::size_t k = 0; k < 3; ++k) ASSERT_NEAR(expected.slope[k], slope[k], 3);
  }
}

TEST(CornerValues, TellWhatIsKnown) {
  made::Random random(2);
  EXPECT_FALSE(CornerValues::unknown().allKnown());
  EXPECT_EQ(CornerValues::unknown().sumOfKnown(), 0);
  for (int trial = 0; trial < 20000; ++trial) {
    std::array<std::int16_t, 8> values = randomValues(random);
    if (random() % 8 == 0) values.fill(random() % 2 == 0 ? 16383 : -16384);
    bool all = true;
    std::int32_t sum = 0;
    const std::uint32_t rarity = std::array{1u, 2u, 8u, 1000u}[random() % 4];
    for (std::int16_t& v : values) {
      if (random() % rarity == 0) v = CornerValues::kUnknown;
      all &= v != CornerValues::kUnknown;
      sum += v == CornerValues::kUnknown ? 0 : v;
    }
    ASSERT_EQ(CornerValues(values).allKnown(), all);
    ASSERT_EQ(CornerValues(values).sumOfKnown(), sum);
  }
}

TEST(CornerValues, AreLoadedFromRowsAndPlanes) {
  std::array<std::int16_t, 100> nodes{};
  for (std::size_t i = 0; i < 100; ++i)
    nodes[i] = static_cast<std::int16_t>(i % 2 == 0 ? static_cast<int>(i) : -static_cast<int>(i));
  nodes[38] = CornerValues::kUnknown;
  const std::array<std::int16_t, 8> expected{-7, 8, 12, -13, -37, CornerValues::kUnknown, 42, -43};
  EXPECT_EQ((CornerValues::load<5, 30>(nodes.data() + 7).values()), expected);
}

/// By definition, for one node of the lattice: the distance to the plane of the nearest vertex of those that
/// have the node around their own nearest one; of several, the least distance.
std::int16_t distanceOf(const std::vector<ReferencePlane>& planes, const std::array<std::int32_t, 3>& node) {
  std::int32_t nearest = std::numeric_limits<std::int32_t>::max();
  std::int32_t distance = CornerValues::kUnknown;  // not compared with any: none is as far
  for (const ReferencePlane& plane : planes) {
    std::int32_t square = 0, along = 0;
    bool around = true;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto own = static_cast<std::int32_t>(
          std::floor(plane.position[k] / double{kCell} + 0.5));  // a half is rounded up
      around &= std::abs(node[k] - own) <= 1;
      const std::int32_t away = node[k] * kCell - plane.position[k];
      square += (away >> 8) * (away >> 8);
      along += (away * plane.normal[k]) >> kPositionBits;
    }
    if (!around || square > nearest || (square == nearest && along >= distance)) continue;
    nearest = square;
    distance = along;
  }
  return static_cast<std::int16_t>(distance);
}

std::array<std::int32_t, 3> randomUnit(made::Random& random) {
  if (random() % 4 == 0) {
    std::array<std::int32_t, 3> axis{};
    axis[random() % 3] = random() % 2 == 0 ? 4096 : -4096;
    return axis;
  }
  std::array<double, 3> v{};
  for (double& x : v) x = static_cast<double>(random() % 2001) - 1000.5;
  const double scale = 4096 / std::hypot(v[0], v[1], v[2]);
  return {static_cast<std::int32_t>(v[0] * scale), static_cast<std::int32_t>(v[1] * scale),
          static_cast<std::int32_t>(v[2] * scale)};
}

TEST(ReferenceField, IsItsDefinition) {
  made::Random random(3);
  struct Case {
    std::int32_t low, side;  // cells
    int planes;
  };
  // Around the origin, a brick's border at 16, the last cell of the largest grid; enough for several threads.
  for (const auto& [low, side, count] :
       {Case{0, 3, 12}, {0, 20, 400}, {13, 6, 150}, {14, 4, 8}, {65529, 6, 90}, {10, 9, 9000}}) {
    std::vector<ReferencePlane> planes;
    for (int i = 0; i < count; ++i) {
      ReferencePlane plane;
      if (i > 0 && random() % 8 == 0) {
        plane.position = planes[random() % planes.size()].position;  // the lesser distance wins
      } else {
        for (std::int32_t& p : plane.position) {
          p = low * kCell +
              static_cast<std::int32_t>(random() % static_cast<std::uint32_t>(side * kCell + 1));
          // On nodes, in the middle between them, or beside that.
          if (random() % 4 == 0) p = p / (kCell / 2) * (kCell / 2) + std::array{0, 0, -1}[random() % 3];
          p = std::max(p, 0);
        }
      }
      plane.normal = randomUnit(random);
      planes.push_back(plane);
    }
    ReferenceField field;
    field.build(planes, std::numeric_limits<std::uint64_t>::max(), made::threadedFor);
    ReferenceField::Cursor cursor(field);
    int known = 0;
    const std::int32_t first = low - 2, nodes = side + 6;
    std::vector<std::int16_t> expected_at;
    for (std::int32_t i = 0; i < nodes * nodes * nodes; ++i) {
      expected_at.push_back(
          distanceOf(planes, {first + i % nodes, first + i / nodes % nodes, first + i / nodes / nodes}));
    }
    const auto compare = [&](const std::array<std::int32_t, 3>& cell, bool inside) {
      std::array<std::int32_t, 3> place{};
      for (std::size_t k = 0; k < 3; ++k)
        place[k] = cell[k] * kCell + static_cast<std::int32_t>(random() % kCell);
      const std::array<std::int16_t, 8> found = cursor.around(place).values();
      for (std::size_t corner = 0; corner < 8; ++corner) {
        std::array<std::int32_t, 3> node = cell;
        for (std::size_t k = 0; k < 3; ++k) node[k] += static_cast<std::int32_t>(corner >> k & 1);
        const std::int32_t at = ((node[2] - first) * nodes + node[1] - first) * nodes + node[0] - first;
        const std::int16_t expected =
            inside ? expected_at[static_cast<std::size_t>(at)] : CornerValues::kUnknown;
        ASSERT_EQ(found[corner], expected) << node[0] << " " << node[1] << " " << node[2];
        known += expected != CornerValues::kUnknown;
        ASSERT_TRUE(expected == CornerValues::kUnknown || std::abs(expected) <= kFarthest);
      }
    };
    for (std::int32_t z = low - 2; z < low + side + 3; ++z) {
      for (std::int32_t y = low - 2; y < low + side + 3; ++y) {
        for (std::int32_t x = low - 2; x < low + side + 3; ++x)
          compare({x, y, z}, x >= 0 && y >= 0 && z >= 0);
      }
    }
    for (int trial = 0; trial < 500; ++trial) {  // jumps from brick to brick
      std::array<std::int32_t, 3> cell{};
      for (std::int32_t& c : cell)
        c = low - 2 + static_cast<std::int32_t>(random() % static_cast<std::uint32_t>(side + 5));
      compare(cell, std::ranges::all_of(cell, [](std::int32_t c) { return c >= 0; }));
    }
    EXPECT_GT(known, 100);
    for (const std::int32_t far : {-(1 << 30), -1, 65600 * kCell, std::numeric_limits<std::int32_t>::max()}) {
      for (std::size_t k = 0; k < 3; ++k) {
        std::array<std::int32_t, 3> place = planes[0].position;
        place[k] = far;
        ASSERT_EQ(cursor.around(place).values(), CornerValues::unknown().values()) << far;
      }
    }
  }
}

TEST(ReferenceField, KeepsNothingOfTheSurfaceBefore) {
  made::Random random(4);
  ReferenceField used, fresh;
  for (const std::int32_t at : {20, 4, 37}) {
    const std::vector<ReferencePlane> planes{{{at * kCell, at * kCell + 77, at * kCell - 99}, {0, 4096, 0}}};
    used.build(planes);
    fresh = {};
    fresh.build(planes);
    ReferenceField::Cursor a(used), b(fresh);
    for (int trial = 0; trial < 4000; ++trial) {
      std::array<std::int32_t, 3> place{};
      for (std::int32_t& p : place) p = static_cast<std::int32_t>(random() % (40 * kCell));
      ASSERT_EQ(a.around(place).values(), b.around(place).values());
    }
  }
  used.build({});
  ReferenceField::Cursor cursor(used);
  EXPECT_FALSE(cursor.around({37 * kCell, 37 * kCell, 37 * kCell}).allKnown());
  EXPECT_EQ(cursor.around({37 * kCell, 37 * kCell, 37 * kCell}).sumOfKnown(), 0);
}

TEST(Reference, HasPlanesThatTouchItsSurfaceAndTheDistanceFromIt) {
  // made.cc's torus lies around the z axis, radius and tube as below.
  const made::Field torus = made::torus(14, 14.3, 8.2, 8.5, 4.1);
  const made::Made m{"torus", made::sampled(made::gridOf(29, 29, 17), torus)};
  const Surface surface = made::extracted(m);
  const auto cells =
      SignBitmap::make(m.volume, m.isovalue, m.inside, NonFinite::kRefuse, serialFor)->activeCells(serialFor);
  Reference reference;
  reference.build(surface, cells);
  // Normals against those of the triangles; both point to the outside.
  const auto smooth = surface.normals();
  ASSERT_EQ(reference.planes().size(), surface.vertices.size());
  for (std::size_t i = 0; i < surface.vertices.size(); ++i) {
    const ReferencePlane& plane = reference.planes()[i];
    ASSERT_EQ(plane.position, surface.vertices[i]);
    const std::array<double, 3> n{plane.normal[0] / 4096.0, plane.normal[1] / 4096.0,
                                  plane.normal[2] / 4096.0};
    ASSERT_GT(n[0] * smooth[i][0] + n[1] * smooth[i][1] + n[2] * smooth[i][2], 0.95);
    ASSERT_NEAR(std::hypot(n[0], n[1], n[2]), 1, 0.002);
  }
  ReferenceField::Cursor cursor(reference.field());
  made::Random random(5);
  int near = 0, known = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    std::array<std::int32_t, 3> place{};
    for (std::size_t k = 0; k < 3; ++k)
      place[k] = static_cast<std::int32_t>(random() % (m.volume.grid.nodes[k] * std::uint32_t{kCell}));
    const double distance =
        torus(place[0] / double{kCell}, place[1] / double{kCell}, place[2] / double{kCell});
    const CornerValues around = cursor.around(place);
    near += std::abs(distance) < 0.4;
    if (!around.allKnown()) {
      ASSERT_GT(std::abs(distance), 0.4) << trial;
      continue;
    }
    known += std::abs(distance) < 0.4;
    // Planes leave the tube at its sides.
    ASSERT_NEAR(around.at(CornerValues::Weights(place)) / 4096.0, distance,
                std::abs(distance) < 0.4 ? 0.07 : 0.2);
  }
  EXPECT_EQ(known, near);
  EXPECT_GT(near, 1500);
}

TEST(Reference, IsTheSameForAnyThreadsAndOrderOfQuads) {
  const made::Made m = made::large();
  Surface surface = *extractSurface(m.volume, m.isovalue, m.inside);
  const auto cells =
      SignBitmap::make(m.volume, m.isovalue, m.inside, NonFinite::kRefuse, serialFor)->activeCells(serialFor);
  const auto planesOf = [&](const ParallelFor& parallel) {
    Reference reference;
    reference.build(surface, cells, parallel);
    std::vector<std::array<std::int32_t, 3>> normals;
    for (const ReferencePlane& plane : reference.planes()) normals.push_back(plane.normal);
    return normals;
  };
  const auto serial = planesOf(serialFor);
  ASSERT_GT(serial.size(), 8192u);
  EXPECT_EQ(planesOf(made::threadedFor), serial);
  made::Random random(6);
  for (std::size_t i = surface.quads.size(); i > 1; --i)
    std::swap(surface.quads[i - 1], surface.quads[random() % i]);
  EXPECT_EQ(planesOf(made::threadedFor), serial);
}

TEST(Reference, HasItsFieldOnceAsked) {
  Surface surface;
  surface.vertices.assign(1, {5 * kCell, 5 * kCell, 5 * kCell});
  const std::vector<Cell> cell{{5, 5, 5, 0x0F}};
  Reference reference;
  reference.build(surface, cell);
  const auto values = [&] { return ReferenceField::Cursor(reference.field()).around(surface.vertices[0]); };
  EXPECT_TRUE(values().allKnown() || values().sumOfKnown() != 0);
  const CornerValues::Array built = values().values();
  reference.setPlanes(surface, cell);  // of the surface before nothing is left
  EXPECT_EQ(values().values(), CornerValues::unknown().values());
  reference.buildField();
  EXPECT_EQ(values().values(), built);
}

TEST(Reference, OfNothingIsUnknownEverywhere) {
  Reference reference;
  reference.build({}, {});
  ReferenceField::Cursor cursor(reference.field());
  EXPECT_EQ(cursor.around({0, 0, 0}).values(), CornerValues::unknown().values());
  // A vertex whose quads have no area has the normal of its cell's frame.
  Surface flat;
  flat.vertices.assign(1, {kCell / 2, kCell / 2, kCell / 2});
  const std::vector<Cell> cell{{0, 0, 0, 0x0F}};
  reference.build(flat, cell);
  EXPECT_EQ(reference.planes()[0].normal, (std::array<std::int32_t, 3>{0, 0, 4096}));
}

}  // namespace
}  // namespace isoreel
