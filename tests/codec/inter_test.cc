// SPDX-License-Identifier: BSD-3-Clause
// The parts of prediction that decoder and encoder share, against plain arithmetic; what a decoder refuses
// and survives.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "cells.h"
#include "packets.h"
#include "wild.h"

namespace isoreel {
namespace {

/// Gives the blocks random vectors; some stand still.
void setWild(MotionField& field, made::Random& random, std::uint32_t still) {
  for (Block& block : field.blocks()) {
    block.moves = random() % still != 0;
    for (std::int32_t& v : block.vector) v = static_cast<std::int32_t>(random() % 513) - 256;
  }
}

TEST(MotionField, HasTheBlocksOfTheLevelAndTheirCells) {
  made::Random random(1);
  for (const std::uint32_t log2 : {2u, 5u}) {
    const auto cells = made::randomCells(random, 0, 23, 40);
    const auto level = made::coarser(cells, log2);
    const MotionField field = made::blocksOf(cells, log2, 256);
    ASSERT_EQ(field.blocks().size(), level.size());
    EXPECT_EQ(field.blockLog2(), log2);
    std::uint32_t next = 0;
    for (std::size_t i = 0; i < level.size(); ++i) {
      const Block& block = field.blocks()[i];
      EXPECT_FALSE(block.moves);
      EXPECT_EQ(block.x, level[i].x);
      EXPECT_EQ(block.y, level[i].y);
      EXPECT_EQ(block.z, level[i].z);
      ASSERT_EQ(block.first, next);
      ASSERT_GT(block.count, 0u);
      for (; next < block.first + block.count; ++next) {
        ASSERT_EQ(cells[next].x >> log2, block.x);
        ASSERT_EQ(cells[next].y >> log2, block.y);
        ASSERT_EQ(cells[next].z >> log2, block.z);
      }
    }
    EXPECT_EQ(next, cells.size());
  }
  EXPECT_EQ(blockLevel(7, 3), 4u);
  EXPECT_EQ(blockLevel(3, 3), 0u);
  EXPECT_EQ(blockLevel(0, 2), 0u);
}

TEST(MotionField, ExpectsTheMeanOfTheMovingNeighboursBefore) {
  made::Random random(3);
  MotionField field = made::blocksOf(made::randomCells(random, 0, 24, 30), 2, 256);
  setWild(field, random, 4);
  std::array<int, 4> seen{};
  for (const Block& block : field.blocks()) {
    std::array<double, 3> sum{};
    std::size_t count = 0;
    for (const Block& other : field.blocks()) {
      const std::array<std::int32_t, 3> away{block.x - other.x, block.y - other.y, block.z - other.z};
      const bool before = std::ranges::count(away, 0) == 2 && away[0] + away[1] + away[2] == 1;
      if (!before || !other.moves) continue;
      ++count;
      for (std::size_t k = 0; k < 3; ++k) sum[k] += other.vector[k];
    }
    const MotionField::Expected expected = field.expected(block);
    ASSERT_EQ(expected.count, count);
    ++seen[count];
    for (std::size_t k = 0; k < 3; ++k)
      ASSERT_EQ(expected.vector[k], count == 0 ? 0 : std::trunc(sum[k] / static_cast<double>(count)));
  }
  for (const int count : seen) EXPECT_GT(count, 3);
}

TEST(MotionField, InterpolatesAsPlainArithmeticDoes) {
  made::Random random(2);
  for (const std::uint32_t log2 : {2u, 3u, 4u, 5u}) {
    const std::int64_t side = std::int64_t{1} << log2;
    const auto cells = made::randomCells(random, 0, 3 << log2, log2 < 4 ? 3 : 50);
    for (const std::uint32_t still : {2u, 100000u}) {
      const std::int32_t step = 256 + static_cast<std::int32_t>(random() % 4000);
      MotionField field = made::blocksOf(cells, log2, static_cast<std::uint32_t>(step));
      setWild(field, random, still);
      for (const Block& block : field.blocks()) {
        if (!block.moves) continue;
        MotionField::Interpolation at(field, block);
        for (std::uint32_t i = block.first; i < block.first + block.count; i += 7) {
          // Hats of one block's width around the middle of each block around this one; what does not move,
          // or is not there, moves like this one. Lengths in half cells.
          const std::array<std::int64_t, 3> middle{2 * cells[i].x + 1, 2 * cells[i].y + 1,
                                                   2 * cells[i].z + 1};
          std::array<std::int64_t, 3> sum{};
          for (std::int32_t around = 0; around < 27; ++around) {
            const std::array<std::int32_t, 3> there{block.x + around % 3 - 1, block.y + around / 3 % 3 - 1,
                                                    block.z + around / 9 - 1};
            std::int64_t weight = 1;
            for (std::size_t k = 0; k < 3; ++k)
              weight *= std::max<std::int64_t>(0, 2 * side - std::abs(middle[k] - (2 * there[k] + 1) * side));
            const Block* mover = &block;
            for (const Block& other : field.blocks()) {
              if (other.moves && std::array{other.x, other.y, other.z} == there) mover = &other;
            }
            for (std::size_t k = 0; k < 3; ++k) sum[k] += weight * mover->vector[k] * step;
          }
          const std::int64_t whole = 8 * side * side * side;
          const auto vector = at.at(cells[i]);
          for (std::size_t k = 0; k < 3; ++k) {
            const std::int64_t floor = (sum[k] - ((sum[k] % whole + whole) % whole)) / whole;
            ASSERT_EQ(vector[k], floor) << "cell " << i;
          }
        }
      }
    }
  }
}

TEST(MotionField, RoundTripsItsVectorsAndRefusesLongOnes) {
  made::Random random(4);
  const auto cells = made::randomCells(random, 0, 30, 20);
  MotionField field = made::blocksOf(cells, 2, 300);
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
  MotionField back = made::blocksOf(cells, 2, 300);
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

TEST(Predicted, PrefixGivesTheLastLevelThatIsWhole) {
  const auto at = [](double t) {
    return made::Field([=](double x, double y, double z) { return x + 0.3 * y + 0.1 * z - 0.9 - 0.1 * t; });
  };
  std::vector<std::vector<Bytes>> sequences{slowSphere(2)};
  // Levels below the blocks with hardly any bits, or none; all levels above the motion; a grid without
  // levels.
  for (const auto& [nodes, block_log2] :
       {std::pair{3u, 2u}, {4u, 2u}, {5u, 2u}, {6u, 2u}, {9u, 2u}, {9u, 5u}, {2u, 3u}}) {
    const Grid grid = made::gridOf(nodes, nodes, nodes);
    made::WildSequence sequence(7);
    made::Wild wild;
    wild.header.block_log2 = block_log2;
    std::vector<Bytes> packets{sequence.intra({"plane", made::sampled(grid, at(0))})};
    packets.push_back(sequence.predicted({"plane", made::sampled(grid, at(1))}, wild));
    sequences.push_back(packets);
  }
  std::size_t cut_in_motion = 0;
  for (const auto& packets : sequences) {
    SCOPED_TRACE(packets[1].size());
    Decoder decoder;
    const auto decode = [&](ByteSpan packet, const DecodeOptions& options) {
      EXPECT_TRUE(decoder.decode(packets[0]).ok());
      return decoder.decode(packet, options);
    };
    DecodeOptions prefix, coarse;
    prefix.allow_prefix = true;
    const auto full = decode(packets[1], {});
    ASSERT_TRUE(full.ok()) << full.error().message;
    const std::uint32_t depth = made::depthOf(full->grid);
    std::vector<Surface> levels;
    for (std::uint32_t level = 0; level < depth; ++level) {
      coarse.level = level;
      levels.push_back(*decode(packets[1], coarse));
    }
    std::size_t payload = 0;
    const PacketHeader header = *readPacketHeader(packets[1], &payload);
    for (std::size_t size = 0; size < packets[1].size(); ++size) {
      const ByteSpan cut = ByteSpan(packets[1]).first(size);
      const auto refused = decode(cut, {});
      ASSERT_FALSE(refused.ok()) << size;
      ASSERT_EQ(refused.error().code, ErrorCode::kTruncated);
      std::uint32_t first_cut = depth + 1;  // level
      bool motion_cut = false;
      std::size_t end = payload;
      for (const Section& s : header.sections) {
        end += s.bytes;
        if (end <= size || s.kind > static_cast<std::uint32_t>(SectionKind::kMotion)) continue;
        if (s.kind == static_cast<std::uint32_t>(SectionKind::kMotion)) {
          motion_cut = true;
        } else {
          first_cut = std::min(first_cut, s.level);
        }
      }
      const auto surface = decode(cut, prefix);
      if (size < payload || first_cut == 0) {
        ASSERT_FALSE(surface.ok()) << size;
        continue;
      }
      ASSERT_TRUE(surface.ok()) << size << ": " << surface.error().message;
      made::expectUsable(*surface);
      cut_in_motion += motion_cut;
      if (first_cut <= depth) {
        ASSERT_EQ(surface->vertices, levels[first_cut - 1].vertices) << size;
        ASSERT_EQ(surface->quads, levels[first_cut - 1].quads) << size;
      } else {
        // All signs are there; vertices are where those put them.
        ASSERT_EQ(surface->quads, full->quads) << size;
      }
    }
  }
  EXPECT_GT(cut_in_motion, 300u);
}

TEST(Predicted, SectionsMayStandInAnyOrder) {
  const auto packets = slowSphere(3);
  made::Random random(9);
  for (int trial = 0; trial < 20; ++trial) {
    made::Parts parts = made::taken(packets[1]);
    for (std::size_t i = parts.sections.size(); i > 1; --i) {
      const std::size_t j = random() % i;
      std::swap(parts.sections[i - 1], parts.sections[j]);
      std::swap(parts.header.sections[i - 1], parts.header.sections[j]);
    }
    Decoder decoder, expected;
    ASSERT_TRUE(decoder.decode(packets[0]).ok() && expected.decode(packets[0]).ok());
    const auto surface = decoder.decode(made::joined(parts));
    ASSERT_TRUE(surface.ok()) << surface.error().message;
    EXPECT_EQ(surface->vertices, expected.decode(packets[1])->vertices);
    EXPECT_TRUE(decoder.decode(packets[2]).ok());
  }
}

TEST(Predicted, EncoderPutsTheMotionBeforeTheLevelsThatItPredicts) {
  const made::Parts parts = made::taken(slowSphere(2)[1]);  // four levels of octree, blocks of 8
  std::uint32_t level = 0;
  bool motion = false;
  for (std::size_t i = 0; i < parts.sections.size(); ++i) {
    const Section& s = parts.header.sections[i];
    switch (static_cast<SectionKind>(s.kind)) {
      case SectionKind::kMotion:
        EXPECT_EQ(level, 1u);
        motion = true;
        break;
      case SectionKind::kVertices:
        EXPECT_EQ(i + 1, parts.sections.size());
        break;
      default:
        EXPECT_GE(s.level, level);
        level = s.level;
        EXPECT_EQ(motion, level > 1);
    }
  }
  EXPECT_TRUE(motion);
  EXPECT_EQ(level, 4u);
}

TEST(Damage, OfAPredictedPacketIsFound) {
  const auto packets = slowSphere(2);
  Decoder decoder;
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
