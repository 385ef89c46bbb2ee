// SPDX-License-Identifier: BSD-3-Clause
// How often a long file is read to show any of its frames.
#include <gtest/gtest.h>

#include "support.h"

namespace isoreel {
namespace {

constexpr std::uint64_t kFrames = 10'000, kGop = 20;

const Bytes& longFile() {
  static const Bytes file = [] {
    std::vector<Packet> packets = makePackets(kFrames);
    for (Packet& packet : packets) {
      packet.header.back = packet.header.number % kGop;
      packet.header.type = packet.header.back == 0 ? PacketType::kIntra : PacketType::kPredicted;
    }
    return makeFile(packets);
  }();
  return file;
}

TEST(Seek, AGopIsOneReadInAFileOfTenThousandFrames) {
  Counts counts;
  auto reader = Reader::open(std::make_unique<TestSource>(longFile(), &counts));
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  EXPECT_EQ((*reader)->frameCount(), kFrames);
  EXPECT_LE(counts.reads, 2) << "the tail, and the index that is larger";
  for (const std::uint64_t frame : {std::uint64_t{0}, std::uint64_t{19}, std::uint64_t{5'010}, kFrames - 1}) {
    counts = {};
    const auto key = keyEntry(**reader, frame);
    ASSERT_TRUE(key.ok());
    (*reader)->willRead(*key, frame + 1);
    for (std::uint64_t entry = *key; entry <= frame; ++entry) {
      const auto packet = (*reader)->entryPacket(entry);
      ASSERT_TRUE(packet.ok()) << packet.status().message();
      EXPECT_EQ(*packet, makePacket(entry, 20 + entry % 3).data);
      EXPECT_EQ((*reader)->entryBytes(entry), packet->size());
    }
    EXPECT_EQ(counts.reads, 1) << frame;
    EXPECT_LT(counts.bytes, kGop * 200) << "and nothing of what is not asked for";
  }
}

TEST(Seek, WhatIsReadTogetherIsCheckedFrameByFrame) {
  Bytes bytes = longFile();
  auto whole = Reader::open(openMemory(bytes));
  bytes[static_cast<std::size_t>((*whole)->chunkOffset(43) + 90)] ^= 1;
  Counts counts;
  auto reader = Reader::open(std::make_unique<TestSource>(std::move(bytes), &counts));
  ASSERT_TRUE(reader.ok());
  (*reader)->willRead(40, 60);
  for (std::uint64_t entry = 40; entry < 60; ++entry) {
    const auto packet = (*reader)->entryPacket(entry);
    EXPECT_EQ(packet.ok(), entry != 43);
    EXPECT_TRUE(packet.ok() || packet.error().message.find("frame 43 at byte") != std::string::npos);
  }
  // What is read again, or in another order than was announced, is there all the same.
  for (const std::uint64_t entry : {59u, 40u, 41u, 5'000u, 42u})
    EXPECT_TRUE((*reader)->entryPacket(entry).ok());
}

}  // namespace
}  // namespace isoreel
