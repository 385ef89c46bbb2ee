// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/codec/player.h>

#include <gtest/gtest.h>

#include <cmath>

#include "made.h"

namespace isoreel {
namespace {

/// Packets in memory; one may be unreadable.
class MadeSource : public PacketSource {
 public:
  std::vector<Packet> packets;
  std::uint64_t unreadable = ~std::uint64_t{0};
  std::size_t reads = 0;

  std::uint64_t frameCount() const override { return packets.size(); }
  const FrameHeader& header(std::uint64_t position) const override { return packets[position].header; }
  Result<Bytes> packet(std::uint64_t position) override {
    ++reads;
    if (position == unreadable) return {ErrorCode::kIo, "frame 42: the disk is gone"};
    return packets[position].data;
  }
};

MadeSource growingSpheres() {
  MadeSource source;
  for (std::uint64_t i = 0; i < 5; ++i) {
    const made::Made m{"sphere", made::sampled(made::gridOf(17, 17, 17),
                                               made::sphere(8, 8, 8, 2.3 + static_cast<double>(i)))};
    auto encoder = Encoder::create(made::settings(m));
    FrameTiming timing;
    timing.number = 40 + i;
    source.packets.push_back(*encoder->encode(m.volume, timing));
  }
  return source;
}

TEST(Player, GivesAnyFrameInAnyOrder) {
  MadeSource source = growingSpheres();
  Player player(source);
  EXPECT_EQ(player.frameCount(), 5u);
  for (const std::uint64_t position : {4u, 0u, 2u, 2u, 3u, 1u, 4u}) {
    const auto surface = player.frame(position);
    ASSERT_TRUE(surface.ok());
    EXPECT_EQ(surfaceHash(*surface), source.packets[position].header.surface_hash);
  }
  DecodeOptions coarse;
  coarse.level = 2;
  const auto surface = player.frame(4, coarse);
  ASSERT_TRUE(surface.ok());
  EXPECT_LT(surface->vertices.size(), source.packets[4].header.vertices);
}

/// Two GOPs of four frames.
MadeSource movingSphere() {
  const auto at = [](double t) { return made::sphere(6 + 0.4 * t, 8, 8 - 0.3 * t, 4.4); };
  const Grid grid = made::gridOf(17, 17, 17);
  EncoderSettings settings = made::settings({"sphere", made::sampled(grid, at(0))});
  settings.frame_types = FrameTypes::kAuto;
  settings.gop = 4;
  auto encoder = Encoder::create(settings);
  MadeSource source;
  for (std::uint64_t i = 0; i < 8; ++i) {
    source.packets.push_back(
        *encoder->encode(made::sampled(grid, at(static_cast<double>(i))), {40 + i, 0, 1, 0}));
    EXPECT_EQ(source.packets.back().header.type == PacketType::kIntra, i % 4 == 0);
  }
  return source;
}

TEST(Player, DecodesFromTheKeyAndOnlyWhatItMust) {
  MadeSource source = movingSphere();
  Player player(source);
  for (const auto& [position, reads] : std::vector<std::pair<std::uint64_t, std::size_t>>{
           {2, 3}, {3, 1}, {4, 1}, {7, 3}, {5, 2}, {6, 1}, {1, 2}, {1, 2}, {0, 1}}) {
    source.reads = 0;
    const auto surface = player.frame(position);
    ASSERT_TRUE(surface.ok()) << surface.error().message;
    EXPECT_EQ(surfaceHash(*surface), source.packets[position].header.surface_hash);
    EXPECT_EQ(source.reads, reads) << position;
  }
  source.reads = 0;
  DecodeOptions coarse;
  coarse.level = 3;
  for (std::uint64_t i = 0; i < 8; ++i) EXPECT_TRUE(player.frame(i, coarse).ok());
  EXPECT_EQ(source.reads, 8u) << "forward at a coarser level, each frame once";
}

TEST(Player, TellsTheMotionOfPredictedFrames) {
  MadeSource source = movingSphere();
  Player player(source);
  std::vector<MotionBlock> blocks(7);
  DecodeOptions options;
  options.motion = &blocks;
  ASSERT_TRUE(player.frame(0, options).ok());
  EXPECT_TRUE(blocks.empty()) << "an I frame";
  for (const std::uint64_t position : {2u, 7u, 5u}) {
    const auto surface = player.frame(position, options);
    ASSERT_TRUE(surface.ok());
    std::uint32_t next = 0;
    std::array<double, 3> sum{};
    double predicted = 0;
    for (const MotionBlock& block : blocks) {
      ASSERT_EQ(block.first, next);
      ASSERT_EQ(block.side, 8);
      ASSERT_GE(block.vertices, 1u);
      ASSERT_LE(block.predicted, block.moves ? block.vertices : 0);
      next += block.vertices;
      predicted += block.predicted;
      for (std::size_t k = 0; k < 3; ++k) {
        ASSERT_EQ(block.cell[k] % 8, 0);
        for (std::uint32_t i = block.first; i < next; ++i) {
          ASSERT_GE(surface->vertices[i][k], block.cell[k] * kCell);
          ASSERT_LE(surface->vertices[i][k], (block.cell[k] + 8) * kCell);
        }
        sum[k] += double(block.vector[k]) / kCell * block.vertices;
      }
    }
    EXPECT_EQ(next, surface->vertices.size());
    EXPECT_GT(predicted, 0.95 * next);
    // To where the surface was.
    // To where the surface was, drawn to no motion a little since vectors cost bits.
    EXPECT_NEAR(sum[0] / next, -0.4, 0.16);
    EXPECT_NEAR(sum[1] / next, 0, 0.1);
    EXPECT_NEAR(sum[2] / next, 0.3, 0.16);
    EXPECT_GT((-0.4 * sum[0] + 0.3 * sum[2]) / 0.5, 0.92 * std::hypot(sum[0], sum[1], sum[2]));
  }
  const auto whole = blocks;
  options.level = 2;
  ASSERT_TRUE(player.frame(5, options).ok());
  ASSERT_EQ(blocks.size(), whole.size()) << "at any level, the full surface's";
  EXPECT_EQ(blocks.back().vector, whole.back().vector);
}

TEST(Player, ErrorsNameTheFrame) {
  MadeSource source = growingSpheres();
  source.packets[3].data.back() ^= 1;
  source.unreadable = 2;
  Player player(source);
  const auto damaged = player.frame(3), unreadable = player.frame(2), none = player.frame(5);
  ASSERT_FALSE(damaged.ok());
  EXPECT_EQ(damaged.error().message.rfind("frame 43: ", 0), 0u) << damaged.error().message;
  ASSERT_FALSE(unreadable.ok());
  EXPECT_EQ(unreadable.error().code, ErrorCode::kIo);
  EXPECT_NE(unreadable.error().message.find("frame 42"), std::string::npos);
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().code, ErrorCode::kNotFound);
  EXPECT_NE(none.error().message.find("the sequence has 5"), std::string::npos);
  EXPECT_TRUE(player.frame(4).ok()) << "a player goes on after an error";
}

}  // namespace
}  // namespace isoreel
