// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "lattice/sign_tables.h"
#include "made.h"

namespace isoreel {
namespace {

/// The decoded surface of a made volume.
Surface decoded(const Packet& packet) {
  Decoder decoder;
  auto surface = decoder.decode(packet.data);
  EXPECT_TRUE(surface.ok()) << (surface.ok() ? "" : surface.error().message);
  return surface.ok() ? *std::move(surface) : Surface{};
}

class RoundTrip : public testing::TestWithParam<std::uint32_t> {};

TEST_P(RoundTrip, SignsAreEqualAndVerticesWithinTheStep) {
  const std::uint32_t step = GetParam();
  for (const made::Made& m : made::all()) {
    SCOPED_TRACE(m.name);
    const Packet packet = made::encoded(m, step);
    const Surface surface = decoded(packet);
    const auto header = readPacketHeader(packet.data);
    ASSERT_TRUE(header.ok());
    ASSERT_EQ(header->step, step);
    const double tangential = header->tangential_step;
    // Half a step along each axis of a frame; a few units for the tables' and the positions' rounding.
    const double farthest = std::sqrt(0.25 * step * step + 0.5 * tangential * tangential) + 4;
    const Surface exact = made::extracted(m);
    const made::Reference reference = made::reference(m, made::depthOf(m.volume.grid));
    ASSERT_EQ(surface.vertices.size(), reference.cells.size());
    ASSERT_EQ(surface.quads, reference.quads);
    EXPECT_EQ(surface.grid, m.volume.grid);
    EXPECT_EQ(packet.header.vertices, surface.vertices.size());
    EXPECT_EQ(packet.header.faces, surface.quads.size());
    double largest = 0, squares = 0;
    for (std::size_t i = 0; i < surface.vertices.size(); ++i) {
      const LocalFrame& frame = kLocalFrames[reference.cells[i].corners];
      std::array<double, 3> error{};
      bool at_wall = false;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::int32_t inner =
            surface.vertices[i][k] - static_cast<std::int32_t>(reference.cells[i].at[k]) * kCell;
        ASSERT_GE(inner, 0);
        ASSERT_LE(inner, kCell);
        at_wall |= inner == 0 || inner == kCell;
        error[k] = surface.vertices[i][k] - exact.vertices[i][k];
      }
      const double distance = std::hypot(error[0], error[1], error[2]);
      largest = std::max(largest, distance);
      squares += distance * distance;
      ASSERT_LE(distance, farthest);
      if (at_wall) continue;  // moved back into its cell, which can only bring it nearer
      const auto along = [&](const std::array<std::int32_t, 3>& axis) {
        return std::abs(error[0] * axis[0] + error[1] * axis[1] + error[2] * axis[2]) / kCell;
      };
      ASSERT_LE(along(frame.normal), step / 2.0 + 4);
      ASSERT_LE(along(frame.tangent1), tangential / 2 + 4);
      ASSERT_LE(along(frame.tangent2), tangential / 2 + 4);
    }
    if (!surface.vertices.empty()) {
      EXPECT_EQ(packet.header.error_kind, ErrorKind::kExtracted);
      EXPECT_NEAR(packet.header.error_max, largest / kCell, 1e-6);
      EXPECT_NEAR(packet.header.error_rms,
                  std::sqrt(squares / static_cast<double>(surface.vertices.size())) / kCell, 1e-6);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Steps, RoundTrip, testing::Values(1, 100, 1024, 4096, 16384));

TEST(Encode, SurfacesAreClosedAndFaceOutwards) {
  for (const made::Made& m : made::all()) {
    EXPECT_TRUE(
        made::isClosed(made::reference(m, made::depthOf(m.volume.grid)), decoded(made::encoded(m)).quads))
        << m.name;
  }
  const double exact = 4.0 / 3 * std::numbers::pi * std::pow(11.3, 3);
  EXPECT_NEAR(made::enclosedVolume(decoded(made::encoded(made::named("sphere")))), exact, exact * 0.01);
  const double torus = 2 * std::numbers::pi * std::numbers::pi * 12.4 * 4.7 * 4.7;
  EXPECT_NEAR(made::enclosedVolume(decoded(made::encoded(made::named("torus")))), torus, torus * 0.02);
}

TEST(Encode, MirroredGridsStillFaceOutwardsInTheWorld) {
  made::Made m = made::named("sphere");
  Grid grid = m.volume.grid;
  grid.origin = {5, -7, 11};
  grid.spacing = {0.5, 2, 0.25};
  grid.direction = {0, 1, 0, 1, 0, 0, 0, 0, 1};  // swaps two axes
  m.volume.grid = grid;
  const Packet packet = made::encoded(m);
  const Surface surface = decoded(packet);
  EXPECT_EQ(surface.grid, grid);
  const double exact = 4.0 / 3 * std::numbers::pi * std::pow(11.3, 3) * 0.25;
  EXPECT_NEAR(made::enclosedVolume(surface), exact, exact * 0.01);
  EXPECT_NEAR(packet.header.volume, exact, exact * 0.01);
  const Vec3d centre = grid.world(Vec3d{16.2, 15.9, 16.4});
  const auto normals = surface.normals();
  for (std::uint32_t i = 0; i < surface.vertices.size(); ++i) {
    const Vec3d p = surface.world(i);
    double outwards = 0;
    for (std::size_t k = 0; k < 3; ++k) outwards += (p[k] - centre[k]) * static_cast<double>(normals[i][k]);
    ASSERT_GT(outwards, 0);
  }
}

TEST(Facts, AreThoseOfTheShape) {
  const FrameHeader sphere = made::encoded(made::named("sphere")).header;
  const double pi = std::numbers::pi;
  EXPECT_NEAR(sphere.area, 4 * pi * 11.3 * 11.3, 4 * pi * 11.3 * 11.3 * 0.02);
  EXPECT_NEAR(sphere.volume, 4.0 / 3 * pi * std::pow(11.3, 3), 4.0 / 3 * pi * std::pow(11.3, 3) * 0.01);
  EXPECT_EQ(sphere.components, 1u);
  EXPECT_EQ(sphere.euler, 2);
  EXPECT_NEAR(sphere.box_min[0] / double{kCell}, 16.2 - 11.3, 0.2);
  EXPECT_NEAR(sphere.box_max[2] / double{kCell}, 16.4 + 11.3, 0.2);

  const FrameHeader torus = made::encoded(made::named("torus")).header;
  EXPECT_NEAR(torus.area, 4 * pi * pi * 12.4 * 4.7, 4 * pi * pi * 12.4 * 4.7 * 0.02);
  EXPECT_NEAR(torus.volume, 2 * pi * pi * 12.4 * 4.7 * 4.7, 2 * pi * pi * 12.4 * 4.7 * 4.7 * 0.01);
  EXPECT_EQ(torus.components, 1u);
  EXPECT_EQ(torus.euler, 0);

  const FrameHeader two = made::encoded(made::named("two_spheres")).header;
  EXPECT_EQ(two.components, 2u);
  EXPECT_EQ(two.euler, 4);

  // A half sphere, cut by the border: half the volume, and a disc in topology.
  const FrameHeader half = made::encoded(made::named("half_sphere")).header;
  EXPECT_NEAR(half.volume, 2.0 / 3 * pi * std::pow(9.6, 3), 2.0 / 3 * pi * std::pow(9.6, 3) * 0.01);
  EXPECT_EQ(half.components, 1u);
  EXPECT_EQ(half.euler, 1);

  const FrameHeader empty = made::encoded(made::named("empty")).header;
  EXPECT_EQ(empty.vertices, 0u);
  EXPECT_EQ(empty.faces, 0u);
  EXPECT_EQ(empty.area, 0);
  EXPECT_EQ(empty.volume, 0);
  EXPECT_EQ(empty.components, 0u);
  EXPECT_EQ(empty.box_max, (std::array<std::uint32_t, 3>{0, 0, 0}));
  const FrameHeader inside = made::encoded(made::named("all_inside")).header;
  EXPECT_EQ(inside.vertices, 0u);
  EXPECT_EQ(inside.volume, 11.0 * 8 * 13);
}

TEST(Facts, HashIsThatOfTheDecodedSurface) {
  for (const made::Made& m : made::all()) {
    const Packet packet = made::encoded(m);
    EXPECT_EQ(packet.header.surface_hash, surfaceHash(decoded(packet))) << m.name;
  }
}

TEST(Encode, SameBytesFromEveryEncoderAndAnyThreads) {
  for (const made::Made& m : made::all()) {
    const Packet first = made::encoded(m);
    EncoderSettings settings = made::settings(m);
    settings.parallel = made::threadedFor;
    auto encoder = Encoder::create(settings);
    ASSERT_TRUE(encoder.ok());
    FrameTiming timing;
    timing.isovalue = m.isovalue;
    for (int again = 0; again < 2; ++again) {
      PacketSizes sizes;
      auto packet = encoder->encode(m.volume, timing, &sizes);
      ASSERT_TRUE(packet.ok());
      EXPECT_EQ(packet->data, first.data) << m.name;
      EXPECT_EQ(packet->header, first.header) << m.name;
      EXPECT_EQ(sizes.signs + sizes.motion + sizes.vertices + sizes.other, packet->data.size());
    }
  }
}

TEST(Encode, CarriesTimeAndIsovalue) {
  const made::Made& m = made::named("noise_2x5x9");
  auto encoder = Encoder::create(made::settings(m));
  ASSERT_TRUE(encoder.ok());
  const FrameTiming timing{std::uint64_t{1} << 40, -12345, 7, -0.25};
  const auto packet = encoder->encode(m.volume, timing);
  ASSERT_TRUE(packet.ok());
  const auto header = readPacketHeader(packet->data);
  ASSERT_TRUE(header.ok());
  EXPECT_EQ(header->number, timing.number);
  EXPECT_EQ(header->time, timing.time);
  EXPECT_EQ(header->duration, timing.duration);
  EXPECT_EQ(header->isovalue, timing.isovalue);
  EXPECT_EQ(header->configuration, encoder->configurationRecord());
  EXPECT_EQ(packet->header.number, timing.number);
  EXPECT_EQ(packet->header.back, 0u);
  EXPECT_EQ(packet->header.time, timing.time);
}

TEST(Encode, RefusesWhatBreaksTheRules) {
  const made::Made& m = made::named("noise_2x5x9");
  EncoderSettings settings = made::settings(m);
  settings.configuration.step = 0;
  EXPECT_FALSE(Encoder::create(settings).ok());
  settings.configuration.step = kCell + 1;
  EXPECT_FALSE(Encoder::create(settings).ok());
  settings = made::settings(m);
  settings.configuration.grid.nodes[0] = 1;
  EXPECT_FALSE(Encoder::create(settings).ok());
  settings = made::settings(m);
  settings.configuration.profile = static_cast<Profile>(2);
  EXPECT_FALSE(Encoder::create(settings).ok());

  auto encoder = Encoder::create(made::settings(m));
  ASSERT_TRUE(encoder.ok());
  EXPECT_FALSE(encoder->encode(made::named("sphere").volume, {}).ok());
  Volume few = m.volume;
  few.samples = few.samples.first(5);
  EXPECT_FALSE(encoder->encode(few, {}).ok());
  FrameTiming timing;
  timing.isovalue = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(encoder->encode(m.volume, timing).ok());
  EXPECT_TRUE(encoder->encode(m.volume, {}).ok()) << "an encoder goes on after an error";
}

}  // namespace
}  // namespace isoreel
