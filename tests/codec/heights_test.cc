// SPDX-License-Identifier: BSD-3-Clause
// Profile main: what signs predict, mixed decisions, and heights there and back.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "entropy/mixer.h"
#include "extract/sign_bitmap.h"
#include "lattice/sheets.h"
#include "lattice/surroundings.h"
#include "made.h"
#include "packets.h"
#include "wild.h"

namespace isoreel {
namespace {

TEST(Mixer, SquashRisesAndStretchIsItsInverse) {
  for (std::int32_t x = -logistic::kLimit; x < logistic::kLimit; ++x) {
    ASSERT_LE(logistic::squash(x), logistic::squash(x + 1));
    ASSERT_NEAR(logistic::squash(x), 65536 / (1 + std::exp(-x / 256.0)), 500) << x;
  }
  for (std::int32_t p = 16; p < 4080; ++p) {
    const std::int32_t x = logistic::kStretched[static_cast<std::size_t>(p)];
    ASSERT_LE(logistic::squash(x), 16 * p);
    ASSERT_GT(logistic::squash(x + 1), 16 * p);
  }
}

TEST(SignLanes, AreAsTheDefinitionSays) {
  made::Random random(7);
  const auto between = [&](std::int32_t low, std::int32_t high) {
    const auto any = static_cast<std::int32_t>(random() % static_cast<std::uint32_t>(high - low + 1));
    return static_cast<std::int16_t>(random() % 8 == 0 ? std::array{low, high}[random() % 2] : low + any);
  };
  for (int trial = 0; trial < 20000; ++trial) {
    std::array<Lanes, 8> points, normals;
    for (Lanes& p : points) p.v = {between(0, 2048), between(0, 2048), between(0, 2048), 0};
    for (Lanes& n : normals)
      n.v = {between(-16384, 16384), between(-16384, 16384), between(-16384, 16384), between(-896, 896)};
    std::array<std::uint32_t, 6> across{};
    for (std::uint32_t& j : across) j = random() % 8;
    const CellAround at{random() % 8, across.data(), static_cast<std::uint8_t>(random() % 64)};
    ASSERT_EQ(meanAround(points.data(), at).v, definition::meanAround(points.data(), at).v) << trial;
    const SignInputs found = inputsOf(points.data(), normals.data(), points[0], at);
    const SignInputs expected = definition::inputsOf(points.data(), normals.data(), points[0], at);
    ASSERT_EQ(found.v, expected.v) << trial;
    ASSERT_EQ(found.bend, expected.bend) << trial;
    SignInputs inputs;
    for (std::int16_t& v : inputs.v) v = between(-32768, 32767);
    inputs.bend = between(0, 15);
    InputWeights weights;
    for (std::size_t k = 0; k < inputs.v.size(); ++k) weights.v[k] = between(-255, 255);
    ASSERT_EQ(weighed(inputs, weights), definition::weighed(inputs, weights)) << trial;
    const std::int16_t height = between(-32767, 32767);
    ASSERT_EQ(atHeight(points[0], normals[0], height), definition::atHeight(points[0], normals[0], height))
        << trial;
  }
}

TEST(Mixer, FollowsTheModelThatKnows) {
  // One model sees what decides the bit, the other one sees noise.
  made::Random random(1);
  std::array<BitModel, 2> knows;
  std::array<BitModel, 4> guesses;
  MixWeights<2> weights;
  Bytes bytes;
  std::vector<bool> bits;
  std::vector<std::array<std::size_t, 2>> contexts;
  for (int i = 0; i < 20000; ++i) {
    contexts.push_back({random() % 2, random() % 4});
    bits.push_back((contexts.back()[0] == 1) != (random() % 50 == 0));
  }
  RangePut put(bytes);
  for (std::size_t i = 0; i < bits.size(); ++i)
    codeMixed(put, Mix<2>({&knows[contexts[i][0]], &guesses[contexts[i][1]]}, weights, kVertexFloor),
              bits[i]);
  put.finish();
  EXPECT_LT(bytes.size() * 8, bits.size() / 5);  // entropy: 0.141 bits; a model that knows nothing needs 1
  knows.fill({});
  guesses.fill({});
  weights = {};
  RangeGet get(bytes);
  for (std::size_t i = 0; i < bits.size(); ++i)
    ASSERT_EQ(
        codeMixed(get, Mix<2>({&knows[contexts[i][0]], &guesses[contexts[i][1]]}, weights, kVertexFloor),
                  false),
        bits[i]);
  EXPECT_TRUE(get.finished());
}

TEST(Mixer, NoDecisionOfAVertexIsCheaperThanAVertexMayBe) {
  EXPECT_GT(-std::log2(1 - kVertexFloor / 65536.0), 8 / 512.0);
}

TEST(Surroundings, AreWhatTheBitmapSays) {
  std::vector<made::Made> all = made::all();
  all.push_back(made::large());
  for (const made::Made& m : all) {
    SCOPED_TRACE(m.name);
    const SignBitmap bitmap =
        *SignBitmap::make(m.volume, m.isovalue, m.inside, NonFinite::kOutside, serialFor);
    const std::vector<Cell> cells = bitmap.activeCells(serialFor);
    CellIndex index;
    index.build(cells);
    Surroundings around;
    around.build(cells, index, {}, made::threadedFor);
    ASSERT_TRUE(around.runs.size() > 1 || m.name != "large");
    ASSERT_EQ(around.runs.back().end, cells.size());
    std::size_t run = 0;
    const auto& nodes = m.volume.grid.nodes;
    const auto sign = [&](std::int64_t x, std::int64_t y, std::int64_t z) {
      const auto limited = [&](std::int64_t v, std::size_t k) {
        return static_cast<std::uint32_t>(std::clamp<std::int64_t>(v, 0, nodes[k] - 1));
      };
      return bitmap.at(limited(x, 0), limited(y, 1), limited(z, 2));
    };
    for (std::uint32_t i = 0; i < cells.size(); ++i) {
      const Cell& c = cells[i];
      for (int node = 0; node < 64; ++node) {
        ASSERT_EQ(around.signs[i] >> node & 1,
                  sign(c.x + (node & 3) - 1, c.y + (node >> 2 & 3) - 1, c.z + (node >> 4) - 1));
      }
      if (i == around.runs[run].end) {
        ASSERT_EQ(around.runs[++run].first, i);
      }
      for (std::size_t face = 0; face < 6; ++face) {
        std::array<std::int32_t, 3> to{c.x, c.y, c.z};
        to[face / 2] += face % 2 == 0 ? -1 : 1;
        std::uint32_t inside = 0;
        for (std::uint32_t j = 0; j < 8; ++j)
          inside += (j >> face / 2 & 1) == face % 2 ? c.corners >> j & 1u : 0u;
        const std::uint32_t other = index.find(to[0], to[1], to[2]);
        const bool taken = inside != 0 && inside != 4 && other != CellIndex::kNone;
        ASSERT_EQ(around.runs[run].across(i)[face], taken ? other : i);
        ASSERT_EQ(around.faces[i] >> face & 1, taken);
      }
    }
    EXPECT_EQ(run + 1, around.runs.size());
    around.link(cells, index, made::threadedFor);
    // By their differences: earlier even cells of an even one, all even ones of an odd one, nearer ones
    // first.
    for (const Surroundings::Run& of : around.runs) {
      std::array<std::uint32_t, 2> next{of.first, of.first};
      for (std::uint32_t colour = 0; colour < 2; ++colour) {
        Surroundings::Links links(of, colour);
        const Surroundings::Colour& list = of.colours[colour];
        for (std::size_t n = 0; n < list.cells.size(); ++n) {
          const std::uint32_t i = list.cells[n];
          ASSERT_GE(i, next[colour]);
          next[colour] = i + 1;
          const Cell& c = cells[i];
          ASSERT_EQ((c.x + c.y + c.z) % 2, static_cast<int>(colour));
          std::array<std::vector<std::uint32_t>, 4> expected;  // by how many coordinates differ
          for (int d = 0; d < 27; ++d) {
            const std::array<int, 3> way{d % 3 - 1, d / 3 % 3 - 1, d / 9 - 1};
            const std::uint32_t other = index.find(c.x + way[0], c.y + way[1], c.z + way[2]);
            if (other == CellIndex::kNone || (colour == 0 && other > i)) continue;
            expected[static_cast<std::size_t>(std::abs(way[0]) + std::abs(way[1]) + std::abs(way[2]))]
                .push_back(other);
          }
          const std::uint8_t count = list.counts[n];
          const std::uint32_t near = count & 15u, far = count >> 4;
          const std::uint32_t* const own = links.next(count);
          const auto sorted = [](const std::uint32_t* from, std::size_t size) {
            std::vector<std::uint32_t> result(from, from + size);
            std::sort(result.begin(), result.end());
            return result;
          };
          for (auto& places : expected) std::sort(places.begin(), places.end());
          ASSERT_EQ(sorted(own, near), expected[colour == 0 ? 2 : 1]);
          ASSERT_EQ(sorted(own + near, far), colour == 0 ? std::vector<std::uint32_t>{} : expected[3]);
        }
      }
      ASSERT_EQ(of.colours[0].cells.size() + of.colours[1].cells.size(), of.end - of.first);
    }
  }
}

// What a decoder gives is what the encoder hashed: each decode() below checks that.
TEST(Heights, ComeBackWithAnyToolsAndSteps) {
  for (const made::Made& m : made::all()) {
    SCOPED_TRACE(m.name);
    const Surface classic = *Decoder().decode(made::encoded(m).data);
    for (const std::uint32_t step : {1u, 700u, 2048u}) {
      HeightSettings heights;
      heights.neighbours = step != 700;
      heights.mixed_signs = step != 2048;
      heights.weigh_rate = step != 1;
      heights.sheets = step != 2048;
      const Packet packet = made::encodedMain(m, step, heights);
      Decoder decoder;
      const auto surface = decoder.decode(packet.data);
      ASSERT_TRUE(surface.ok()) << surface.error().message;
      // The same but for cells with several vertices.
      std::vector<std::uint32_t> numbers;
      for (std::size_t i = 0; i < surface->vertices.size(); ++i) {
        const bool same = i > 0 && sameCell(decoder.cells()[i - 1], decoder.cells()[i]);
        ASSERT_TRUE(!same || heights.sheets);
        numbers.push_back(i == 0 ? 0 : numbers.back() + (same ? 0 : 1));
        ASSERT_LT(numbers[i], classic.vertices.size());
        for (std::size_t k = 0; k < 3; ++k)  // in the same cell
          ASSERT_LE(std::abs(surface->vertices[i][k] - classic.vertices[numbers[i]][k]), kCell);
      }
      std::vector<Quad> quads = surface->quads, of_classic = classic.quads;
      for (Quad& quad : quads) {
        for (std::uint32_t& corner : quad) corner = numbers[corner];
      }
      std::sort(quads.begin(), quads.end());
      std::sort(of_classic.begin(), of_classic.end());
      EXPECT_EQ(quads, of_classic);
      EXPECT_TRUE(checkClosed(*surface).ok());
    }
  }
}

TEST(Heights, BringTheMeshCloserForFewerBytes) {
  const made::Made m{"sphere", made::sampled(made::gridOf(40, 41, 42), made::sphere(19.3, 20.1, 20.7, 15.2)),
                     0};
  const auto rms = [](const Surface& surface) {
    return made::rmsToSphere(surface, {19.3, 20.1, 20.7}, 15.2);
  };
  const Packet main = made::encodedMain(m, kCell / 16);
  const Packet coarse = made::encoded(m, kCell / 8);
  EXPECT_LT(5 * main.data.size(), 3 * coarse.data.size());
  EXPECT_LT(rms(*Decoder().decode(main.data)), rms(*Decoder().decode(coarse.data)));
}

TEST(Heights, AreTheSameWhateverRunsInParallel) {
  const made::Made& m = made::named("level_set");
  EncoderSettings settings = made::settings(m);
  settings.configuration.profile = Profile::kMain;
  const Packet serial = *Encoder::create(settings)->encode(m.volume, {0, 0, 1, m.isovalue});
  settings.parallel = [](std::size_t count, const std::function<void(std::size_t)>& body) {
    for (std::size_t i = count; i-- > 0;) body(i);
  };
  auto encoder = Encoder::create(settings);
  EXPECT_EQ(encoder->encode(m.volume, {0, 0, 1, m.isovalue})->data, serial.data);
  EXPECT_EQ(encoder->encode(m.volume, {0, 0, 1, m.isovalue})->data,
            serial.data);  // nothing is left of the first frame
}

/// A torus that turns and moves.
std::vector<made::Made> moving(int count) {
  std::vector<made::Made> frames;
  for (int t = 0; t < count; ++t)
    frames.push_back({"moving",
                      made::sampled(made::gridOf(30, 31, 25),
                                    made::torus(13.2 + 0.6 * t, 14.7 - 0.3 * t, 12.1 + 0.2 * t, 7.3, 3.1)),
                      0});
  return frames;
}

std::vector<Packet> encodedMoving(const std::vector<made::Made>& frames, const HeightSettings& heights,
                                  FrameTypes types, const ParallelFor& parallel = serialFor) {
  EncoderSettings settings = made::settings(frames[0], kCell / 8);
  settings.configuration.profile = Profile::kMain;
  settings.frame_types = types;
  settings.gop = 5;
  settings.heights = heights;
  settings.parallel = parallel;
  auto encoder = Encoder::create(settings);
  std::vector<Packet> packets;
  for (const made::Made& frame : frames)
    packets.push_back(*encoder->encode(frame.volume, {packets.size(), 0, 1, frame.isovalue}));
  return packets;
}

TEST(MovedHeights, ComeBackWithAnyToolsForFewerBytes) {
  const std::vector<made::Made> frames = moving(7);
  for (const bool on : {true, false}) {
    HeightSettings heights;
    heights.neighbours = heights.mixed_signs = heights.weigh_rate = on;
    const std::vector<Packet> intra = encodedMoving(frames, heights, FrameTypes::kIntra),
                              predicted = encodedMoving(frames, heights, FrameTypes::kAuto);
    Decoder decoder;
    std::string types;
    std::size_t bytes = 0, bytes_intra = 0;
    for (std::size_t i = 0; i < frames.size(); ++i) {
      const auto surface = decoder.decode(predicted[i].data);
      ASSERT_TRUE(surface.ok()) << surface.error().message;
      EXPECT_EQ(surface->quads, Decoder().decode(intra[i].data)->quads);
      types += predicted[i].header.type == PacketType::kPredicted ? 'P' : 'I';
      bytes += predicted[i].data.size();
      bytes_intra += intra[i].data.size();
    }
    EXPECT_EQ(types, "IPPPPIP");
    EXPECT_LT(5 * bytes, 4 * bytes_intra);
  }
}

TEST(MovedHeights, AreTheSameWhateverRunsInParallel) {
  const std::vector<made::Made> frames = moving(3);
  const auto backwards = [](std::size_t count, const std::function<void(std::size_t)>& body) {
    for (std::size_t i = count; i-- > 0;) body(i);
  };
  const std::vector<Packet> one = encodedMoving(frames, {}, FrameTypes::kAuto),
                            two = encodedMoving(frames, {}, FrameTypes::kAuto, backwards);
  for (std::size_t i = 0; i < frames.size(); ++i) EXPECT_EQ(one[i].data, two[i].data);
}

TEST(MovedHeights, DamageIsRefusedOrHarmless) {
  const std::vector<Packet> packets = encodedMoving(moving(3), {}, FrameTypes::kAuto);
  const made::Parts parts = made::taken(packets[2].data);
  Decoder before;
  for (int i = 0; i < 2; ++i) ASSERT_TRUE(before.decode(packets[static_cast<std::size_t>(i)].data).ok());
  made::Random random(3);
  int refused = 0;
  for (int i = 0; i < 200; ++i) {
    made::Parts damaged = parts;
    Bytes& section = damaged.sections[random() % damaged.sections.size()];
    const Bytes whole = section;
    if (i % 3 == 0 && !section.empty()) section.resize(random() % section.size());
    for (int flips = 0; flips < 3 && !section.empty(); ++flips)
      section[random() % section.size()] ^= static_cast<std::uint8_t>(1u << random() % 8);
    if (section == whole) continue;
    refused += !Decoder(before).decode(made::joined(damaged)).ok();  // or it gave the surface of the hash
  }
  EXPECT_GT(refused, 150);
  EXPECT_TRUE(Decoder(before).decode(packets[2].data).ok());
}

TEST(Heights, DamageIsRefusedOrHarmless) {
  const Bytes good = made::wildHeights(made::named("torus"), 300, 9, 1);
  const made::Parts parts = made::taken(good);
  made::Random random(2);
  for (int i = 0; i < 300; ++i) {
    made::Parts damaged = parts;
    Bytes& section = damaged.sections.back();
    if (i % 3 == 0) section.resize(random() % section.size());
    for (int flips = 0; flips < 3 && !section.empty(); ++flips)
      section[random() % section.size()] ^= static_cast<std::uint8_t>(1u << random() % 8);
    const auto surface = Decoder().decode(made::joined(damaged));
    EXPECT_FALSE(surface.ok());
  }
}

}  // namespace
}  // namespace isoreel
