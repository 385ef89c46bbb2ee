// SPDX-License-Identifier: BSD-3-Clause
// Packets into each carrier and back: bytes, times, keys, facts; and what is refused.
#include <isoreel/codec/player.h>

#include <numeric>

#include "support.h"

namespace isoreel::lavf {
namespace {

constexpr std::array<const char*, 4> kFaithful{"x.nut", "x.mov", "x.mp4", "x.mkv"};

using CarrierTest = LavfTest;

TEST_F(CarrierTest, KeepsPacketsTimesKeysAndFacts) {
  Sequence sequence = movingBall();
  EXPECT_EQ(sequence.packets[1].header.type, PacketType::kPredicted);
  for (const char* name : kFaithful) {
    SCOPED_TRACE(name);
    EXPECT_EQ(write(name, sequence), std::vector<std::string>());
    const auto reader = read(name);
    ASSERT_TRUE(reader);
    expectSame(*reader, sequence);
    EXPECT_EQ(reader->carrier(), *carrierOf(name));
    EXPECT_EQ(reader->info().configuration, recordOf(sequence));
    EXPECT_EQ(reader->info().time_base, TimeBase{});
    EXPECT_EQ(reader->info().damage, std::vector<std::string>());
    Player player(*reader);
    EXPECT_EQ(surfaceHash(*player.frame(6)), sequence.packets[6].header.surface_hash);
  }
}

TEST_F(CarrierTest, KeepsTimesOfAnyKind) {
  const std::vector<std::int64_t> uneven{7, 8, 500, 12345, 12346, 40000, 40001, 40002, 90000, 765432};
  std::vector<std::int64_t> late(10);
  std::iota(late.begin(), late.end(), 1000);
  for (const TimeBase base :
       {TimeBase{1, 1000000}, TimeBase{1001, 30000}, TimeBase{1, 90000}, TimeBase{3, 7}}) {
    for (const auto& times : {uneven, late}) {
      Sequence sequence = movingBall(base, times);
      for (const char* name : kFaithful) {
        SCOPED_TRACE(name + (" at " + std::to_string(base.denominator)));
        write(name, sequence, base);
        const auto reader = read(name);
        ASSERT_TRUE(reader);
        EXPECT_EQ(reader->info().time_base, base);
        expectSame(*reader, sequence);
      }
    }
  }
}

TEST_F(CarrierTest, TheSameInputGivesTheSameBytes) {
  Sequence sequence = movingBall();
  for (const char* name : {"x.nut", "x.mov", "x.mkv", "x.avi"}) {
    write(name, sequence);
    const Bytes first = content(name);
    write(name, sequence);
    EXPECT_EQ(content(name), first) << name;
  }
}

TEST_F(CarrierTest, TimesBelowNoughtStartAtNought) {
  std::vector<std::int64_t> times(10);
  std::iota(times.begin(), times.end(), -4);
  Sequence sequence = movingBall({1, 25}, times);
  for (const char* name : kFaithful) {
    const auto notes = write(name, sequence);
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_NE(notes[0].find("started at -0.16"), std::string::npos) << notes[0];
    const auto reader = read(name);
    ASSERT_TRUE(reader);
    EXPECT_EQ(reader->frameCount(), 10u) << name;
    for (std::uint64_t i = 0; i < reader->frameCount(); ++i)
      EXPECT_EQ(reader->header(i).time, static_cast<std::int64_t>(i)) << name;
  }
}

TEST_F(CarrierTest, AviKeepsAConstantRateAndNoOther) {
  Sequence sequence = movingBall();
  EXPECT_FALSE(write("x.avi", sequence).empty());
  const auto reader = read("x.avi");
  ASSERT_TRUE(reader);
  ASSERT_EQ(reader->frameCount(), 10u);
  for (std::uint64_t i = 0; i < 10; ++i) {
    EXPECT_EQ(reader->header(i).time, static_cast<std::int64_t>(i));
    EXPECT_EQ(*reader->packet(i), sequence.packets[i].data);
    EXPECT_EQ(reader->header(i).area, 0);  // not known
  }
  Sequence uneven = movingBall({1, 25}, {0, 1, 2, 4, 5, 6, 7, 8, 9, 10});
  const Status status = tryToWrite("uneven.avi", uneven);
  EXPECT_NE(status.message().find("constant rate only, and frame 2"), std::string::npos) << status.message();
  EXPECT_FALSE(std::filesystem::exists(path("uneven.avi.part")));
}

/// The sequence as it is when frames 5 to 7 are cut out of it: 4 is hidden.
Sequence cutSequence() {
  std::vector<Packet> packets = movingBall().packets;
  packets = {packets.begin() + 4, packets.begin() + 8};
  for (std::uint64_t i = 0; i < packets.size(); ++i) {
    FrameHeader& header = packets[i].header;
    header.position = i;
    header.number = i == 0 ? 0 : i - 1;
    header.flags = i == 0 ? FrameHeader::kHidden : 0;
    header.time -= 5;
  }
  return Sequence(std::move(packets));
}

TEST_F(CarrierTest, HiddenPacketsStandInFrontOfAMovsEditList) {
  Sequence sequence = cutSequence();
  for (const char* name : {"x.mov", "x.mp4"}) {
    write(name, sequence);
    const auto reader = read(name);
    ASSERT_TRUE(reader);
    EXPECT_EQ(reader->frameCount(), 3u);
    expectSame(*reader, sequence);
  }
  for (const char* name : {"x.nut", "x.mkv", "x.avi"}) {
    const Status status = tryToWrite(name, sequence);
    ASSERT_FALSE(status.ok());
    EXPECT_EQ(status.error().code, ErrorCode::kUnsupported);
    EXPECT_NE(status.message().find("hidden"), std::string::npos);
  }
  Sequence within(movingBall().packets);
  within.packets[5].header.flags = FrameHeader::kHidden;
  EXPECT_EQ(tryToWrite("within.mov", within).error().code, ErrorCode::kUnsupported);
}

TEST_F(CarrierTest, SeveralTracksEachWithItsName) {
  Sequence first = movingBall(), second = movingBall({1, 10}, {0, 2, 4, 6, 8, 10, 12, 14, 16, 40});
  for (const char* name : kFaithful) {
    SCOPED_TRACE(name);
    ASSERT_TRUE(writeCarrier(path(name), *carrierOf(name),
                             {{&first, {1, 25}, "fluid", recordOf(first)},
                              {&second, {1, 10}, "foam", recordOf(second)}})
                    .ok());
    for (const char* track : {"", "fluid", "0"}) {
      const auto reader = CarrierReader::open(*openFile(path(name)), track);
      ASSERT_TRUE(reader.ok()) << reader.status().message();
      expectSame(**reader, first);
    }
    for (const char* track : {"foam", "1"}) {
      const auto reader = CarrierReader::open(*openFile(path(name)), track);
      ASSERT_TRUE(reader.ok()) << reader.status().message();
      expectSame(**reader, second);
      EXPECT_EQ((*reader)->info().track_name, "foam");
      ASSERT_EQ((*reader)->info().tracks.size(), 2u);
      EXPECT_EQ((*reader)->info().tracks[0].frames, 10u);
    }
    EXPECT_EQ(CarrierReader::open(*openFile(path(name)), "spray").error().code, ErrorCode::kNotFound);
  }
}

TEST_F(CarrierTest, PlaysFromAPipe) {
  Sequence sequence = movingBall();
  for (const char* name : {"x.nut", "x.mov", "x.mkv"}) {
    write(name, sequence);
    const auto reader = CarrierReader::open(pipeOf(content(name)));
    ASSERT_TRUE(reader.ok()) << name << reader.status().message();
    expectSame(**reader, sequence);
  }
}

TEST_F(CarrierTest, OutputIsNotReplacedAndNotLeftHalf) {
  Sequence sequence = movingBall();
  write("x.mkv", sequence);
  EXPECT_NE(tryToWrite("x.mkv", sequence).message().find("is there already"), std::string::npos);
  int left = 4;
  CarrierSettings settings;
  settings.onPacket = [&] { return --left > 0; };
  const auto stopped = writeCarrier(path("y.mkv"), Carrier::kMatroska,
                                    {{&sequence, {1, 25}, "", recordOf(sequence)}}, settings);
  EXPECT_EQ(stopped.error().code, ErrorCode::kIo);
  EXPECT_FALSE(std::filesystem::exists(path("y.mkv")));
  EXPECT_FALSE(std::filesystem::exists(path("y.mkv.part")));
}

TEST(CarrierNames, AreTakenOrRefusedWithTheReason) {
  EXPECT_EQ(*carrierOf("a.b/x.MKV"), Carrier::kMatroska);
  EXPECT_EQ(*carrierOf("x.m4v"), Carrier::kMp4);
  for (const char* lossy : {"x.ts", "x.webm", "x.ogg", "x.flv", "x.M2TS"}) {
    ASSERT_FALSE(carrierOf(lossy).ok());
    EXPECT_EQ(carrierOf(lossy).error().code, ErrorCode::kUnsupported) << lossy;
  }
  for (const char* unknown : {"x", "x.isr", "x.t", "nut"})
    EXPECT_EQ(carrierOf(unknown).error().code, ErrorCode::kInvalidArgument) << unknown;
}

}  // namespace
}  // namespace isoreel::lavf
