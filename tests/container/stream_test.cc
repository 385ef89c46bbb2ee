// SPDX-License-Identifier: BSD-3-Clause
#include <fcntl.h>
#include <sys/stat.h>

#include <thread>

#include "support.h"

namespace isoreel {
namespace {

TEST(Stream, ThroughARealPipe) {
  const TemporaryFolder folder;
  const auto path = folder / "pipe";
  ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
  const auto packets = makePackets(5, 300000);  // more than a pipe holds
  const Bytes file = makeFile(packets);
  std::thread writer([&] { writeWhole(path, file); });
  auto source = openFile(path);
  ASSERT_TRUE(source.ok()) << source.status().message();
  EXPECT_FALSE((*source)->seekable());
  auto stream = StreamReader::open(std::move(*source));
  std::vector<Packet> played;
  const Status status = stream.ok() ? playAll(**stream, played) : stream.status();
  writer.join();
  ASSERT_TRUE(status.ok()) << status.message();
  ASSERT_EQ(played.size(), packets.size());
  for (std::size_t i = 0; i < packets.size(); ++i) expectSame(played[i], packets[i]);
  EXPECT_EQ((*stream)->info().tags, makeSettings().tags);
}

TEST(Stream, GivesAFrameAsSoonAsItsBytesAreThere) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  const auto packets = makePackets(2);
  const Bytes file = makeFile(packets);
  const ChunkPlace first = findChunk(file, "FRAM");
  const std::size_t sent = first.offset + first.bytes;
  ASSERT_EQ(write(ends[1], file.data(), sent), static_cast<ssize_t>(sent));
  // The writing end stays open: a reader that wants more than the first frame would wait for ever.
  auto source = openFile("/dev/fd/" + std::to_string(ends[0]));
  ASSERT_TRUE(source.ok()) << source.status().message();
  auto stream = StreamReader::open(std::move(*source));
  ASSERT_TRUE(stream.ok()) << stream.status().message();
  const auto packet = (*stream)->next();
  ASSERT_TRUE(packet.ok() && packet->has_value());
  expectSame(**packet, packets[0]);
  close(ends[1]);
  close(ends[0]);
  EXPECT_MESSAGE((*stream)->next().status(), "(after frame 0): the file ends without a footer");
}

TEST(Stream, RandomAccessRefusesPipes) {
  const auto reader = Reader::open(std::make_unique<TestSource>(makeFile(makePackets(1)), nullptr, true));
  ASSERT_FALSE(reader.ok());
  EXPECT_EQ(reader.error().code, ErrorCode::kInvalidArgument);
  EXPECT_MESSAGE(reader.status(), "StreamReader");
}

TEST(Stream, BytesBehindTheFooterAreAnError) {
  Bytes file = makeFile(makePackets(1));
  file.push_back(0);
  auto stream = streamBytes(file);
  ASSERT_TRUE(stream.ok());
  std::vector<Packet> played;
  EXPECT_FALSE(playAll(**stream, played).ok());
  EXPECT_EQ(played.size(), 1u);
}

TEST(Stream, ADroppedFrameIsNoticed) {
  const Bytes file = makeFile(makePackets(3));
  const ChunkPlace first = findChunk(file, "FRAM");
  Bytes dropped = file;
  dropped.erase(dropped.begin() + static_cast<std::ptrdiff_t>(first.offset),
                dropped.begin() + static_cast<std::ptrdiff_t>(first.offset + first.bytes));
  auto stream = streamBytes(dropped);
  ASSERT_TRUE(stream.ok());
  EXPECT_MESSAGE((*stream)->next().status(), "frame number 1 where 0 is due (spec container 4.3)");
}

}  // namespace
}  // namespace isoreel
