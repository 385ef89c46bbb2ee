// SPDX-License-Identifier: BSD-3-Clause
// What P packets predict from the moved surface and from coded neighbours, against plain arithmetic.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "cells.h"
#include "inter/moved_signs.h"
#include "inter/vertex_stream.h"

namespace isoreel {
namespace {

using Vector = std::array<double, 3>;

double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vector inCells(const std::array<std::int32_t, 3>& v) {
  return {v[0] / double{kCell}, v[1] / double{kCell}, v[2] / double{kCell}};
}
std::int64_t floorOf(double value) { return static_cast<std::int64_t>(std::floor(value)); }

// ---- Neighbours

TEST(CodedNeighbours, SayWhatASearchThroughAllCellsSays) {
  made::Random random(1);
  for (const std::int32_t low : {0, 5, 65535 - 13}) {
    for (const std::uint32_t rarity : {1u, 3u, 40u}) {
      const std::vector<Cell> cells = made::randomCells(random, low, 14, rarity);
      CellIndex index;
      index.build(cells);
      std::vector<std::array<std::int32_t, 3>> vertices(cells.size());
      std::vector<std::optional<std::int32_t>> errors(cells.size());
      CodedNeighbours neighbours(index, vertices);
      std::array<int, 4> asked{};
      for (std::uint32_t i = 0; i < cells.size(); ++i) {
        const LocalFrame& frame = kLocalFrames[cells[i].corners];
        if (random() % 5 != 0) {  // those without a prediction do not ask
          std::int64_t error = 0, magnitude = 0, height = 0;
          std::int64_t seen = 0, predicted = 0;
          for (std::size_t k = 0; k < 3; ++k) {
            std::array<std::int32_t, 3> at{cells[i].x, cells[i].y, cells[i].z};
            --at[k];
            const std::uint32_t j = index.find(at[0], at[1], at[2]);  // tested by itself
            if (j == CellIndex::kNone) continue;
            ASSERT_LT(j, i);
            Vector away = inCells(vertices[j]);
            for (std::size_t m = 0; m < 3; ++m) away[m] -= frame.vertex[m] / double{kCell};
            away[k] -= 1;
            ++seen;
            height +=
                std::clamp<std::int64_t>(floorOf(dot(away, inCells(frame.normal)) * kCell), -kCell, kCell);
            if (!errors[j]) continue;
            ++predicted;
            error += *errors[j];
            magnitude += std::abs(*errors[j]);
          }
          const auto mean = [](std::int64_t sum, std::int64_t count) {
            const std::int64_t scaled = sum * (65536 / count);
            return floorOf(static_cast<double>(scaled) / 65536);
          };
          const CodedNeighbours::Means found = neighbours.around(i, cells[i], frame);
          ASSERT_EQ(found.height, seen == 0 ? 0 : mean(height, seen)) << i;
          ASSERT_EQ(found.error, predicted == 0 ? 0 : mean(error, predicted)) << i;
          ASSERT_EQ(found.magnitude, predicted == 0 ? 1638 : mean(magnitude, predicted)) << i;
          ++asked[static_cast<std::size_t>(seen)];
        }
        for (std::int32_t& v : vertices[i]) v = static_cast<std::int32_t>(random() % (kCell + 1));
        if (random() % 3 == 0) {
          neighbours.skip(i);
        } else {
          const std::int32_t error = static_cast<std::int32_t>(random() % (4 * kCell)) - 2 * kCell;
          neighbours.set(i, error);
          errors[i] = std::clamp(error, -kCell, kCell);
        }
      }
      for (std::size_t seen = rarity == 1 ? 1 : 0; seen < (rarity == 40 ? 2u : 4u); ++seen)
        EXPECT_GT(asked[seen], 0) << seen;
    }
  }
}

// ---- The moved plane

/// What section 8.5 says, in real numbers, of a plane in a cell: distances are in cells.
struct PlainPlane {
  double distance;  // at the frame's vertex
  Vector slope;

  double at(const Vector& place, const LocalFrame& frame) const {
    const Vector vertex = inCells(frame.vertex);
    return distance + dot(slope, {place[0] - vertex[0], place[1] - vertex[1], place[2] - vertex[2]});
  }
  static Vector corner(std::size_t j) {
    return {static_cast<double>(j & 1), static_cast<double>(j >> 1 & 1), static_cast<double>(j >> 2)};
  }
  int wrong(std::uint8_t corners, const LocalFrame& frame) const {
    int count = 0;
    for (std::size_t j = 0; j < 8; ++j) count += (at(corner(j), frame) < 0) != ((corners >> j & 1) != 0);
    return count;
  }
  /// The mean of where it crosses the edges whose ends differ, from their middles, along both tangents.
  std::array<double, 2> tangents(std::uint8_t corners, const LocalFrame& frame) const {
    Vector sum{};
    int edges = 0;
    for (std::size_t j = 0; j < 8; ++j) {
      for (std::size_t k = 0; k < 3; ++k) {
        if ((j >> k & 1) != 0 || (corners >> j & 1) == (corners >> (j | std::size_t{1} << k) & 1)) continue;
        ++edges;
        const double rise = (corners >> j & 1) != 0 ? slope[k] : -slope[k];  // from inside to outside
        if (rise > 0) sum[k] += std::clamp(-at(corner(j), frame) / slope[k], 0.0, 1.0) - 0.5;
      }
    }
    return {dot(sum, inCells(frame.tangent1)) / edges, dot(sum, inCells(frame.tangent2)) / edges};
  }
  /// How far along the frame's normal it is from the vertex moved along the tangents.
  double offset(const LocalFrame& frame, double along1, double along2) const {
    const double at_vertex = distance + dot(slope, inCells(frame.tangent1)) * along1 +
                             dot(slope, inCells(frame.tangent2)) * along2;
    return std::clamp(-at_vertex / std::max(dot(slope, inCells(frame.normal)), 0.4), -1.0, 1.0);
  }
};

/// `about`: how exact slopes and distances are, in cells.
void expectPlane(const MovedPlane& plane, const PlainPlane& plain, std::uint8_t corners, made::Random& random,
                 double about) {
  const LocalFrame& frame = kLocalFrames[corners];
  ASSERT_NEAR(plane.distance / double{kCell}, plain.distance, about);
  for (std::size_t k = 0; k < 3; ++k) ASSERT_NEAR(plane.slope[k] / double{kCell}, plain.slope[k], about);
  const auto tangents = plain.tangents(corners, frame);
  for (std::size_t t = 0; t < 2; ++t)
    ASSERT_NEAR(plane.tangents[t] / double{kCell}, tangents[t], 4 * about + 0.0005) << t;
  const auto part = [&] { return static_cast<std::int64_t>(random() % (2 * kCell)) - kCell; };
  const std::array<std::int64_t, 3> offsets{part(), part(), part()};  // the first one does not matter
  ASSERT_NEAR(
      plane.offset(frame, offsets) / double{kCell},
      plain.offset(frame, static_cast<double>(offsets[1]) / kCell, static_cast<double>(offsets[2]) / kCell),
      10 * about);
}

TEST(MovedPlane, OfAPlaneIsThatPlane) {
  made::Random random(2);
  int confident = 0;
  for (const Vector& direction : {Vector{1, 2, 2}, {-2, 1, 2}, {2, 2, -1}, {-3, -4, 5}, {1, 1, 1}}) {
    const double size = std::hypot(direction[0], direction[1], direction[2]);
    const Vector n{direction[0] / size, direction[1] / size, direction[2] / size};
    const Vector through{9.9, 10.2, 10.1};
    const auto distance = [&](const Vector& p) {
      return dot(n, {p[0] - through[0], p[1] - through[1], p[2] - through[2]});
    };
    // A vertex in each cell that the plane meets.
    std::vector<ReferencePlane> planes;
    for (std::int32_t i = 0; i < 20 * 20 * 20; ++i) {
      const std::int32_t x = i % 20, y = i / 20 % 20, z = i / 400;
      const Vector middle{x + 0.5, y + 0.5, z + 0.5};
      const double away = distance(middle);
      if (std::abs(away) > 0.85) continue;
      ReferencePlane plane;
      for (std::size_t k = 0; k < 3; ++k) {
        plane.position[k] = static_cast<std::int32_t>(std::lround((middle[k] - away * n[k]) * kCell));
        plane.normal[k] = static_cast<std::int32_t>(std::lround(n[k] * 4096));
      }
      if (*std::ranges::min_element(plane.position) >= 0) planes.push_back(plane);
    }
    ReferenceField field;
    field.build(planes);
    ReferenceField::Cursor cursor(field);
    for (int trial = 0; trial < 4000; ++trial) {
      std::array<std::int32_t, 3> motion{};
      for (std::int32_t& m : motion) m = static_cast<std::int32_t>(random() % (6 * kCell)) - 3 * kCell;
      Cell cell{static_cast<std::uint16_t>(7 + random() % 7), static_cast<std::uint16_t>(7 + random() % 7),
                static_cast<std::uint16_t>(7 + random() % 7), 0};
      bool clear = true;
      const auto moved = [&](const Vector& inside) {  // the place that the cell's place comes from
        const Vector by = inCells(motion);
        return Vector{cell.x + inside[0] + by[0], cell.y + inside[1] + by[1], cell.z + inside[2] + by[2]};
      };
      for (std::size_t j = 0; j < 8; ++j) {
        const double at = distance(moved(PlainPlane::corner(j)));
        clear &= std::abs(at) > 0.01;
        if (at < 0) cell.corners = static_cast<std::uint8_t>(cell.corners | 1u << j);
      }
      if (!isActive(cell) || !clear) continue;
      const std::uint32_t flips = random() % 5;  // signs that the plane does not have
      for (std::uint32_t i = 0; i < flips; ++i)
        cell.corners = static_cast<std::uint8_t>(cell.corners ^ 1u << random() % 8);
      if (!isActive(cell)) continue;
      const LocalFrame& frame = kLocalFrames[cell.corners];
      const PlainPlane plain{distance(moved(inCells(frame.vertex))), n};
      const MovedPlane plane = planeInCell(cursor, cell, motion);
      if (!plane.known) {
        ASSERT_GT(std::abs(plain.distance), 0.3);
        continue;
      }
      const int wrong = plain.wrong(cell.corners, frame);
      ASSERT_EQ(plane.confidence, std::min(wrong, 3) * 4) << "the plane does not bend";
      confident += wrong == 0;
      ASSERT_NO_FATAL_FAILURE(expectPlane(plane, plain, cell.corners, random, 0.0025));
    }
  }
  EXPECT_GT(confident, 500);
}

TEST(MovedPlane, OfAnyCornerValuesFollowsTheDefinition) {
  made::Random random(3);
  std::array<int, kConfidences> confidences{};
  for (int trial = 0; trial < 20000; ++trial) {
    // A vertex near each corner of a cell: its plane's distance there is whatever is wanted.
    const auto largest = std::array{30u, 100u, 400u, 1500u}[random() % 4];
    const std::int32_t lift = static_cast<std::int32_t>(random() % 801) - 400;
    std::array<std::int16_t, 8> values{};
    std::vector<ReferencePlane> planes;
    const std::int32_t low = static_cast<std::int32_t>(random() % 40);
    for (std::size_t j = 0; j < 8; ++j) {
      const std::int32_t v =
          static_cast<std::int32_t>(random() % (2 * largest + 1)) - static_cast<std::int32_t>(largest) + lift;
      values[j] = static_cast<std::int16_t>(v);
      const auto node = [&](std::size_t k) {
        return (low + 1 + static_cast<std::int32_t>(j >> k & 1)) * kCell;
      };
      planes.push_back({{node(0), node(1), node(2) - 4 * v}, {0, 0, 4096}});
    }
    ReferenceField field;
    field.build(planes);
    ReferenceField::Cursor cursor(field);
    // Any signs, or about those of the values.
    auto corners = static_cast<std::uint8_t>(1 + random() % 254);
    if (random() % 2 == 0) {
      std::uint32_t inside = 0;
      for (std::size_t j = 0; j < 8; ++j) inside |= (values[j] < 0 ? 1u : 0u) << j;
      if (random() % 2 == 0) inside ^= 1u << random() % 8;
      if (inside != 0 && inside != 0xFF) corners = static_cast<std::uint8_t>(inside);
    }
    const LocalFrame& frame = kLocalFrames[corners];
    const std::array<std::int32_t, 3> motion{3 * kCell, -kCell, 0};
    const Cell cell{static_cast<std::uint16_t>(low - 2), static_cast<std::uint16_t>(low + 2),
                    static_cast<std::uint16_t>(low + 1), corners};
    if (low < 2) {
      const MovedPlane none = planeInCell(cursor, {0, 0, 0, corners}, {0, 0, -kCell});
      ASSERT_FALSE(none.known) << "below the grid";
      continue;
    }
    const MovedPlane plane = planeInCell(cursor, cell, motion);
    ASSERT_TRUE(plane.known);
    const CornerValues::Between between = definition::slopesAt(values, frame.vertex);
    ASSERT_EQ(plane.distance, 4 * between.value);
    for (std::size_t k = 0; k < 3; ++k) ASSERT_EQ(plane.slope[k], 4 * between.slope[k]);
    const PlainPlane plain{plane.distance / double{kCell}, inCells(plane.slope)};
    // The plane's own corners are cut to whole units.
    bool clear = true;
    for (std::size_t j = 0; j < 8; ++j)
      clear &= std::abs(plain.at(PlainPlane::corner(j), frame)) > 2.0 / kCell;
    if (!clear) continue;
    std::int64_t bend = 0;
    for (const std::size_t term : {3u, 5u, 6u, 7u}) {  // xy, xz, yz, xyz
      std::int64_t sum = 0;
      for (std::size_t j = 0; j < 8; ++j) {
        const bool odd = (countBits(j & term) & 1) != 0;
        sum += odd ? -values[j] : values[j];
      }
      bend += sum * sum;
    }
    const int grade = (bend >= 524288) + (bend >= 4194304) + (bend >= 16777216);
    ASSERT_EQ(plane.confidence, 4 * std::min(plain.wrong(corners, frame), 3) + grade);
    ++confidences[plane.confidence];
    const auto tangents = plain.tangents(corners, frame);
    for (std::size_t t = 0; t < 2; ++t) {
      // A unit at a corner moves a crossing by its part of the slope.
      double flattest = 1e9;
      for (const double s : plain.slope) flattest = std::min(flattest, s == 0 ? 1e9 : std::abs(s));
      ASSERT_NEAR(plane.tangents[t] / double{kCell}, tangents[t], 0.0005 + 2.0 / kCell / flattest) << trial;
    }
    const std::array<std::int64_t, 3> offsets{0, static_cast<std::int64_t>(random() % kCell),
                                              -static_cast<std::int64_t>(random() % kCell)};
    ASSERT_NEAR(
        plane.offset(frame, offsets) / double{kCell},
        plain.offset(frame, static_cast<double>(offsets[1]) / kCell, static_cast<double>(offsets[2]) / kCell),
        0.001);
  }
  for (std::size_t c = 0; c < kConfidences; ++c) EXPECT_GT(confidences[c], 20) << c;
}

TEST(MovedPlane, IsNotKnownWhereACornerIsNot) {
  const LocalFrame& frame = kLocalFrames[0x0F];
  const Cell cell{4, 4, 4, 0x0F};
  for (std::size_t missing = 0; missing <= 8; ++missing) {
    std::vector<ReferencePlane> planes;
    // Two nodes apart: only what lies around a node knows it.
    for (std::int32_t j = 0; j < 8; ++j) {
      const std::array<std::int32_t, 3> node{j & 1 ? 6 : 3, j & 2 ? 6 : 3, j & 4 ? 6 : 3};
      if (static_cast<std::size_t>(j) == missing) continue;
      planes.push_back({{node[0] * kCell, node[1] * kCell, node[2] * kCell}, {0, 0, 4096}});
    }
    ReferenceField field;
    field.build(planes);
    ReferenceField::Cursor cursor(field);
    EXPECT_EQ(planeInCell(cursor, cell, {}).known, missing == 8) << missing;
    EXPECT_FALSE(planeInCell(cursor, cell, {64 * kCell, 0, 0}).known);
  }
  EXPECT_EQ(MovedPlane{}.offset(frame, {}), 0);
}

TEST(Levels, AreWhatTheHeaderSays) {
  PredictionHeader header;
  header.levels = {50, 130, 190};
  const std::int32_t step = 1000;
  const std::array<std::int32_t, 6> expected{0, 781, 2031, 2968, 3968, 4968};
  for (std::int32_t r = 0; r < 6; ++r) {
    EXPECT_EQ(dequantise(header, r, step), expected[static_cast<std::size_t>(r)]);
    EXPECT_EQ(dequantise(header, -r, step), -expected[static_cast<std::size_t>(r)]);
  }
  header.levels = {255, 255, 255};
  EXPECT_EQ(dequantise(header, 65535, kCell), 255 * kCell / 64 + 65532 * kCell);
}

// ---- Signs

/// The class by its definition: how many ends the distance has passed, in 1/256 of a cell.
std::size_t plainClass(std::int32_t distance) {
  const double size = distance < 0 ? -distance - 1 : distance;
  std::size_t place = 0;
  for (const int end : {10, 26, 43, 69, 102, 154, 256}) place += std::floor(size / 16) >= end;
  return distance < 0 ? 7 - place : 8 + place;
}

TEST(MovedSignModels, ClassesGrowWithTheDistanceOnBothSides) {
  for (std::int32_t distance = -16384; distance < 16384; ++distance) {
    ASSERT_EQ(MovedSignModels::classOf(distance), plainClass(distance)) << distance;
    ASSERT_EQ(MovedSignModels::classOf(-1 - distance), 15 - MovedSignModels::classOf(distance));
  }
  EXPECT_EQ(MovedSignModels::classOf(0), 8u);
  EXPECT_EQ(MovedSignModels::classOf(16383), 15u);
}

TEST(MovedSignModels, AreOnePerLevelClassAndVote) {
  MovedSignModels models;
  std::set<const BitModel*> all;
  for (std::uint32_t shift = 0; shift < 6; ++shift) {
    for (std::size_t distance = 0; distance < MovedSignModels::kClasses; ++distance) {
      std::size_t vote = 0;
      const BitModel* last = models.at(shift, distance, 0).model;
      all.insert(last);
      for (std::uint32_t one = 1; one < 65536; ++one) {
        const BitModel* model = models.at(shift, distance, static_cast<std::uint16_t>(one)).model;
        vote += model != last;
        ASSERT_TRUE(model == last || one % 512 == 0) << "probabilities count in 1/128";
        last = model;
        all.insert(model);
      }
      EXPECT_EQ(vote, MovedSignModels::kVotes - 1);
      EXPECT_EQ(models.at(shift, distance, 32768).model,
                models.at(std::min(shift, 2u), distance, 33000).model);
    }
  }
  EXPECT_EQ(all.size(), MovedSignModels::kLevels * MovedSignModels::kClasses * MovedSignModels::kVotes);
  constexpr std::array<std::uint32_t, 15> ends{2, 5, 10, 18, 27, 39, 53, 64, 75, 89, 101, 110, 118, 123, 126};
  for (const std::uint32_t end : ends) {
    EXPECT_NE(models.at(0, 0, static_cast<std::uint16_t>(512 * end - 1)).model,
              models.at(0, 0, static_cast<std::uint16_t>(512 * end)).model)
        << end;
  }
  models.at(1, 3, 40000).model->one = 1;
  models.reset();
  EXPECT_EQ(models.at(1, 3, 40000).model->one, BitModel{}.one);
}

TEST(MovedSigns, AskTheFieldWhereTheBlockMovesTo) {
  made::Random random(4);
  const made::Field sphere = made::sphere(11, 12, 10, 6);
  std::vector<ReferencePlane> planes;
  for (int i = 0; i < 1500; ++i) {
    std::array<double, 3> n{};
    for (double& x : n) x = static_cast<double>(random() % 2001) - 1000.5;
    const double size = std::hypot(n[0], n[1], n[2]);
    ReferencePlane plane;
    for (std::size_t k = 0; k < 3; ++k) {
      const double middle = std::array{11.0, 12.0, 10.0}[k];
      plane.position[k] = static_cast<std::int32_t>((middle + 6 * n[k] / size) * kCell);
      plane.normal[k] = static_cast<std::int32_t>(4096 * n[k] / size);
    }
    planes.push_back(plane);
  }
  ReferenceField field;
  field.build(planes);
  ReferenceField::Cursor cursor(field);
  const std::vector<Cell> cells = made::randomCells(random, 0, 22, 2);
  MotionField motion = made::blocksOf(cells, 3, 300);
  for (Block& block : motion.blocks()) {
    block.moves = random() % 4 != 0;
    for (std::int32_t& v : block.vector) v = static_cast<std::int32_t>(random() % 301) - 150;
  }
  MovedSignModels models;
  std::array<int, 3> seen{};  // unknown, partly known, known
  for (const std::uint32_t shift : {2u, 1u, 0u}) {
    MovedSigns moved(field, motion, models, shift);
    for (const Cell& parent : made::coarser(cells, shift + 1)) {
      moved.goTo(parent);
      const Block* block = nullptr;
      for (const Block& b : motion.blocks()) {
        const std::uint32_t up = 2 - shift;
        if (b.x == parent.x >> up && b.y == parent.y >> up && b.z == parent.z >> up) block = &b;
      }
      ASSERT_NE(block, nullptr);
      for (int i = 0; i < 4; ++i) {
        std::array<std::int32_t, 3> node{2 * parent.x, 2 * parent.y, 2 * parent.z}, place{};
        for (std::size_t k = 0; k < 3; ++k) {
          node[k] += static_cast<std::int32_t>(random() % 3);
          place[k] = (node[k] << shift) * kCell + block->vector[k] * 300;
        }
        const auto one = static_cast<std::uint16_t>(random());
        const BitModel* const model = moved.at(node[0], node[1], node[2], one).model;
        if (!block->moves) {
          ASSERT_EQ(model, nullptr);
          continue;
        }
        const CornerValues around = cursor.around(place);
        std::int32_t sum = 0;
        for (const std::int16_t v : around.values()) sum += v == CornerValues::kUnknown ? 0 : v;
        if (around.allKnown()) {
          const auto distance = definition::slopesAt(around.values(), place).value;
          ASSERT_EQ(model, models.at(shift, plainClass(distance), one).model);
          const Vector at = inCells(place);
          ASSERT_NEAR(distance / 4096.0, sphere(at[0], at[1], at[2]), 0.25);
          ++seen[2];
        } else if (sum == 0) {
          ASSERT_EQ(model, nullptr);
          ++seen[0];
        } else {
          ASSERT_EQ(model, models.at(shift, sum < 0 ? 17 : 16, one).model);
          ++seen[1];
        }
      }
    }
  }
  for (const int count : seen) EXPECT_GT(count, 300);
}

}  // namespace
}  // namespace isoreel
