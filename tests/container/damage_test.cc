// SPDX-License-Identifier: BSD-3-Clause
// Cut and damaged files: every whole frame is there, no wrong one ever is.
#include "src/signature.h"
#include "support.h"

namespace isoreel {
namespace {

Bytes cutAt(const Bytes& file, std::size_t size) {
  Bytes cut = file;
  cut.resize(size);
  return cut;
}

TEST(Damage, CutAtEveryByteKeepsAllWholeFrames) {
  const auto packets = makePackets(4);
  const Bytes file = makeFile(packets);
  std::vector<std::size_t> ends;
  for (const ChunkPlace& chunk : listChunks(file)) {
    if (chunk.type == "FRAM") ends.push_back(chunk.offset + chunk.bytes);
  }
  ASSERT_EQ(ends.size(), packets.size());
  const ChunkPlace track = findChunk(file, "TRAK");
  for (std::size_t size = 0; size < file.size(); ++size) {
    const std::size_t whole = static_cast<std::size_t>(
        std::count_if(ends.begin(), ends.end(), [&](std::size_t end) { return end <= size; }));
    auto reader = openBytes(cutAt(file, size));
    ASSERT_EQ(reader.ok(), size >= track.offset + track.bytes) << size;
    if (reader.ok()) {
      EXPECT_FALSE((*reader)->info().indexed);
      ASSERT_EQ((*reader)->frameCount(), whole) << size;
      for (std::size_t i = 0; i < whole; ++i) {
        const auto data = (*reader)->packet(i);
        ASSERT_TRUE(data.ok());
        expectSame({(*reader)->header(i), *data}, packets[i]);
      }
    } else {
      EXPECT_EQ(reader.error().code, ErrorCode::kTruncated) << size;
    }
    auto stream = streamBytes(cutAt(file, size));
    if (!stream.ok()) continue;
    std::vector<Packet> played;
    const Status status = playAll(**stream, played);
    ASSERT_FALSE(status.ok()) << size;
    EXPECT_EQ(status.error().code, ErrorCode::kTruncated) << status.message();
    EXPECT_EQ(played.size(), whole) << size;
    EXPECT_EQ((*stream)->next().status().message(), status.message());
  }
}

TEST(Damage, NoFlippedBitGivesAWrongFrame) {
  const auto packets = makePackets(3);
  const Bytes file = makeFile(packets);
  const auto settings = makeSettings();
  int unnoticed = 0;
  for (std::size_t bit = 0; bit < file.size() * 8; ++bit) {
    Bytes flipped = file;
    flipped[bit / 8] = static_cast<std::uint8_t>(flipped[bit / 8] ^ (1 << (bit % 8)));
    auto reader = openBytes(flipped);
    if (reader.ok()) {
      for (std::uint64_t i = 0; i < (*reader)->frameCount(); ++i) {
        const FrameHeader& header = (*reader)->header(i);
        ASSERT_LT(header.number, packets.size());
        ASSERT_EQ(header, packets[header.number].header) << bit;
        const auto data = (*reader)->packet(i);
        if (data.ok()) {
          ASSERT_EQ(*data, packets[header.number].data) << bit;
        }
      }
      // One chunk at most is lost, and what is said of the file is right or said to be lost.
      EXPECT_GE((*reader)->frameCount() + (*reader)->info().damage.size(), packets.size()) << bit;
      if ((*reader)->info().damage.empty()) {
        EXPECT_EQ((*reader)->info().tags, settings.tags);
      }
    }
    // Playing forward checks every byte.
    auto stream = streamBytes(flipped);
    std::vector<Packet> played;
    if (stream.ok() && playAll(**stream, played).ok()) ++unnoticed;
    for (std::size_t i = 0; i < played.size(); ++i) expectSame(played[i], packets[i]);
  }
  EXPECT_EQ(unnoticed, 0);
}

TEST(Damage, AByteLostOrAddedAnywhereLosesOneFrameAtMost) {
  const auto packets = makePackets(3, 40);
  const Bytes file = makeFile(packets);
  const std::size_t first = container::Signature::kBytes;
  for (std::size_t place = first; place < file.size(); ++place) {
    for (const bool added : {false, true}) {
      Bytes changed = cutAt(file, place);
      if (added) changed.push_back(0x55);
      changed.insert(changed.end(), file.begin() + static_cast<std::ptrdiff_t>(place) + (added ? 0 : 1),
                     file.end());
      auto reader = openBytes(changed);
      ASSERT_TRUE(reader.ok()) << place << reader.status().message();
      EXPECT_GE((*reader)->frameCount() + 1, packets.size()) << place;
      for (std::uint64_t i = 0; i < (*reader)->frameCount(); ++i) {
        const auto data = (*reader)->packet(i);
        ASSERT_TRUE(data.ok());
        expectSame({(*reader)->header(i), *data}, packets[(*reader)->header(i).number]);
      }
    }
  }
}

TEST(Damage, MessagesNameFrameByteAndRule) {
  const auto packets = makePackets(20);
  Bytes file = makeFile(packets);
  auto whole = openBytes(file);
  ASSERT_TRUE(whole.ok());
  const std::uint64_t offset = (*whole)->chunkOffset(17);
  file[static_cast<std::size_t>(offset) + 50] ^= 4;
  const std::string expected = "x.isr: frame 17 at byte " + std::to_string(offset) +
                               ": payload CRC does not match (spec container 3.1)";

  auto reader = openBytes(file);
  ASSERT_TRUE(reader.ok());
  EXPECT_TRUE((*reader)->packet(16).ok());
  EXPECT_EQ((*reader)->packet(17).status().message(), expected);
  EXPECT_TRUE((*reader)->packet(18).ok());

  auto stream = streamBytes(file);
  ASSERT_TRUE(stream.ok());
  std::vector<Packet> played;
  EXPECT_EQ(playAll(**stream, played).message(), expected);
  EXPECT_EQ(played.size(), 17u);

  file.pop_back();  // no footer: by scan the frame is left out, and that is said
  auto scanned = openBytes(file);
  ASSERT_TRUE(scanned.ok());
  EXPECT_EQ((*scanned)->frameCount(), 19u);
  ASSERT_FALSE((*scanned)->info().damage.empty());
  EXPECT_EQ((*scanned)->info().damage.front(),
            "byte " + std::to_string(offset) + ", " + std::to_string((*whole)->chunkBytes(17)) +
                " bytes left out: FRAM: payload CRC does not match (spec container 3.1)");
}

TEST(Damage, FramesOutliveTheirTrackRecord) {
  const auto packets = makePackets(3);
  Bytes file = makeFile(packets);
  file[findChunk(file, "TRAK").offset + 21] ^= 1;
  EXPECT_TRUE((*openBytes(file))->info().indexed);  // the index repeats it
  file.back() ^= 1;
  auto reader = openBytes(file);
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  EXPECT_EQ((*reader)->frameCount(), 3u);
  EXPECT_TRUE((*reader)->info().configuration.empty());
  ASSERT_FALSE((*reader)->info().damage.empty());
  EXPECT_NE((*reader)->info().damage.back().find("no record is whole"), std::string::npos);
}

TEST(Damage, AFrameChunkThatCameTwiceIsListedOnce) {
  const Bytes file = makeFile(makePackets(2));
  const ChunkPlace frame = findChunk(file, "FRAM");
  Bytes twice = cutAt(file, frame.offset + frame.bytes);
  twice.insert(twice.end(), file.begin() + static_cast<std::ptrdiff_t>(frame.offset), file.end());
  auto reader = openBytes(twice);
  ASSERT_TRUE(reader.ok());
  EXPECT_EQ((*reader)->frameCount(), 2u);
  EXPECT_EQ((*reader)->info().damage.size(), 1u);
}

Bytes replaced(const Bytes& bytes, const Bytes& what, const Bytes& with) {
  Bytes out;
  for (auto at = bytes.begin(); at != bytes.end();) {
    const auto found = std::search(at, bytes.end(), what.begin(), what.end());
    out.insert(out.end(), at, found);
    if (found == bytes.end()) break;
    out.insert(out.end(), with.begin(), with.end());
    at = found + static_cast<std::ptrdiff_t>(what.size());
  }
  return out;
}

TEST(Damage, TheNextChunkIsFoundWhereverItStands) {
  // The scanner looks at 2^18 bytes at a time: the next chunk starts at each place around that border.
  constexpr std::size_t kStep = 1 << 18;
  const std::size_t overhead = findChunk(makeFile({makePacket(0, kStep)}), "FRAM").bytes - kStep;
  for (std::size_t bytes = kStep - overhead - 24; bytes < kStep - overhead + 4; ++bytes) {
    const std::vector<Packet> packets = {makePacket(0, bytes), makePacket(1, 5)};
    Bytes file = makeFile(packets);
    file[findChunk(file, "FRAM").offset + 30] ^= 1;
    file.pop_back();
    auto reader = openBytes(file);
    ASSERT_TRUE(reader.ok());
    ASSERT_EQ((*reader)->frameCount(), 1u) << bytes;
    EXPECT_EQ((*reader)->header(0), packets[1].header);
  }
}

TEST(Damage, TransfersInTextModeAreNamed) {
  const Bytes file = makeFile(makePackets(3));
  const auto expectNamed = [](const Bytes& damaged, const std::string& what) {
    EXPECT_MESSAGE(openBytes(damaged).status(), "damaged by a transfer in text mode: " + what);
    EXPECT_MESSAGE(streamBytes(damaged).status(), "damaged by a transfer in text mode: " + what);
  };
  expectNamed(replaced(file, {'\r', '\n'}, {'\n'}), "CR LF was turned into LF");
  expectNamed(replaced(file, {'\n'}, {'\r', '\n'}), "LF was turned into CR LF");
  expectNamed(replaced(replaced(file, {'\r', '\n'}, {'\n'}), {'\n'}, {'\r', '\n'}),
              "LF was turned into CR LF");
  expectNamed(replaced(file, {'\n'}, {'\r'}), "LF was turned into CR");
  Bytes stripped = file;
  for (auto& b : stripped) b &= 0x7F;
  expectNamed(stripped, "the high bit of each byte was stripped");
  expectNamed(replaced(file, {0x89}, {0xC2, 0x89}), "the bytes were converted to UTF-8");
}

TEST(Damage, OtherFilesAndVersionsAreRefused) {
  const std::string text = "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nend_header\n";
  for (const std::string& foreign : {text, std::string("x"), std::string(100000, 'a')}) {
    const auto reader = openBytes(Bytes(foreign.begin(), foreign.end()));
    ASSERT_FALSE(reader.ok());
    EXPECT_MESSAGE(reader.status(), "x.isr: not an .isr file");
  }
  EXPECT_MESSAGE(openBytes({}).status(), "empty");

  // Another version, in the signature alone: found by whoever reads it.
  Bytes later = makeFile(makePackets(1));
  later[8] = 2;
  Bytes crc;
  ByteWriter(crc).fixed(crc32c(ByteSpan(later).first(28)));
  std::copy(crc.begin(), crc.end(), later.begin() + 28);
  later.pop_back();
  EXPECT_EQ(openBytes(later).error().code, ErrorCode::kUnsupported);
  EXPECT_EQ(streamBytes(later).error().code, ErrorCode::kUnsupported);
  EXPECT_MESSAGE(openBytes(later).status(), "version 2");
}

}  // namespace
}  // namespace isoreel
