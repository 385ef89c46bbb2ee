// SPDX-License-Identifier: BSD-3-Clause
// Cut and damaged files: no crash, and no packet that was not written.
#include <algorithm>
#include <random>

#include "support.h"

namespace isoreel::lavf {
namespace {

using CarrierDamage = LavfTest;

/// Reads all that is left; counts frames that are whole and right.
std::uint64_t readAll(Bytes bytes, const Sequence& sequence) {
  const auto reader = CarrierReader::open(openMemory(std::move(bytes)));
  if (!reader.ok()) {
    EXPECT_FALSE(reader.error().message.empty());
    return 0;
  }
  std::uint64_t right = 0;
  for (std::uint64_t i = 0; i < (*reader)->frameCount(); ++i) {
    const auto packet = (*reader)->packet(i);
    if (!packet.ok()) continue;
    right += std::any_of(sequence.packets.begin(), sequence.packets.end(),
                         [&](const Packet& p) { return p.data == *packet; })
                 ? 1u
                 : 0u;
  }
  return right;
}

TEST_F(CarrierDamage, CutAnywhereKeepsWhatIsInFront) {
  Sequence sequence = movingBall();
  for (const char* name : {"x.nut", "x.mkv", "x.mov", "x.avi"}) {
    write(name, sequence);
    const Bytes whole = content(name);
    EXPECT_EQ(readAll(whole, sequence), 10u);
    std::uint64_t before = 0;
    for (std::size_t size = 0; size < whole.size(); size += 29) {
      const std::uint64_t now =
          readAll({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)}, sequence);
      EXPECT_GE(now + 1, before) << name << " " << size;
      before = std::max(before, now);
    }
    EXPECT_GE(before, 8u) << name;
  }
}

TEST_F(CarrierDamage, FlippedBytesDoNoHarm) {
  Sequence sequence = movingBall();
  std::mt19937 random(6);
  for (const char* name : {"x.nut", "x.mkv", "x.mov", "x.avi"}) {
    write(name, sequence);
    const Bytes whole = content(name);
    for (int trial = 0; trial < 150; ++trial) {
      Bytes damaged = whole;
      damaged[random() % damaged.size()] ^= static_cast<std::uint8_t>(1 + random() % 255);
      readAll(std::move(damaged), sequence);
    }
  }
}

TEST_F(CarrierDamage, WhatIsNoneOfThemIsNamed) {
  const auto text = CarrierReader::open(openMemory(Bytes(5000, 'x'), "note.txt"));
  EXPECT_EQ(text.error().code, ErrorCode::kUnsupported);
  EXPECT_EQ(text.error().message.rfind("note.txt: ", 0), 0u);
  EXPECT_EQ(CarrierReader::open(openMemory({})).error().code, ErrorCode::kUnsupported);
  EXPECT_FALSE(sniff(openMemory(Bytes(10, 0)))->carrier);
}

}  // namespace
}  // namespace isoreel::lavf
