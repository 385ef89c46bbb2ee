// SPDX-License-Identifier: BSD-3-Clause
// Several tracks, hidden frames, chapters, attachments, and files that are continued.
#include "support.h"

namespace isoreel {
namespace {

std::unique_ptr<Writer> writerTo(Bytes& file, WriterSettings settings = makeSettings()) {
  auto writer = Writer::create(openMemorySink(file), std::move(settings));
  EXPECT_TRUE(writer.ok()) << writer.status().message();
  return *std::move(writer);
}

Packet predicted(Packet packet, std::uint64_t back) {
  packet.header.type = back == 0 ? PacketType::kIntra : PacketType::kPredicted;
  packet.header.back = back;
  return packet;
}
std::vector<Packet> positioned(std::vector<Packet> packets) {
  for (std::uint64_t i = 0; i < packets.size(); ++i) packets[i].header.position = i;
  return packets;
}
Packet hidden(Packet packet) {
  packet.header.flags = FrameHeader::kHidden;
  return packet;
}

/// The same file by index, by scan and forward. `check(source, info)` for the first two; `played` for the
/// last.
template <class Check>
void eachWay(const Bytes& file, const std::string& track, Check check, std::vector<Packet>& played) {
  for (const bool indexed : {true, false}) {
    Bytes bytes = file;
    if (!indexed) bytes.resize(findChunk(file, "INDX").offset);
    auto reader = Reader::open(std::make_unique<TestSource>(bytes), track);
    ASSERT_TRUE(reader.ok()) << reader.status().message();
    EXPECT_EQ((*reader)->info().indexed, indexed);
    EXPECT_TRUE((*reader)->info().damage.empty());
    check(**reader);
  }
  auto stream = StreamReader::open(std::make_unique<TestSource>(file, nullptr, true), track);
  ASSERT_TRUE(stream.ok()) << stream.status().message();
  const Status status = playAll(**stream, played);
  EXPECT_TRUE(status.ok()) << status.message();
}

TEST(Tracks, AreWrittenSideBySideAndOpenedByNameOrId) {
  Bytes file;
  auto writer = writerTo(file);
  const auto second = writer->addTrack({{1, 1000}, "bone", {7, 7}});
  ASSERT_TRUE(second.ok());
  EXPECT_EQ(*second, 1u);
  EXPECT_MESSAGE(writer->addTrack({{1, 25}, "bone", {}}).status(), "two tracks of the name 'bone'");
  const auto packets = makePackets(4), others = makePackets(7, 50);
  for (std::uint64_t i = 0; i < 7; ++i) {
    if (i < 4) {
      ASSERT_TRUE(writer->write(packets[i]).ok());
    }
    ASSERT_TRUE(writer->write(others[i], 1).ok());
  }
  EXPECT_FALSE(writer->write(packets[0], 2).ok());
  ASSERT_TRUE(writer->finish().ok());

  for (const std::string track : {"", "fluid", "0", "bone", "1"}) {
    const bool first = track != "bone" && track != "1";
    const auto& expected = first ? packets : others;
    std::vector<Packet> played;
    eachWay(
        file, track,
        [&](Reader& reader) {
          ASSERT_EQ(reader.frameCount(), expected.size());
          for (std::uint64_t i = 0; i < expected.size(); ++i)
            expectSame({reader.header(i), *reader.packet(i)}, expected[i]);
          const FileInfo& info = reader.info();
          ASSERT_EQ(info.tracks.size(), 2u);
          EXPECT_EQ(info.tracks[0].frames, 4u);
          EXPECT_EQ(info.tracks[1].frames, 7u);
          EXPECT_EQ(info.track_name, first ? "fluid" : "bone");
          EXPECT_EQ(info.time_base.denominator, first ? 24u : 1000u);
        },
        played);
    ASSERT_EQ(played.size(), expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i) expectSame(played[i], expected[i]);
  }
  EXPECT_EQ(Reader::open(openMemory(file), "none").error().code, ErrorCode::kNotFound);
  EXPECT_EQ(StreamReader::open(openMemory(file), "none").error().code, ErrorCode::kNotFound);
}

TEST(Hidden, FramesAreThereForThoseThatNeedThem) {
  // A cut inside a GOP: I and P are hidden, then P P; a GOP of its own; another cut.
  const std::vector<Packet> packets = positioned(
      {hidden(predicted(makePacket(0, 9), 0)), hidden(predicted(makePacket(0, 8), 1)),
       predicted(makePacket(0, 7), 2), predicted(makePacket(1, 6), 3), predicted(makePacket(2, 5), 0),
       hidden(predicted(makePacket(3, 9), 0)), predicted(makePacket(3, 8), 1)});
  Bytes file;
  auto writer = writerTo(file);
  for (const Packet& packet : packets) {
    const Status status = writer->write(packet);
    ASSERT_TRUE(status.ok()) << status.message();
  }
  EXPECT_EQ(writer->info().tracks[0].frames, 4u);
  ASSERT_TRUE(writer->finish().ok());
  std::vector<Packet> played;
  eachWay(
      file, "",
      [&](Reader& reader) {
        ASSERT_EQ(reader.frameCount(), 4u);
        ASSERT_EQ(reader.entryCount(), packets.size());
        for (std::uint64_t i = 0; i < packets.size(); ++i)
          expectSame({reader.entryHeader(i), *reader.entryPacket(i)}, packets[i]);
        const std::uint64_t entries[] = {2, 3, 4, 6}, keys[] = {0, 0, 4, 5};
        for (std::uint64_t i = 0; i < 4; ++i) {
          EXPECT_EQ(reader.header(i).number, i);
          EXPECT_EQ(reader.entryOf(i), entries[i]);
          EXPECT_EQ(*keyEntry(reader, i), keys[i]);
        }
      },
      played);
  ASSERT_EQ(played.size(), packets.size());
  for (std::size_t i = 0; i < packets.size(); ++i) expectSame(played[i], packets[i]);

  // Each hole in it takes the frames that depend on what is lost, and no others.
  const auto chunks = listChunks(file);
  for (std::size_t lost = 0; lost < packets.size(); ++lost) {
    Bytes bad(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(findChunk(file, "INDX").offset));
    std::size_t frame = 0;
    for (const ChunkPlace& chunk : chunks) {
      if (chunk.type == "FRAM" && frame++ == lost) bad[chunk.offset + 40] ^= 1;
    }
    auto reader = openBytes(bad);
    ASSERT_TRUE(reader.ok());
    for (std::uint64_t i = 0; i < (*reader)->frameCount(); ++i) {
      const std::uint64_t number = (*reader)->header(i).number;
      const std::size_t entry[] = {2, 3, 4, 6}, key[] = {0, 0, 4, 5};
      const bool whole = lost < key[number] || lost > entry[number];
      EXPECT_EQ(keyEntry(**reader, i).ok(), whole) << lost << " " << number;
    }
  }
}

TEST(Hidden, FramesMustBeNeeded) {
  Bytes file;
  auto writer = writerTo(file);
  ASSERT_TRUE(writer->write(hidden(makePacket(0, 5))).ok());
  EXPECT_MESSAGE(writer->write(makePacket(0, 5)), "not of its GOP");
  EXPECT_MESSAGE(writer->write(predicted(makePacket(1, 5), 1)), "frame number 1 where 0 is due");
  EXPECT_TRUE(writer->write(predicted(makePacket(0, 5), 1)).ok());
}

std::vector<Chapter> someChapters() {
  return {{Chapter::Kind::kChapter, -5, 0, "Falling"},
          {Chapter::Kind::kMarker, 3, 0, "Aufprall – hier"},
          {Chapter::Kind::kChapter, 4, 100, ""}};
}

Bytes drained(ByteSource& source) {
  Bytes bytes(static_cast<std::size_t>(*source.size()) + 1);
  const auto got = source.read(0, bytes);
  EXPECT_TRUE(got.ok()) << got.status().message();
  bytes.resize(got.ok() ? *got : 0);
  return bytes;
}

Bytes noise(std::size_t bytes) {
  std::mt19937 random(static_cast<unsigned>(bytes));
  Bytes out(bytes);
  for (auto& b : out) b = static_cast<std::uint8_t>(random());
  return out;
}

TEST(Metadata, ChaptersAndAttachmentsComeBackEachWay) {
  Bytes file;
  auto writer = writerTo(file);
  ASSERT_TRUE(writer->setChapters(someChapters()).ok());
  const auto packets = makePackets(3);
  ASSERT_TRUE(writer->write(packets[0]).ok());
  // Sizes around that of a part.
  const std::vector<std::size_t> sizes = {0, 1, (1 << 20) - 1, 1 << 20, (1 << 20) + 1, (2 << 20) + 5};
  for (const std::size_t size : sizes) {
    const auto source = openMemory(noise(size));
    const Status status = writer->attach("n" + std::to_string(size), "x/y", *source);
    ASSERT_TRUE(status.ok()) << status.message();
  }
  const auto old = openMemory(noise(77)), newer = openMemory(noise(78));
  ASSERT_TRUE(writer->attach("n1", "", *newer).ok());  // replaces it
  ASSERT_TRUE(writer->attach("gone", "", *old).ok());
  ASSERT_TRUE(writer->removeAttachment("gone").ok());
  EXPECT_EQ(writer->removeAttachment("gone").error().code, ErrorCode::kNotFound);
  for (const char* name : {"", "a/b", "..", "a\nb", "a\\b"})
    EXPECT_FALSE(writer->attach(name, "", *old).ok()) << name;
  ASSERT_TRUE(writer->write(packets[1]).ok());
  ASSERT_TRUE(writer->write(packets[2]).ok());
  ASSERT_TRUE(writer->finish().ok());

  std::vector<Packet> played;
  eachWay(
      file, "",
      [&](Reader& reader) {
        EXPECT_EQ(reader.frameCount(), 3u);
        EXPECT_EQ(reader.info().chapters, someChapters());
        ASSERT_EQ(reader.info().attachments.size(), sizes.size());
        for (const std::size_t size : sizes) {
          auto source = reader.openAttachment("n" + std::to_string(size));
          ASSERT_TRUE(source.ok()) << source.status().message();
          const Bytes content = drained(**source);
          EXPECT_EQ(content, noise(size == 1 ? 78 : size));
        }
        EXPECT_EQ(reader.openAttachment("gone").error().code, ErrorCode::kNotFound);
      },
      played);
  EXPECT_EQ(played.size(), 3u);
  auto stream = streamBytes(file);
  EXPECT_EQ((*stream)->info().chapters, someChapters());
  ASSERT_TRUE(playAll(**stream, played).ok());
  EXPECT_EQ((*stream)->info().attachments, (*openBytes(file))->info().attachments);
}

TEST(Metadata, ADamagedAttachmentIsNotGivenOut) {
  Bytes file;
  auto writer = writerTo(file);
  ASSERT_TRUE(writer->write(makePacket(0, 5)).ok());
  const auto source = openMemory(noise((2 << 20) + 5));
  ASSERT_TRUE(writer->attach("a", "", *source).ok());
  ASSERT_TRUE(writer->finish().ok());
  std::size_t parts = 0;
  for (const ChunkPlace& chunk : listChunks(file)) {
    if (chunk.type != "ATCH") continue;
    ++parts;
    Bytes bad = file;
    bad[chunk.offset + 30] ^= 1;
    auto reader = openBytes(bad);
    auto content = (*reader)->openAttachment("a");
    ASSERT_TRUE(content.ok());
    Bytes bytes(3 << 20);
    const auto got = (*content)->read(0, bytes);
    ASSERT_FALSE(got.ok());
    EXPECT_MESSAGE(got.status(),
                   "attachment 'a': byte " + std::to_string(chunk.offset) + ": payload CRC does not match");
    bad.pop_back();
    reader = openBytes(bad);
    ASSERT_TRUE(reader.ok());
    EXPECT_EQ((*reader)->openAttachment("a").error().code, ErrorCode::kNotFound);
  }
  EXPECT_EQ(parts, 3u);
}

class Append : public ::testing::Test {
 protected:
  void SetUp() override {
    packets_ = makePackets(6);
    old_ = makeFile({packets_.begin(), packets_.begin() + 3});
    writeWhole(path(), old_);
  }
  std::filesystem::path path() const { return folder_ / "a.isr"; }
  void expectFrames(std::uint64_t count) {
    auto reader = Reader::open(path());
    ASSERT_TRUE(reader.ok()) << reader.status().message();
    ASSERT_EQ((*reader)->frameCount(), count);
    for (std::uint64_t i = 0; i < count; ++i)
      expectSame({(*reader)->header(i), *(*reader)->packet(i)}, packets_[i]);
  }
  const TemporaryFolder folder_;
  std::vector<Packet> packets_;
  Bytes old_;
};

TEST_F(Append, GoesOnWhereTheFileEnded) {
  auto writer = Writer::append(path());
  ASSERT_TRUE(writer.ok()) << writer.status().message();
  EXPECT_EQ((*writer)->lastFrame()->number, 2u);
  EXPECT_MESSAGE(Writer::append(path()).status(), "another writer is at work");
  ASSERT_TRUE((*writer)->write(packets_[3]).ok());
  expectFrames(4);  // while it is written, all is there
  ASSERT_TRUE((*writer)->write(packets_[4]).ok());
  ASSERT_TRUE((*writer)->setTags(R"({"a":1})").ok());
  ASSERT_TRUE((*writer)->setChapters(someChapters()).ok());
  ASSERT_TRUE((*writer)->finish().ok());
  expectFrames(5);
  const Bytes grown = readWhole(path());
  EXPECT_TRUE(std::equal(old_.begin(), old_.end(), grown.begin())) << "nothing is written over";
  auto reader = Reader::open(path());
  EXPECT_TRUE((*reader)->info().indexed);
  EXPECT_EQ((*reader)->info().tags, R"({"a":1})");
  EXPECT_EQ((*reader)->info().chapters, someChapters());
  EXPECT_EQ((*reader)->info().uuid, (*openBytes(old_))->info().uuid);
  auto stream = streamBytes(grown);
  std::vector<Packet> played;
  EXPECT_TRUE(playAll(**stream, played).ok());
  EXPECT_EQ(played.size(), 5u);
}

TEST_F(Append, CutAnywhereLosesNothingOldAndCanBeContinued) {
  auto writer = Writer::append(path());
  ASSERT_TRUE((*writer)->write(packets_[3]).ok());
  ASSERT_TRUE((*writer)->write(packets_[4]).ok());
  ASSERT_TRUE((*writer)->finish().ok());
  writer->reset();
  const Bytes grown = readWhole(path());
  for (std::size_t size = old_.size(); size < grown.size(); ++size) {
    writeWhole(path(), Bytes(grown.begin(), grown.begin() + static_cast<std::ptrdiff_t>(size)));
    std::uint64_t frames = 0;
    {
      auto reader = Reader::open(path());
      ASSERT_TRUE(reader.ok());
      frames = (*reader)->frameCount();
      ASSERT_GE(frames, 3u);
      expectFrames(frames);
    }
    if (size % 31 != 0) continue;
    auto again = Writer::append(path());
    ASSERT_TRUE(again.ok()) << size << again.status().message();
    for (std::uint64_t i = frames; i < 6; ++i) ASSERT_TRUE((*again)->write(packets_[i]).ok());
    ASSERT_TRUE((*again)->finish().ok());
    expectFrames(6);
    std::vector<Packet> played;
    auto stream = streamBytes(readWhole(path()));
    EXPECT_TRUE(playAll(**stream, played).ok()) << size;
  }
}

TEST_F(Append, TakenBackLeavesTheOldFile) {
  auto writer = Writer::append(path());
  ASSERT_TRUE((*writer)->write(packets_[3]).ok());
  EXPECT_MESSAGE((*writer)->write(packets_[3]), "frame number 3 where 4 is due");
  (*writer)->discard();
  EXPECT_EQ(readWhole(path()), old_);
}

TEST_F(Append, DamagedFilesAreNotContinued) {
  for (const std::size_t byte :
       {std::size_t{20}, findChunk(old_, "TRAK").offset + 22, findChunk(old_, "FRAM").offset + 50}) {
    Bytes bad = old_;
    bad[byte] ^= 1;
    bad.pop_back();
    writeWhole(path(), bad);
    EXPECT_MESSAGE(Writer::append(path()).status(), "is damaged");
    EXPECT_EQ(readWhole(path()), bad);
  }
  EXPECT_EQ(Writer::append(folder_ / "none").error().code, ErrorCode::kIo);
}

}  // namespace
}  // namespace isoreel
