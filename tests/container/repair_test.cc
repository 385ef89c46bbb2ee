// SPDX-License-Identifier: BSD-3-Clause
// Parity as the specification defines it, and what repair brings back.
#include <isoreel/container/repair.h>

#include "support.h"

namespace isoreel {
namespace {

// GF(2^8) as the text of the specification says it, without a library.
std::uint8_t times(std::uint8_t a, std::uint8_t b) {
  unsigned product = 0;
  for (unsigned bit = 0; bit < 8; ++bit) {
    if ((b >> bit & 1) != 0) product ^= unsigned{a} << bit;
  }
  for (unsigned bit = 15; bit >= 8; --bit) {
    if ((product >> bit & 1) != 0) product ^= 0x11Du << (bit - 8);
  }
  return static_cast<std::uint8_t>(product);
}
std::uint8_t inverse(std::uint8_t a) {
  for (unsigned b = 1; b < 256; ++b) {
    if (times(a, static_cast<std::uint8_t>(b)) == 1) return static_cast<std::uint8_t>(b);
  }
  return 0;
}

TEST(Parity, IsWhatTheSpecificationSays) {
  const Bytes run = makePacket(1, 1000).data;
  const auto chunks = reedSolomonParity(30)(run);
  ASSERT_TRUE(chunks.ok());
  Bytes file(container::Signature::kBytes);
  file.insert(file.end(), run.begin(), run.end());
  std::size_t row = 0, before = 0;
  for (std::size_t at = 0; at < chunks->size();) {
    const auto header = container::readChunkHeader(ByteSpan(*chunks).subspan(at));
    ASSERT_TRUE(header.ok());
    const ByteSpan payload = ByteSpan(*chunks).subspan(at + 20, static_cast<std::size_t>(header->length));
    ByteReader in(payload);
    container::ParityHead head;
    ASSERT_TRUE(readSized(in, head).ok());
    EXPECT_EQ(head.distance, before);
    EXPECT_EQ(head.length, run.size());
    EXPECT_EQ(head.first, row);
    const std::size_t data = static_cast<std::size_t>(head.dataBlocks()),
                      block = static_cast<std::size_t>(head.block);
    Bytes padded = run;
    padded.resize(data * block);
    for (std::size_t j = 0; j < data; ++j)
      EXPECT_EQ(in.fixed<std::uint32_t>(), crc32c(ByteSpan(padded).subspan(j * block, block)));
    in.bytes(4 * static_cast<std::size_t>(head.rows));
    const std::uint32_t crc = crc32c(payload.first(in.position()));
    EXPECT_EQ(in.fixed<std::uint32_t>(), crc);
    for (std::uint64_t i = 0; i < head.rows; ++i, ++row) {
      const ByteSpan parity = in.bytes(block);
      for (std::size_t p = 0; p < block; p += 7) {
        std::uint8_t sum = 0;
        for (std::size_t j = 0; j < data; ++j)
          sum ^= times(inverse(static_cast<std::uint8_t>((data + row) ^ j)), padded[j * block + p]);
        ASSERT_EQ(sum, parity[p]);
      }
    }
    EXPECT_EQ(in.left(), 0u);
    at += static_cast<std::size_t>(header->length) + 24;
    before = at;
  }
  EXPECT_EQ(row, 3u);  // 30 % of 4 blocks of 256 bytes, and one more
}

TEST(Parity, RestoresRunsOfAnyLength) {
  std::mt19937 random(5);
  for (const std::size_t length : {1u, 2u, 31u, 255u, 256u, 257u, 1000u, 65535u, 300000u}) {
    for (const unsigned percent : {1u, 25u, 100u}) {
      Bytes file = makePacket(1, length).data;
      const Bytes run = file;
      const auto chunks = reedSolomonParity(percent)(run);
      ASSERT_TRUE(chunks.ok());
      file.insert(file.end(), chunks->begin(), chunks->end());
      const std::size_t damaged = std::max<std::size_t>(1, length * percent / 100),
                        start = random() % (length - damaged + 1);
      for (std::size_t i = 0; i < damaged; ++i) file[start + i] ^= 0x55;
      const auto source = openMemory(file);
      const auto report = checkParity(*source);
      ASSERT_TRUE(report.ok());
      for (const auto& [offset, patch] : report->patches)
        std::copy(patch.begin(), patch.end(), file.begin() + static_cast<std::ptrdiff_t>(offset));
      EXPECT_TRUE(std::equal(run.begin(), run.end(), file.begin())) << length << " " << percent;
    }
  }
}

/// Three GOPs of four frames, chapters and an attachment.
std::vector<Packet> gops(std::size_t bytes) {
  auto packets = makePackets(12, bytes);
  for (Packet& packet : packets) {
    packet.header.back = packet.header.number % 4;
    if (packet.header.back > 0) packet.header.type = PacketType::kPredicted;
  }
  return packets;
}
Bytes fileOf(const std::vector<Packet>& packets, unsigned parity) {
  Bytes file;
  WriterSettings settings = makeSettings();
  if (parity > 0) settings.options.parity = reedSolomonParity(parity);
  auto writer = *Writer::create(openMemorySink(file), settings);
  EXPECT_TRUE(writer->setChapters({{Chapter::Kind::kMarker, 1, 0, "here"}}).ok());
  for (const Packet& packet : packets) EXPECT_TRUE(writer->write(packet).ok());
  const auto note = openMemory(Bytes(5000, 7));
  EXPECT_TRUE(writer->attach("note", "text/plain", *note).ok());
  EXPECT_TRUE(writer->finish().ok());
  return file;
}

class RepairTest : public ::testing::Test {
 protected:
  Result<RepairReport> repair(const Bytes& bad) {
    writeWhole(folder_ / "bad.isr", bad);
    return repairFile(folder_ / "bad.isr", folder_ / "good.isr", {.overwrite = true});
  }
  Bytes repaired() const { return readWhole(folder_ / "good.isr"); }
  // Plays the new file to its end, and gives the numbers that its frames had.
  std::vector<std::uint64_t> kept(const std::vector<Packet>& packets) {
    std::vector<std::uint64_t> numbers;
    auto stream = streamBytes(repaired());
    EXPECT_TRUE(stream.ok()) << stream.status().message();
    if (!stream.ok()) return numbers;
    std::vector<Packet> played;
    const Status status = playAll(**stream, played);
    EXPECT_TRUE(status.ok()) << status.message();
    for (const Packet& packet : played) {
      for (const Packet& old : packets) {
        if (old.data == packet.data) {
          EXPECT_EQ(packet.header.time, old.header.time);
          EXPECT_EQ(packet.header.surface_hash, old.header.surface_hash);
          numbers.push_back(old.header.number);
        }
      }
    }
    EXPECT_EQ(numbers.size(), played.size());
    return numbers;
  }
  const TemporaryFolder folder_;
};

TEST_F(RepairTest, AWholeFileStaysAsItIs) {
  for (const unsigned parity : {0u, 10u}) {
    const Bytes file = fileOf(gops(100), parity);
    const auto report = repair(file);
    ASSERT_TRUE(report.ok()) << report.status().message();
    EXPECT_TRUE(report->exact);
    EXPECT_TRUE(report->damage.empty());
    EXPECT_FALSE(report->lossy());
    EXPECT_EQ(report->frames, 12u);
    EXPECT_EQ(repaired(), file);
  }
}

TEST_F(RepairTest, ParityRestoresContiguousDamageBitForBit) {
  const auto packets = gops(1500);
  const Bytes file = fileOf(packets, 10);
  EXPECT_LT(file.size(), fileOf(packets, 0).size() * 122 / 100);
  const std::size_t end = findChunk(file, "PRTY").offset,
                    first = end / 10;  // the first GOP and what is before it
  std::mt19937 random(1);
  for (std::size_t start = 0; start + first <= end; start += 211) {
    Bytes bad = file;
    for (std::size_t i = 0; i < first; ++i) bad[start + i] = static_cast<std::uint8_t>(random());
    const auto report = repair(bad);
    ASSERT_TRUE(report.ok()) << start << report.status().message();
    EXPECT_TRUE(report->exact) << start;
    EXPECT_FALSE(report->damage.empty());
    EXPECT_GT(report->restored_blocks, 0u);
    ASSERT_EQ(repaired(), file) << start;
  }
}

TEST_F(RepairTest, ParityRestoresScatteredDamage) {
  const Bytes file = fileOf(gops(1500), 10);
  std::mt19937 random(2);
  Bytes bad = file;
  // A place or two less than each run has parity blocks.
  std::size_t start = 0;
  for (const ChunkPlace& chunk : listChunks(file)) {
    if (chunk.type != "PRTY") continue;
    for (int i = 0; chunk.offset > start && i < (chunk.offset - start > 6000 ? 2 : 1); ++i)
      bad[start + random() % (chunk.offset - start)] ^= 0x40;
    start = chunk.offset + chunk.bytes;
  }
  // And the first of the two parity chunks of each run may be hit as well.
  bad[findChunk(file, "PRTY").offset + findChunk(file, "PRTY").bytes - 30] ^= 1;
  const auto report = repair(bad);
  ASSERT_TRUE(report.ok());
  EXPECT_FALSE(report->lossy());
  EXPECT_EQ(report->frames, 12u);
  EXPECT_EQ(kept(gops(1500)).size(), 12u);
}

TEST_F(RepairTest, WithoutParityWholeGopsAreKeptAndTheLossIsListed) {
  const auto packets = gops(100);
  const Bytes file = fileOf(packets, 0);
  for (std::size_t lost = 0; lost < 12; ++lost) {
    for (const bool indexed : {true, false}) {
      Bytes bad = file;
      bad[(*openBytes(file))->chunkOffset(lost) + 130] ^= 2;
      if (!indexed) bad.resize(findChunk(file, "INDX").offset);
      const auto report = repair(bad);
      ASSERT_TRUE(report.ok()) << report.status().message();
      EXPECT_FALSE(report->exact);
      std::vector<std::uint64_t> expected;
      const std::size_t end = lost / 4 * 4 + 4;  // of the GOP
      for (std::size_t i = 0; i < 12; ++i) {
        if (i < lost || i >= end) expected.push_back(i);
      }
      EXPECT_EQ(kept(packets), expected);
      // What is lost at the very end of a file without an index cannot be known.
      const bool known = indexed || lost != 11;
      EXPECT_EQ(report->lost.size(), known ? 1u : 0u);
      EXPECT_EQ(report->open_ended.size(), indexed ? 0u : 1u);
      if (known) {
        EXPECT_EQ(report->lost[0].first, lost);
        EXPECT_EQ(report->lost[0].last, lost);
      }
      EXPECT_EQ(report->dependent.empty(), lost % 4 == 3);
      if (lost % 4 != 3) {
        EXPECT_EQ(report->dependent[0].first, lost + 1);
        EXPECT_EQ(report->dependent[0].last, end - 1);
      }
      if (end < 12) {
        ASSERT_EQ(report->renumbered.size(), 1u);
        EXPECT_EQ(report->renumbered[0].first, end);
        EXPECT_EQ(report->renumbered[0].last, 11u);
        EXPECT_EQ(report->numbers[0], lost);
      }
      auto reader = openBytes(repaired());
      EXPECT_EQ((*reader)->info().tags, makeSettings().tags);
      EXPECT_EQ((*reader)->info().chapters.size(), 1u);
      EXPECT_EQ((*reader)->info().attachments.size(), 1u);
      EXPECT_EQ((*reader)->info().track_name, "fluid");
    }
  }
}

TEST_F(RepairTest, CutAnywhereKeepsAllWholeFrames) {
  const auto packets = gops(20);
  const Bytes file = fileOf(packets, 0);
  std::vector<std::size_t> ends;
  for (const ChunkPlace& chunk : listChunks(file)) {
    if (chunk.type == "FRAM") ends.push_back(chunk.offset + chunk.bytes);
  }
  const std::size_t track = findChunk(file, "TRAK").offset + findChunk(file, "TRAK").bytes;
  const std::size_t apart = std::getenv("ISOREEL_LONG") != nullptr ? 1 : 61;
  for (std::size_t size = 0; size < file.size(); size += apart) {
    const auto report = repair(Bytes(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(size)));
    ASSERT_EQ(report.ok(), size >= track) << size;
    if (!report.ok()) continue;
    const auto whole = std::count_if(ends.begin(), ends.end(), [&](std::size_t end) { return end <= size; });
    EXPECT_EQ(report->frames, static_cast<std::uint64_t>(whole)) << size;
    EXPECT_EQ(kept(packets).size(), static_cast<std::size_t>(whole));
    EXPECT_EQ(report->open_ended.size(), 1u);
  }
}

TEST_F(RepairTest, ADamagedAttachmentIsToldAndTheRestIsKept) {
  Bytes bad = fileOf(gops(20), 0);
  bad[findChunk(bad, "ATCH").offset + 40] ^= 1;
  const auto report = repair(bad);
  ASSERT_TRUE(report.ok());
  EXPECT_EQ(report->attachments, std::vector<std::string>{"note"});
  EXPECT_EQ(report->frames, 12u);
  EXPECT_TRUE((*openBytes(repaired()))->info().attachments.empty());
}

TEST_F(RepairTest, NoFileIsLeftWhenNothingCanBeDone) {
  EXPECT_FALSE(repair(Bytes(1000, 'x')).ok());
  EXPECT_FALSE(std::filesystem::exists(folder_ / "good.isr"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "good.isr.part"));
  writeWhole(folder_ / "good.isr", {1});
  writeWhole(folder_ / "bad.isr", fileOf(gops(20), 0));
  EXPECT_EQ(repairFile(folder_ / "bad.isr", folder_ / "good.isr").error().code, ErrorCode::kIo);
  EXPECT_EQ(repaired(), Bytes{1});
}

TEST_F(RepairTest, EveryFlippedBitIsFoundAndWhatIsProtectedIsRestored) {
  auto packets = gops(20);
  packets.resize(3);
  const Bytes file = fileOf(packets, 20);
  const std::size_t end = findChunk(file, "INDX").offset;
  std::vector<bool> protects(file.size(), true);  // not what parity and index are made of
  for (const ChunkPlace& chunk : listChunks(file)) {
    if (chunk.type != "PRTY" && chunk.offset < end) continue;
    std::fill_n(protects.begin() + static_cast<std::ptrdiff_t>(chunk.offset), chunk.bytes, false);
  }
  for (std::size_t bit = 0; bit < file.size() * 8; ++bit) {
    Bytes bad = file;
    bad[bit / 8] ^= static_cast<std::uint8_t>(1 << (bit % 8));
    auto stream = streamBytes(bad);
    std::vector<Packet> played;
    const Status status = stream.ok() ? playAll(**stream, played) : stream.status();
    ASSERT_FALSE(status.ok()) << bit;
    const std::string message(status.message());
    ASSERT_TRUE(message.find("frame ") != std::string::npos || message.find("byte ") != std::string::npos ||
                message.find("signature") != std::string::npos ||
                message.find("version") != std::string::npos || message.find("magic") != std::string::npos ||
                message.find("text mode") != std::string::npos)
        << message;
    if (bit % 8 != bit / 8 % 8) continue;  // a bit of each byte for what takes longer
    const auto source = openMemory(bad);
    const auto report = checkParity(*source);
    ASSERT_TRUE(report.ok());
    ASSERT_EQ(report->restored, protects[bit / 8] ? 1u : 0u) << bit / 8;
    for (const auto& [offset, patch] : report->patches)
      std::copy(patch.begin(), patch.end(), bad.begin() + static_cast<std::ptrdiff_t>(offset));
    if (protects[bit / 8]) {
      ASSERT_EQ(bad, file) << bit;
    }
  }
}

TEST_F(RepairTest, ParityThatClaimsWhatItLikesTakesLittle) {
  // Chunks that protect all that is in front of them, again and again, with wrong CRCs.
  Bytes file = fileOf(gops(20), 0);
  file.resize(findChunk(file, "INDX").offset);
  for (int i = 0; i < 200; ++i) {
    Bytes payload;
    container::ParityHead head;
    head.length = file.size() - static_cast<std::size_t>(i % 3);
    head.block = head.length;
    ASSERT_TRUE(writeSized(payload, head).ok());
    ByteWriter out(payload);
    out.fixed(std::uint32_t{1});
    out.fixed(std::uint32_t{2});
    out.fixed(crc32c(payload));
    const Bytes chunk = chunkOf("PRTY", payload);
    file.insert(file.end(), chunk.begin(), chunk.end());
  }
  auto source = openMemory(file);
  const auto report = checkParity(*source);
  ASSERT_TRUE(report.ok());
  EXPECT_EQ(report->restored, 0u);
}

}  // namespace
}  // namespace isoreel
