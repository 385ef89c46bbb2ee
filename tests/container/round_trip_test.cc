// SPDX-License-Identifier: BSD-3-Clause
#include "support.h"

namespace isoreel {
namespace {

void expectWholeFile(Reader& reader, const std::vector<Packet>& packets) {
  ASSERT_EQ(reader.frameCount(), packets.size());
  for (std::uint64_t i = 0; i < packets.size(); ++i) {
    EXPECT_EQ(reader.header(i), packets[i].header);
    const auto data = reader.packet(i);
    ASSERT_TRUE(data.ok()) << data.status().message();
    EXPECT_EQ(*data, packets[i].data);
  }
}

void expectSettings(const FileInfo& info, const WriterSettings& settings) {
  EXPECT_EQ(info.version, 1);
  EXPECT_EQ(info.minor, 0);
  EXPECT_EQ(info.time_base, settings.time_base);
  EXPECT_EQ(info.track_name, settings.track_name);
  EXPECT_EQ(info.configuration, settings.configuration);
  EXPECT_EQ(info.tags, settings.tags);
  EXPECT_EQ(info.uuid[6] >> 4, 8);     // RFC 9562: version 8
  EXPECT_EQ(info.uuid[8] >> 6, 0b10);  // and variant
}

TEST(RoundTrip, ByIndexByScanAndByPipe) {
  for (const std::uint64_t count : {0u, 1u, 2u, 25u}) {
    const auto packets = makePackets(count);
    const auto settings = makeSettings();
    const Bytes file = makeFile(packets, settings);

    auto indexed = openBytes(file);
    ASSERT_TRUE(indexed.ok()) << indexed.status().message();
    EXPECT_TRUE((*indexed)->info().indexed);
    EXPECT_TRUE((*indexed)->info().damage.empty());
    EXPECT_EQ((*indexed)->info().bytes, file.size());
    expectSettings((*indexed)->info(), settings);
    expectWholeFile(**indexed, packets);

    const std::size_t index_offset = findChunk(file, "INDX").offset;
    auto scanned = openBytes(Bytes(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(index_offset)));
    ASSERT_TRUE(scanned.ok()) << scanned.status().message();
    EXPECT_FALSE((*scanned)->info().indexed);
    EXPECT_TRUE((*scanned)->info().damage.empty());
    expectSettings((*scanned)->info(), settings);
    expectWholeFile(**scanned, packets);
    EXPECT_EQ((*scanned)->info().uuid, (*indexed)->info().uuid);
    for (std::uint64_t i = 0; i < count; ++i) {
      EXPECT_EQ((*scanned)->chunkOffset(i), (*indexed)->chunkOffset(i));
      EXPECT_EQ((*scanned)->chunkBytes(i), (*indexed)->chunkBytes(i));
    }

    auto stream = streamBytes(file);
    ASSERT_TRUE(stream.ok()) << stream.status().message();
    expectSettings((*stream)->info(), settings);
    std::vector<Packet> played;
    const Status status = playAll(**stream, played);
    ASSERT_TRUE(status.ok()) << status.message();
    ASSERT_EQ(played.size(), count);
    for (std::uint64_t i = 0; i < count; ++i) expectSame(played[i], packets[i]);
    EXPECT_FALSE((*(*stream)->next()).has_value());  // the end stays the end
  }
}

TEST(RoundTrip, DefaultSettingsAndNoTags) {
  const Bytes file = makeFile(makePackets(1), WriterSettings{});
  for (const ChunkPlace& chunk : listChunks(file)) EXPECT_NE(chunk.type, "TAGS");
  auto reader = openBytes(file);
  ASSERT_TRUE(reader.ok());
  EXPECT_EQ((*reader)->info().tags, "{}");
  EXPECT_EQ((*reader)->info().time_base, (TimeBase{1, 25}));
}

TEST(RoundTrip, SameFramesSameBytes) {
  const auto packets = makePackets(5);
  const Bytes file = makeFile(packets);
  EXPECT_EQ(makeFile(packets), file);
  auto other = packets;
  other[0].data[0] ^= 1;
  const auto uuid = [](const Bytes& bytes) { return (*openBytes(bytes))->info().uuid; };
  EXPECT_NE(uuid(makeFile(other)), uuid(file));
  auto settings = makeSettings();
  settings.track_name = "other";
  EXPECT_NE(uuid(makeFile(packets, settings)), uuid(file));
}

TEST(RoundTrip, AFrameCostsLittleMoreThanItsPacket) {
  const auto packets = makePackets(100, 1000);
  const Bytes file = makeFile(packets);
  auto reader = openBytes(file);
  ASSERT_TRUE(reader.ok());
  for (std::uint64_t i = 0; i < packets.size(); ++i) {
    EXPECT_LE((*reader)->chunkBytes(i), packets[i].data.size() + 24 + 90);
  }
}

TEST(RoundTrip, FilesOnDisk) {
  const TemporaryFolder folder;
  const auto packets = makePackets(3);
  writeWhole(folder / "a.isr", makeFile(packets));
  auto reader = Reader::open(folder / "a.isr");
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  expectWholeFile(**reader, packets);
  const auto beyond = (*reader)->packet(3);
  EXPECT_EQ(beyond.error().code, ErrorCode::kNotFound);
  EXPECT_MESSAGE(beyond.status(), "no frame at position 3");

  const auto missing = Reader::open(folder / "none.isr");
  EXPECT_EQ(missing.error().code, ErrorCode::kNotFound);
  EXPECT_MESSAGE(missing.status(), "none.isr: cannot open");
  std::filesystem::copy_file(folder / "a.isr", folder / "b.isr.part");
  EXPECT_MESSAGE(Reader::open(folder / "b.isr").status(), "b.isr.part is there");
  EXPECT_MESSAGE(Reader::open(folder / ".").status(), "is a directory");
}

}  // namespace
}  // namespace isoreel
