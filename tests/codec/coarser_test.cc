// SPDX-License-Identifier: BSD-3-Clause
// Coded cells that are larger than those of the volume.
#include "extract/coarser.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "made.h"

namespace isoreel {
namespace {

Result<Packet> encode(const made::Made& m, EncoderSettings settings, double cell) {
  settings.cell = cell;
  ISOREEL_ASSIGN(Encoder encoder, Encoder::create(settings));
  FrameTiming timing;
  timing.isovalue = m.isovalue;
  return encoder.encode(m.volume, timing);
}

EncoderSettings mainSettings(const made::Made& m, std::uint32_t step) {
  EncoderSettings settings = made::settings(m, step);
  settings.configuration.profile = Profile::kMain;
  return settings;
}

made::Made ball(std::uint32_t nodes) {
  return {"ball", made::sampled(made::gridOf(nodes, nodes, nodes), made::sphere(19.3, 20.1, 20.7, 15.2)), 0};
}

double rmsToBall(const Surface& surface) { return made::rmsToSphere(surface, {19.3, 20.1, 20.7}, 15.2); }

TEST(CoarserGrid, FillsTheSameBox) {
  Grid grid = made::gridOf(129, 128, 3);
  grid.origin = {5, -2, 1};
  grid.spacing = {0.5, 2, 1};
  EXPECT_EQ(coarserGrid(grid, 1), grid);
  for (const double cell : {1.5, 2.0, 3.0, 64.0}) {
    const Grid coarser = coarserGrid(grid, cell);
    const Vec3d ratio = cellsPerCell(grid, coarser);
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_GE(coarser.nodes[k], 2u);
      EXPECT_LE(ratio[k], cell + 1e-9);
      EXPECT_NEAR(coarser.spacing[k] * (coarser.nodes[k] - 1), grid.spacing[k] * (grid.nodes[k] - 1), 1e-9);
    }
    EXPECT_EQ(coarser.origin, grid.origin);
  }
  EXPECT_EQ(coarserGrid(grid, 2).nodes, (std::array<std::uint32_t, 3>{65, 65, 2}));
  EXPECT_EQ(coarserGrid(grid, 2).spacing, (Vec3d{1, 2 * 127.0 / 64, 2}));
  EXPECT_EQ(coarserGrid(grid, 64).nodes, (std::array<std::uint32_t, 3>{3, 3, 2}));
}

TEST(CoarserGrid, SamplesAreTrilinear) {
  const auto linear = [](double x, double y, double z) { return 2 * x - y + 0.5 * z + x * y * z / 8; };
  const Volume volume = made::sampled(made::gridOf(10, 9, 4), linear);
  const Grid grid = coarserGrid(volume.grid, 2);
  ASSERT_EQ(grid.nodes, (std::array<std::uint32_t, 3>{6, 5, 3}));
  const Volume coarser = resampled(volume, grid, serialFor);
  for (std::uint32_t z = 0; z < 3; ++z) {
    for (std::uint32_t y = 0; y < 5; ++y) {
      for (std::uint32_t x = 0; x < 6; ++x)
        EXPECT_NEAR(coarser.at(x, y, z), linear(x * 9 / 5.0, 2 * y, z * 1.5), 1e-4);
    }
  }
}

// Where lattices share their nodes, signs are the samples' own: the same faces as of every other sample.
TEST(CoarserGrid, SignsAreThoseOfTheNodes) {
  for (const Profile profile : {Profile::kClassic, Profile::kMain}) {
    for (const char* name : {"sphere", "half_sphere", "level_set"}) {
      const made::Made& m = made::named(name);
      EncoderSettings settings = made::settings(m);
      settings.configuration.profile = profile;
      const auto packet = encode(m, settings, 2);
      ASSERT_TRUE(packet.ok()) << packet.status().message();
      const Surface got = *Decoder().decode(packet->data);
      const made::Made fewer{name, resampled(m.volume, coarserGrid(m.volume.grid, 2), serialFor), m.isovalue,
                             m.inside};
      EncoderSettings plain = settings;
      plain.configuration.grid = fewer.volume.grid;
      const Surface expected = *Decoder().decode(encode(fewer, plain, 1)->data);
      EXPECT_EQ(got.quads, expected.quads) << name;
      EXPECT_EQ(got.grid, expected.grid);
    }
  }
}

TEST(CoarserGrid, HeightsAreForTheVolumeAsItIs) {
  for (const std::uint32_t nodes : {41u, 42u}) {  // 2 goes into 40, not into 41
    const made::Made m = ball(nodes);
    const EncoderSettings settings = mainSettings(m, kCell / 8);
    const auto fine = encode(m, settings, 1), coarse = encode(m, settings, 2);
    const made::Made fewer{"fewer", resampled(m.volume, coarserGrid(m.volume.grid, 2), serialFor), 0};
    EncoderSettings plain = settings;
    plain.configuration.grid = fewer.volume.grid;
    const auto from_fewer = encode(fewer, plain, 1);
    EXPECT_LT(2 * coarse->data.size(), fine->data.size());
    const double rms = rmsToBall(*Decoder().decode(coarse->data));
    EXPECT_LT(rms, 0.1);
    EXPECT_LT(rms, 0.9 * rmsToBall(*Decoder().decode(from_fewer->data)));
  }
}

TEST(CoarserGrid, EverySampleIsLookedAt) {
  made::Made m = ball(41);
  std::vector<float> samples(m.volume.samples.begin(), m.volume.samples.end());
  samples[m.volume.grid.nodeIndex(7, 8, 9)] = std::numeric_limits<float>::quiet_NaN();  // not on the lattice
  m.volume = Volume::own(m.volume.grid, samples);
  EncoderSettings settings = mainSettings(m, kCell / 8);
  const auto refused = encode(m, settings, 2);
  EXPECT_NE(refused.status().message().find("7, 8, 9"), std::string::npos) << refused.status().message();
  settings.non_finite = NonFinite::kOutside;
  const auto packet = encode(m, settings, 2);
  ASSERT_TRUE(packet.ok());
  EXPECT_LT(rmsToBall(*Decoder().decode(packet->data)), 0.3);
}

TEST(CoarserGrid, OtherSidesAndGridsAreRefused) {
  const made::Made m = ball(41);
  for (const double cell : {0.5, 0.0, -1.0, 65.0, std::nan("")}) {
    EncoderSettings settings = made::settings(m);
    settings.cell = cell;
    EXPECT_EQ(Encoder::create(settings).status().error().code, ErrorCode::kInvalidArgument) << cell;
  }
  const auto other = encode({"fewer", made::sampled(made::gridOf(21, 21, 21), made::sphere(9, 9, 9, 5)), 0},
                            made::settings(m), 2);
  EXPECT_NE(other.status().message().find("grid differs in size"), std::string::npos);
}

}  // namespace
}  // namespace isoreel
