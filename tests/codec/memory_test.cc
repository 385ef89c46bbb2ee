// SPDX-License-Identifier: BSD-3-Clause
// DecodeOptions::max_bytes: what a decode may take is reckoned before it is taken.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <new>

#include "inter/reference_field.h"
#include "made.h"

namespace {
/// Of the allocations from now on, the one that fails; 0: none.
std::uint64_t failing = 0;
}  // namespace

[[gnu::noinline]] void* operator new(std::size_t size) {
  if (failing > 0 && --failing == 0) throw std::bad_alloc();
  if (void* memory = std::malloc(size > 0 ? size : 1)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace isoreel {
namespace {

struct Shape {
  const char* name;
  Volume (*at)(int time);
};

/// Single nodes inside, each where bricks of the distance field meet.
Volume crumbs(int /*time*/) {
  return made::sampled(made::gridOf(66, 66, 66), [](double x, double y, double z) {
    const auto on = [](double v) { return static_cast<int>(v) % 16 == 8; };
    return on(x) && on(y) && on(z) ? -1.0 : 1.0;
  });
}
Volume ball(int time) {
  return made::sampled(made::gridOf(33, 33, 33), [=](double x, double y, double z) {
    return std::hypot(x - 16 - 0.3 * time, y - 16, z - 16) - 11;
  });
}

Result<Encoder> encoderOf(const Shape& shape, Profile profile) {
  EncoderSettings settings;
  settings.configuration.grid = shape.at(0).grid;
  settings.configuration.inside = Inside::kBelow;
  settings.configuration.profile = profile;
  settings.frame_types = FrameTypes::kAuto;
  return Encoder::create(settings);
}

std::vector<Bytes> encoded(const Shape& shape, Profile profile) {
  auto encoder = encoderOf(shape, profile);
  std::vector<Bytes> packets;
  for (int i = 0; encoder.ok() && i < 3; ++i) {
    auto packet = encoder->encode(shape.at(i), {static_cast<std::uint64_t>(i), i, 1, 0.0});
    if (!packet.ok()) break;
    packets.push_back(packet->data);
  }
  return packets;
}

/// Decodes one after the other; the number of the first that fails, or how many they are.
std::size_t decodedWithin(std::uint64_t most, const std::vector<Bytes>& packets) {
  Decoder decoder;
  DecodeOptions options;
  options.max_bytes = most;
  for (std::size_t i = 0; i < packets.size(); ++i) {
    const auto surface = decoder.decode(packets[i], options);
    if (surface.ok()) continue;
    EXPECT_EQ(surface.error().code, ErrorCode::kLimit) << surface.error().message;
    EXPECT_NE(surface.error().message.find(std::to_string(most)), std::string::npos)
        << surface.error().message;
    return i;
  }
  return packets.size();
}

class Memory : public testing::TestWithParam<Profile> {};

TEST_P(Memory, IsReckonedBeforeItIsTaken) {
  for (const Shape& shape : {Shape{"crumbs", crumbs}, Shape{"ball", ball}}) {
    SCOPED_TRACE(shape.name);
    const std::vector<Bytes> packets = encoded(shape, GetParam());
    ASSERT_EQ(packets.size(), 3u);
    ASSERT_EQ(decodedWithin(DecodeOptions{}.max_bytes, packets), 3u);
    std::uint64_t low = 0, high = std::uint64_t{8} << 20;  // fails, does not
    while (high - low > 16384) {
      const std::uint64_t middle = low + (high - low) / 2;
      (decodedWithin(middle, packets) < 3 ? low : high) = middle;
    }
    // Of a surface that hangs together, so much a vertex; of one that does not, some kilobytes.
    const std::uint64_t each = high / readPacketHeader(packets[1])->vertices;
    const bool whole = shape.at == ball;
    EXPECT_GT(each, whole ? 150u : 2500u);
    EXPECT_LT(each, whole ? 500u : 8000u);
  }
}

TEST_P(Memory, FieldsOfManySmallPiecesAreRefused) {
  const std::vector<Bytes> small = encoded({"crumbs", crumbs}, GetParam());
  ASSERT_EQ(readPacketHeader(small[1])->type, PacketType::kPredicted);
  constexpr std::uint64_t kMost = 3 << 19;
  EXPECT_EQ(decodedWithin(kMost, small), 1u);
  EXPECT_EQ(decodedWithin(kMost, encoded({"ball", ball}, GetParam())), 3u);
}

TEST_P(Memory, ADecoderGoesOnAfterARefusal) {
  const std::vector<Bytes> packets = encoded({"crumbs", crumbs}, GetParam());
  Decoder decoder;
  DecodeOptions little;
  little.max_bytes = 3 << 19;
  ASSERT_TRUE(decoder.decode(packets[0], little).ok());
  EXPECT_EQ(decoder.decode(packets[1], little).error().code, ErrorCode::kLimit);
  EXPECT_EQ(decoder.decode(packets[1]).error().code, ErrorCode::kNotFound);
  for (const Bytes& packet : packets) EXPECT_TRUE(decoder.decode(packet).ok());
}

TEST_P(Memory, EveryAllocationMayFail) {
  const std::vector<Bytes> packets = encoded({"ball", ball}, GetParam());
  Decoder decoder;
  const auto before = decoder.decode(packets[0]);
  ASSERT_TRUE(before.ok());
  for (std::uint64_t nth = 1;; ++nth) {
    Decoder other = decoder;
    failing = nth;
    const auto surface = other.decode(packets[1]);
    const bool failed = failing == 0;
    failing = 0;
    if (!failed) {
      EXPECT_TRUE(surface.ok());
      EXPECT_GT(nth, 20u);
      break;
    }
    EXPECT_EQ(surface.error().code, ErrorCode::kLimit);
    EXPECT_TRUE(other.cells().empty());
    EXPECT_FALSE(other.decode(packets[1]).ok());
    EXPECT_TRUE(other.decode(packets[0]).ok());
  }
}

// Of the first ones, every allocation may fail, then one in some.
TEST_P(Memory, AllocationsOfTheEncoderMayFail) {
  const Shape shape{
      "small", [](int) { return made::sampled(made::gridOf(9, 9, 9), made::sphere(4.1, 4.2, 4.3, 2.9)); }};
  const Volume volume = shape.at(0);
  const auto packet = [&](Encoder& encoder, std::uint64_t number) {
    return encoder.encode(volume, {number, static_cast<std::int64_t>(number), 1, 0.0});
  };
  for (std::uint64_t nth = 1;; nth += 1 + nth / 32) {
    auto encoder = encoderOf(shape, GetParam());
    ASSERT_TRUE(packet(*encoder, 0).ok());
    failing = nth;
    const auto second = packet(*encoder, 1);
    const bool failed = failing == 0;
    failing = 0;
    if (!failed) {
      EXPECT_TRUE(second.ok());
      EXPECT_GT(nth, 50u);
      break;
    }
    ASSERT_FALSE(second.ok());
    EXPECT_EQ(second.error().code, ErrorCode::kLimit);
    const auto third = packet(*encoder, 2);
    ASSERT_TRUE(third.ok());
    EXPECT_EQ(third->header.type, PacketType::kIntra);
    EXPECT_TRUE(Decoder().decode(third->data).ok());
  }
}

INSTANTIATE_TEST_SUITE_P(Profiles, Memory, testing::Values(Profile::kClassic, Profile::kMain));

TEST(Memory, AFieldTakesWhatItSays) {
  std::vector<ReferencePlane> planes;
  for (int i = 1; i < 20; ++i) planes.push_back({{i * 16 * kCell, 8 * kCell, 8 * kCell}, {0, 0, 4096}});
  ReferenceField field;
  ASSERT_TRUE(field.build(planes));
  const std::uint64_t bytes = field.bytes();  // of eight bricks around each; while it is built, their sources
  EXPECT_GT(bytes, 19u * 8 * 1400);
  EXPECT_FALSE(field.build(planes, bytes + 19u * 5000));
  EXPECT_LT(field.bytes(), 20000u);
  EXPECT_TRUE(field.build(planes, 2 * bytes));
  EXPECT_LE(field.bytes(), bytes);
}

// Of a long surface, few sources are there at once.
TEST(Memory, AFieldIsBuiltPieceByPiece) {
  std::vector<ReferencePlane> planes;
  for (int x = 0; x < 1024; ++x) {
    for (int y = 0; y < 64; ++y) planes.push_back({{x * kCell, y * kCell, 20 * kCell}, {0, 0, 4096}});
  }
  ReferenceField field;
  ASSERT_TRUE(field.build(planes));
  const std::uint64_t sources = 128u * 8 * 5600;
  EXPECT_TRUE(field.build(planes, field.bytes() + sources / 2));
}

}  // namespace
}  // namespace isoreel
