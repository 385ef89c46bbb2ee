// SPDX-License-Identifier: BSD-3-Clause
// The parts of prediction that decoder and encoder share, against plain arithmetic; what a decoder refuses
// and survives.
#include <gtest/gtest.h>

#include <cmath>

#include "extract/sign_bitmap.h"
#include "packets.h"
#include "wild.h"

namespace isoreel {
namespace {

/// Some random cells of a cube of `side` cells, in Morton order.
std::vector<Cell> randomCells(made::Random& random, std::int32_t low, std::int32_t side,
                              std::uint32_t rarity) {
  std::vector<Cell> cells;
  for (std::int32_t z = low; z < low + side; ++z) {
    for (std::int32_t y = low; y < low + side; ++y) {
      for (std::int32_t x = low; x < low + side; ++x) {
        if (random() % rarity != 0) continue;
        cells.push_back({static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y),
                         static_cast<std::uint16_t>(z), static_cast<std::uint8_t>(1 + random() % 254)});
      }
    }
  }
  std::sort(cells.begin(), cells.end(), [](const Cell& a, const Cell& b) {
    return mortonCode(a.x, a.y, a.z) < mortonCode(b.x, b.y, b.z);
  });
  return cells;
}

TEST(Neighbours, AreThoseOfASearchThroughAllCells) {
  made::Random random(1);
  for (const std::int32_t low : {0, 5, 65535 - 13}) {
    for (const std::uint32_t rarity : {1u, 3u, 40u}) {
      const auto cells = randomCells(random, low, 14, rarity);
      CellIndex index;
      index.build(cells);
      Neighbours neighbours(index);
      for (int trial = 0; trial < 400; ++trial) {
        const auto coordinate = [&] { return low - 3 + static_cast<std::int32_t>(random() % 20); };
        const std::int32_t x = coordinate(), y = coordinate(), z = coordinate();
        std::vector<std::uint32_t> found, expected;
        neighbours.forEach(x, y, z, [&](std::uint32_t place) { found.push_back(place); });
        const auto outside = [](std::int32_t v) { return v < 0 || v > 65535; };
        if (!outside(x) && !outside(y) && !outside(z)) {
          for (std::uint32_t i = 0; i < cells.size(); ++i) {
            if (std::abs(cells[i].x - x) <= 1 && std::abs(cells[i].y - y) <= 1 &&
                std::abs(cells[i].z - z) <= 1)
              expected.push_back(i);
          }
        }
        std::sort(found.begin(), found.end());
        ASSERT_EQ(found, expected) << x << " " << y << " " << z;
      }
      neighbours.forEach(-1, 0, 0, [](std::uint32_t) { FAIL(); });
      neighbours.forEach(0, std::numeric_limits<std::int32_t>::min(), 0, [](std::uint32_t) { FAIL(); });
      neighbours.forEach(0, 0, std::numeric_limits<std::int32_t>::max(), [](std::uint32_t) { FAIL(); });
    }
  }
}

TEST(MotionField, InterpolatesAsPlainArithmeticDoes) {
  made::Random random(2);
  for (const std::uint32_t log2 : {2u, 3u, 4u, 5u}) {
    const double side = 1 << log2;
    const auto cells = randomCells(random, 0, 3 << log2, log2 < 4 ? 3 : 50);
    for (const bool all_move : {true, false}) {
      MotionField field;
      const std::int32_t step = 256 + static_cast<std::int32_t>(random() % 4000);
      field.build(cells, log2, static_cast<std::uint32_t>(step));
      for (Block& block : field.blocks()) {
        block.moves = all_move || random() % 2 == 0;
        for (std::int32_t& v : block.vector) v = static_cast<std::int32_t>(random() % 513) - 256;
      }
      for (const Block& block : field.blocks()) {
        if (!block.moves) continue;
        const MotionField::Interpolation at(field, block);
        for (std::uint32_t i = block.first; i < block.first + block.count; i += 7) {
          // Hats of one block's width around the middle of each block that moves.
          const std::array<double, 3> middle{cells[i].x + 0.5, cells[i].y + 0.5, cells[i].z + 0.5};
          std::array<double, 3> sum{};
          double weights = 0;
          for (const Block& other : field.blocks()) {
            if (!other.moves) continue;
            const std::array<std::int32_t, 3> corner{other.x, other.y, other.z};
            double weight = 1;
            for (std::size_t k = 0; k < 3; ++k)
              weight *= std::max(0.0, 1 - std::abs(middle[k] - (corner[k] + 0.5) * side) / side);
            weights += weight;
            for (std::size_t k = 0; k < 3; ++k) sum[k] += weight * other.vector[k] * step;
          }
          const auto vector = at.at(cells[i]);
          for (std::size_t k = 0; k < 3; ++k) {
            ASSERT_LE(vector[k], sum[k] / weights + 1e-6);
            ASSERT_GE(vector[k], sum[k] / weights - 1 - 1e-6);
          }
        }
      }
    }
  }
}

TEST(MotionField, RoundTripsItsVectorsAndRefusesLongOnes) {
  made::Random random(4);
  const auto cells = randomCells(random, 0, 30, 20);
  MotionField field;
  field.build(cells, 2, 300);
  for (Block& block : field.blocks()) {
    block.moves = random() % 3 != 0;
    if (!block.moves) continue;
    for (std::int32_t& v : block.vector)
      v = static_cast<std::int32_t>(random() % (random() % 2 == 0 ? 6991 : 5)) - 3495;
  }
  Bytes bytes;
  RangePut put(bytes);
  MotionModels put_models, get_models;
  for (Block& block : field.blocks()) {
    for (std::int32_t& v : block.vector) v = std::clamp(v, -3495, 3495);  // 64 cells in steps of 300
  }
  ASSERT_TRUE(field.code(put, put_models).ok());
  put.finish();
  MotionField back;
  back.build(cells, 2, 300);
  RangeGet get(bytes);
  ASSERT_TRUE(back.code(get, get_models).ok());
  EXPECT_TRUE(get.finished());
  ASSERT_EQ(back.blocks().size(), field.blocks().size());
  for (std::size_t i = 0; i < back.blocks().size(); ++i) {
    ASSERT_EQ(back.blocks()[i].moves, field.blocks()[i].moves);
    ASSERT_EQ(back.blocks()[i].vector, field.blocks()[i].vector);
  }
  field.blocks().back().moves = true;
  field.blocks().back().vector = {0, 0, 3496};
  EXPECT_FALSE(field.code(put, put_models).ok());
}

TEST(Reference, PlanesAreThoseOfAPlainLoop) {
  const made::Made& m = made::named("torus");
  const Surface surface = *extractSurface(m.volume, m.isovalue, m.inside);
  const auto cells =
      SignBitmap::make(m.volume, m.isovalue, m.inside, NonFinite::kRefuse, serialFor)->activeCells(serialFor);
  CellIndex index;
  index.build(cells);
  Reference reference;
  reference.build(surface, cells, index);
  // Normals against those of the triangles; both point to the outside.
  const auto smooth = surface.normals();
  for (std::uint32_t i = 0; i < reference.size(); ++i) {
    const auto n = reference.normal(i);
    ASSERT_GT(n[0] * smooth[i][0] + n[1] * smooth[i][1] + n[2] * smooth[i][2], 0.95);
    ASSERT_NEAR(std::hypot(n[0], n[1], n[2]), 1, 0.002);
  }

  made::Random random(5);
  Neighbours neighbours(reference.index());
  int found = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    const std::size_t near = random() % cells.size();
    std::array<double, 3> at{};
    std::array<std::int32_t, 3> place{};
    for (std::size_t k = 0; k < 3; ++k) {
      place[k] =
          surface.vertices[near][k] + static_cast<std::int32_t>(random() % (3 * kCell)) - 3 * kCell / 2;
      at[k] = static_cast<double>(place[k]) / kCell;
    }
    const LocalFrame& frame = kLocalFrames[cells[near].corners];
    const PlaneSums sums = reference.planesAround(place, frame, neighbours);
    double weight = 0, distance = 0, squares = 0;
    std::array<double, 3> normal{};
    for (std::uint32_t i = 0; i < reference.size(); ++i) {
      const std::array<int, 3> cell{cells[i].x, cells[i].y, cells[i].z};
      bool around = true;
      double cosine = 0, d = 0, along = 0, square = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        around &= std::abs(cell[k] - static_cast<int>(std::floor(at[k]))) <= 1;
        const double n = static_cast<double>(reference.normal(i)[k]);
        const double axis = static_cast<double>(frame.normal[k]) / kCell;
        const double away = at[k] - static_cast<double>(surface.vertices[i][k]) / kCell;
        cosine += n * axis;
        d += away * n;
        along += away * axis;
        square += away * away;
      }
      const double depth = 1 - along * along / 1.44 - (square - along * along) / 2.56;
      if (!around || cosine < 0.2 || depth <= 0) continue;
      const double w = 256 * depth * depth;
      weight += w;
      distance += w * d;
      squares += w * d * d;
      for (std::size_t k = 0; k < 3; ++k) normal[k] += w * static_cast<double>(reference.normal(i)[k]);
    }
    // Each plane's depth is cut to 1/256, so its weight is up to 3 less.
    ASSERT_NEAR(sums.weight, weight, 40) << trial;
    ASSERT_NEAR(static_cast<double>(sums.distance) / kCell, distance, 60);
    ASSERT_NEAR(static_cast<double>(sums.squares) / (1024 * 1024), squares, 60);
    for (std::size_t k = 0; k < 3; ++k)
      ASSERT_NEAR(static_cast<double>(sums.normal[k]) / 4096, normal[k], 40);
    found += sums.weight > 0;
  }
  EXPECT_GT(found, 1500);
  const PlaneSums outside = reference.planesAround({-1, 16 * kCell, 10 * kCell}, kLocalFrames[1], neighbours);
  EXPECT_EQ(outside.weight, 0);
}

// ---- What a decoder goes on from

std::vector<Bytes> slowSphere(std::size_t count, std::uint64_t first = 0) {
  const auto at = [](double t) { return made::sphere(6 + 0.4 * t, 6.3, 6.1 - 0.2 * t, 4.4); };
  const Grid grid = made::gridOf(16, 14, 15);
  EncoderSettings settings = made::settings({"sphere", made::sampled(grid, at(0))});
  settings.frame_types = FrameTypes::kAuto;
  auto encoder = Encoder::create(settings);
  std::vector<Bytes> packets;
  for (std::size_t t = 0; t < count; ++t) {
    const auto packet =
        encoder->encode(made::sampled(grid, at(static_cast<double>(t))), {first + t, 0, 1, 0});
    EXPECT_EQ(packet->header.type == PacketType::kIntra, t == 0);
    packets.push_back(packet->data);
  }
  return packets;
}

void expectNotFound(const Result<Surface>& surface) {
  ASSERT_FALSE(surface.ok());
  EXPECT_EQ(surface.error().code, ErrorCode::kNotFound) << surface.error().message;
  EXPECT_NE(surface.error().message.find("spec codec 8"), std::string::npos) << surface.error().message;
}

TEST(Predicted, NeedsThePacketBeforeItInFull) {
  const auto packets = slowSphere(4, 10), others = slowSphere(4, 11);
  const auto after = [&](const auto& prepare) {
    Decoder decoder;
    EXPECT_TRUE(decoder.decode(packets[0]).ok());
    prepare(decoder);
    return decoder.decode(packets[1]);
  };
  expectNotFound(Decoder().decode(packets[1]));
  EXPECT_TRUE(after([](Decoder&) {}).ok());
  DecodeOptions coarse, deepest, prefix;
  coarse.level = 2;
  deepest.level = 99;
  prefix.allow_prefix = true;
  // Where P packets may follow, a coarser level is shown of a packet that is decoded whole.
  EXPECT_TRUE(after([&](Decoder& d) { EXPECT_TRUE(d.decode(packets[0], coarse).ok()); }).ok());
  EXPECT_TRUE(after([&](Decoder& d) { EXPECT_TRUE(d.decode(packets[0], deepest).ok()); }).ok());
  EXPECT_TRUE(after([&](Decoder& d) { EXPECT_TRUE(d.decode(packets[0], prefix).ok()); }).ok());
  expectNotFound(after([&](Decoder& d) {
    EXPECT_TRUE(d.decode(ByteSpan(packets[0]).first(packets[0].size() - 1), prefix).ok());
  }));
  expectNotFound(after([&](Decoder& d) {
    Bytes damaged = packets[0];
    damaged.back() ^= 1;
    EXPECT_FALSE(d.decode(damaged).ok());
    made::Parts parts = made::taken(packets[0]);
    parts.header.surface_hash ^= 1;
    EXPECT_FALSE(d.decode(made::joined(parts)).ok());
  }));
  expectNotFound(after([&](Decoder& d) { EXPECT_TRUE(d.decode(packets[1]).ok()); }));
  expectNotFound(after([&](Decoder& d) { EXPECT_TRUE(d.decode(others[0]).ok()); }));

  // Packets 0, 2: a gap. Then a P packet at a coarser level, from which others go on.
  Decoder decoder;
  ASSERT_TRUE(decoder.decode(packets[0]).ok());
  expectNotFound(decoder.decode(packets[2]));
  ASSERT_TRUE(decoder.decode(packets[0]).ok());
  const auto level = decoder.decode(packets[1], coarse);
  ASSERT_TRUE(level.ok()) << level.error().message;
  EXPECT_TRUE(decoder.decode(packets[2]).ok());
  // From the I packet on all is well again.
  for (const Bytes& packet : packets) EXPECT_TRUE(decoder.decode(packet).ok());
}

TEST(Predicted, CoarserLevelsAreThoseOfAnIntraPacket) {
  const auto packets = slowSphere(3);
  const made::Made m{"sphere", made::sampled(made::gridOf(16, 14, 15), made::sphere(6.8, 6.3, 5.7, 4.4))};
  const Bytes intra = made::encoded(m).data;
  for (std::uint32_t level = 0; level < made::depthOf(m.volume.grid); ++level) {
    DecodeOptions options;
    options.level = level;
    Decoder decoder;
    ASSERT_TRUE(decoder.decode(packets[0]).ok());
    ASSERT_TRUE(decoder.decode(packets[1]).ok());
    const auto surface = decoder.decode(packets[2], options), expected = Decoder().decode(intra, options);
    ASSERT_TRUE(surface.ok() && expected.ok());
    EXPECT_EQ(surface->vertices, expected->vertices);
    EXPECT_EQ(surface->quads, expected->quads);
  }
}

// ---- Packets that no encoder would write

TEST(Predicted, AnyVectorsWeightsAndResidualsDecode) {
  const auto at = [](double t) {
    return [t](double x, double y, double z) {
      return std::sin(0.9 * x + t) + std::sin(1.1 * y - 0.3 * t) + std::sin(0.8 * z + 0.1 * x);
    };
  };
  const Grid grid = made::gridOf(17, 14, 15);
  for (const std::uint32_t log2 : {2u, 3u, 4u, 5u}) {
    made::WildSequence sequence(log2);
    made::Wild wild;
    wild.step = std::array{1u, 77u, 1024u, 16384u}[log2 - 2];
    wild.tangential_step = std::array{16384u, 99u, 2048u, 16384u}[log2 - 2];
    wild.largest = std::array{65535, 600, 4, 3}[log2 - 2];
    wild.farthest = std::array{MotionField::kMaxMotion, kCell / 2, kCell, 2 * kCell}[log2 - 2];
    Decoder decoder;
    ASSERT_TRUE(decoder.decode(sequence.intra({"waves", made::sampled(grid, at(0))}, wild.step)).ok());
    for (int t = 1; t < 5; ++t) {
      wild.header = made::wildHeader(sequence.random(), log2, 256 + sequence.random()() % 16129);
      const auto surface =
          decoder.decode(sequence.predicted({"waves", made::sampled(grid, at(0.1 * t))}, wild));
      ASSERT_TRUE(surface.ok()) << surface.error().message;
    }
  }
}

TEST(Damage, OfAPredictedPacketIsFound) {
  const auto packets = slowSphere(2);
  Decoder decoder;
  DecodeOptions prefix;
  prefix.allow_prefix = true;
  for (std::size_t size = 0; size < packets[1].size(); ++size) {
    ASSERT_TRUE(decoder.decode(packets[0]).ok());
    ASSERT_FALSE(decoder.decode(ByteSpan(packets[1]).first(size)).ok());
    ASSERT_TRUE(decoder.decode(packets[0]).ok());
    const auto surface = decoder.decode(ByteSpan(packets[1]).first(size), prefix);
    if (surface.ok()) made::expectUsable(*surface);
  }
  Bytes packet = packets[1];
  for (std::size_t bit = 0; bit < packet.size() * 8; bit += 3) {
    ASSERT_TRUE(decoder.decode(packets[0]).ok());
    packet[bit / 8] = static_cast<std::uint8_t>(packet[bit / 8] ^ 1u << (bit % 8));
    ASSERT_FALSE(decoder.decode(packet).ok()) << "bit " << bit;
    packet[bit / 8] = static_cast<std::uint8_t>(packet[bit / 8] ^ 1u << (bit % 8));
  }
}

TEST(Damage, OfAPredictedPacketBehindGoodChecksumsNeverBreaksTheDecoder) {
  made::Random random(6);
  const auto packets = slowSphere(3);
  const made::Parts good = made::taken(packets[1]);
  const std::size_t motion = made::largestSection(good, SectionKind::kMotion);
  Decoder decoder;
  std::size_t refused = 0;
  for (int trial = 0; trial < 1500; ++trial) {
    made::Parts parts = good;
    for (std::uint32_t changes = random() % 3 + 1; changes > 0; --changes) {
      const std::uint32_t what = random() % 8;
      const std::size_t which = what < 4 ? motion : random() % parts.sections.size();
      Bytes& section = parts.sections[which];
      if (section.empty()) continue;
      if (what == 0 || what == 4) {
        section.resize(random() % (section.size() + 12));
      } else if (what == 1) {
        section[random() % std::min<std::size_t>(section.size(), 60)] = static_cast<std::uint8_t>(random());
      } else if (what == 5) {
        parts.header.step = 1 + random() % kCell;
        parts.header.tangential_step = 1 + random() % kCell;
      } else if (what == 6) {
        parts.header.sections[which].kind = random() % 6;
      } else {
        section[random() % section.size()] ^= static_cast<std::uint8_t>(1u << random() % 8);
      }
    }
    ASSERT_TRUE(decoder.decode(packets[0]).ok());
    const auto surface = decoder.decode(made::joined(parts));
    if (surface.ok()) made::expectUsable(*surface);
    refused += !surface.ok();
    const auto next = decoder.decode(packets[2]);
    EXPECT_LE(next.ok(), surface.ok()) << "nothing goes on from a refused packet";
  }
  EXPECT_GT(refused, 1200u);
}

}  // namespace
}  // namespace isoreel
