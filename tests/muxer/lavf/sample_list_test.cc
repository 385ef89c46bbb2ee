// SPDX-License-Identifier: BSD-3-Clause
// What foreign tools may do to a sequence: cut in front of a key, drop packets, damage them.
#include "sample_list.h"

#include "support.h"

namespace isoreel::lavf {
namespace {

Sample sampleAt(std::int64_t time, bool hidden = false) {
  Sample sample;
  sample.place = {time * 1000, time, 1};
  sample.timing.carrier = time;
  sample.hidden = hidden;
  return sample;
}

TEST(SampleList, StartsAtTheFirstKey) {
  const Sequence sequence = movingBall();
  SampleList list;
  for (std::size_t i = 2; i < 8; ++i)
    list.add(sampleAt(static_cast<std::int64_t>(i)), sequence.packets[i].data);
  list.finish({1, 25}, {});
  ASSERT_EQ(list.headers().size(), 4u);
  EXPECT_EQ(list.headers()[0].surface_hash, sequence.packets[4].header.surface_hash);
  EXPECT_EQ(list.headers()[0].number, 0u);
  EXPECT_EQ(list.headers()[3].back, 3u);
  EXPECT_EQ(list.damage().size(), 2u);
}

TEST(SampleList, FramesBehindAMissingOneDependOnIt) {
  const Sequence sequence = movingBall();
  for (const bool damaged : {false, true}) {
    SampleList list;
    for (std::size_t i = 0; i < 10; ++i) {
      Bytes packet = sequence.packets[i].data;
      if (i == 5 && damaged) packet[6] ^= 1;
      if (i == 5 && !damaged) continue;
      list.add(sampleAt(static_cast<std::int64_t>(i)), packet);
    }
    list.finish({1, 25}, {});
    EXPECT_EQ(list.damage().size(), 1u);
    Sequence left({});
    for (const FrameHeader& header : list.headers()) left.packets.push_back({header, {}});
    left = Sequence(left.packets);
    ASSERT_EQ(left.frameCount(), 9u);
    for (std::uint64_t i = 0; i < 9; ++i) {
      const bool lost = left.header(i).time == 6 || left.header(i).time == 7;
      EXPECT_EQ(keyEntry(left, i).ok(), !lost) << i;
      EXPECT_EQ(left.header(i).number, static_cast<std::uint64_t>(left.header(i).time));
    }
  }
}

TEST(SampleList, WhatIsHiddenInVainIsDropped) {
  const Sequence sequence = movingBall();
  SampleList list;
  for (std::size_t i = 0; i < 10; ++i)
    list.add(sampleAt(static_cast<std::int64_t>(i) - 6, i < 6), sequence.packets[i].data);
  list.finish({1, 25}, {});
  ASSERT_EQ(list.headers().size(), 6u);
  EXPECT_TRUE(list.headers()[1].hidden());
  EXPECT_EQ(list.headers()[0].position, 0u);
  EXPECT_EQ(list.shown().size(), 4u);
  EXPECT_EQ(list.headers()[2].time, 0);
}

}  // namespace
}  // namespace isoreel::lavf
