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

/// GOPs of `gop` frames of a sphere that moves.
MadeSource movingSphere(std::uint64_t frames = 8, std::uint32_t gop = 4, double radius = 4.4,
                        std::uint32_t nodes = 17, const std::array<double, 3>& step = {0.2, 0, 0},
                        const MotionSettings& motion = {.block_log2 = 5, .range = 0, .registration = false}) {
  const double middle = std::floor(nodes / 2.0);
  const auto at = [=](double t) {
    return made::sphere(middle - 2 + step[0] * t, middle + step[1] * t, middle + step[2] * t, radius);
  };
  const Grid grid = made::gridOf(nodes, nodes, nodes);
  EncoderSettings settings = made::settings({"sphere", made::sampled(grid, at(0))});
  settings.frame_types = FrameTypes::kAuto;
  settings.gop = gop;
  settings.motion = motion;
  auto encoder = Encoder::create(settings);
  MadeSource source;
  for (std::uint64_t i = 0; i < frames; ++i) {
    source.packets.push_back(
        *encoder->encode(made::sampled(grid, at(static_cast<double>(i))), {40 + i, 0, 1, 0}));
    EXPECT_EQ(source.packets.back().header.type == PacketType::kIntra, i % gop == 0);
  }
  return source;
}

TEST(Player, DecodesFromTheKeyAndOnlyWhatItMust) {
  MadeSource source = movingSphere();
  Player player(source, 0);
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
  MadeSource source = movingSphere(8, 4, 4.4, 17, {0.4, 0, -0.3}, {});
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

/// Asks for every frame, last first; returns how often packets were read.
std::size_t playBackward(MadeSource& source, Player& player) {
  source.reads = 0;
  for (std::uint64_t i = source.packets.size(); i-- > 0;) {
    const auto surface = player.frame(i);
    EXPECT_TRUE(surface.ok() && surfaceHash(*surface) == source.packets[i].header.surface_hash) << i;
  }
  return source.reads;
}

TEST(Player, DecodesNothingTwiceForwardOrBackward) {
  MadeSource source = movingSphere();
  Player player(source);
  EXPECT_EQ(playBackward(source, player), 8u);
  EXPECT_EQ(playBackward(source, player), 0u) << "all fits";
  // Room for one GOP and a bit.
  Player tight(source, 5 * 28 * std::uint64_t{source.packets[0].header.vertices});
  EXPECT_EQ(playBackward(source, tight), 8u);
  Player other(source, 5 * 28 * std::uint64_t{source.packets[0].header.vertices});
  source.reads = 0;
  for (const std::uint64_t position : {0u, 1u, 2u, 1u, 2u, 3u, 4u, 5u, 4u, 3u, 4u, 5u, 6u, 7u})
    EXPECT_TRUE(other.frame(position).ok());
  EXPECT_EQ(source.reads, 8u) << "back and forth";
}

TEST(Player, RandomSeeksGiveWhatPlayingForwardGives) {
  MadeSource source = movingSphere(12, 5);
  std::vector<std::uint64_t> linear;
  Decoder decoder;
  for (const Packet& packet : source.packets) linear.push_back(surfaceHash(*decoder.decode(packet.data)));
  made::Random random(3);
  // Room for three surfaces: most seeks decode, from the key, from where the decoder is, or not at all.
  Player player(source, 3 * 32 * std::uint64_t{source.packets[0].header.vertices});
  for (int seek = 0; seek < 1000; ++seek) {
    const std::uint64_t frame = random() % source.packets.size();
    const auto surface = player.frame(frame);
    ASSERT_TRUE(surface.ok()) << surface.error().message;
    ASSERT_EQ(surfaceHash(*surface), linear[frame]) << seek;
  }
}

TEST(Player, BackwardThroughALongGopIsBoundedWork) {
  MadeSource source = movingSphere(16, 16);
  const std::uint32_t vertices = source.packets[0].header.vertices;
  const auto reads = [&](std::uint64_t bytes) {
    Player player(source, bytes);
    return playBackward(source, player);
  };
  EXPECT_EQ(reads(0), 16u * 17 / 2) << "from the key each time";
  EXPECT_EQ(reads(16 * 32 * vertices), 16u) << "all surfaces fit";
  EXPECT_EQ(reads(8 * 32 * vertices), 16u + 8u) << "half of them";
  EXPECT_EQ(reads(4 * 32 * vertices), 16u + 12u + 8u + 4u) << "a quarter, and no room for decoders";

  // Surfaces that are said to be so large that decoders are worth their room.
  MadeSource large = movingSphere(32, 32);
  for (Packet& packet : large.packets) {
    packet.header.vertices *= 100;
    packet.header.faces *= 100;
  }
  const std::uint64_t surface = std::uint64_t{2900} * vertices;
  for (const std::size_t fit : {3u, 5u, 7u}) {
    std::size_t without = 0;  // decoders: from the key for every `fit` frames
    for (std::size_t end = 32; end > 0; end -= std::min(end, fit)) without += end;
    Player player(large, fit * surface);
    EXPECT_LT(playBackward(large, player), without * 9 / 10) << fit;
  }
}

/// The frames of a source from `begin` on, as a cut gives them: those that come before are hidden.
class CutSource final : public PacketSource {
 public:
  CutSource(MadeSource& source, std::uint64_t begin, std::uint64_t key)
      : source_(source), begin_(begin), key_(key) {}
  std::uint64_t frameCount() const override { return source_.frameCount() - begin_; }
  const FrameHeader& header(std::uint64_t frame) const override { return source_.header(frame + begin_); }
  Result<Bytes> packet(std::uint64_t frame) override { return source_.packet(frame + begin_); }
  std::uint64_t entryCount() const override { return source_.frameCount() - key_; }
  std::uint64_t entryOf(std::uint64_t frame) const override { return frame + begin_ - key_; }
  const FrameHeader& entryHeader(std::uint64_t entry) const override { return source_.header(entry + key_); }
  Result<Bytes> entryPacket(std::uint64_t entry) override { return source_.packet(entry + key_); }

 private:
  MadeSource& source_;
  const std::uint64_t begin_, key_;
};

TEST(Player, DecodesHiddenFramesForThoseThatNeedThem) {
  MadeSource source = movingSphere();
  CutSource cut(source, 2, 0);
  Player player(cut, 0);
  ASSERT_EQ(player.frameCount(), 6u);
  for (const std::uint64_t frame : {0u, 5u, 1u, 3u, 0u, 1u, 2u}) {
    const auto surface = player.frame(frame);
    ASSERT_TRUE(surface.ok()) << surface.error().message;
    EXPECT_EQ(surfaceHash(*surface), source.packets[frame + 2].header.surface_hash);
  }
  source.reads = 0;
  EXPECT_TRUE(player.frame(0).ok());
  EXPECT_EQ(source.reads, 3u);
  source.unreadable = 1;
  EXPECT_FALSE(player.frame(0).ok());
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
