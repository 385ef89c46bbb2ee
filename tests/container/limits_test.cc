// SPDX-License-Identifier: BSD-3-Clause
// Hostile files: lengths that lie, content that explodes. Each must fail at once, with little memory.
#include <sys/resource.h>

#include <chrono>

#include "src/compress.h"
#include "src/index.h"
#include "src/signature.h"
#include "support.h"

namespace isoreel {
namespace {

using namespace container;

/// Fails the test when its life takes more than `seconds`, or makes the process's peak memory grow by
/// `kilobytes`.
class Modest {
 public:
  explicit Modest(double seconds = 2, long kilobytes = 64 * 1024)
      : seconds_(seconds), kilobytes_(kilobytes), peak_(peak()), start_(std::chrono::steady_clock::now()) {}
  ~Modest() {
    EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(), seconds_);
#ifndef __SANITIZE_ADDRESS__  // which keeps what was freed
    EXPECT_LT(peak() - peak_, kilobytes_);
#endif
  }
  Modest(const Modest&) = delete;
  Modest& operator=(const Modest&) = delete;

 private:
  static long peak() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss;
  }
  const double seconds_;
  [[maybe_unused]] const long kilobytes_;
  [[maybe_unused]] const long peak_;
  const std::chrono::steady_clock::time_point start_;
};

Bytes signedFile() {
  Bytes file = *makeSignature({});
  Bytes payload;
  EXPECT_TRUE(writeSyntax(payload, TrackRecord{}).ok());
  EXPECT_TRUE(appendChunk(file, kTrackType, payload).ok());
  return file;
}

void append(Bytes& out, const Bytes& more) { out.insert(out.end(), more.begin(), more.end()); }

Bytes headerOf(ChunkType type, std::uint64_t length) {
  ChunkHeader header;
  header.type = type;
  header.length = length;
  Bytes bytes;
  EXPECT_TRUE(writeSyntax(bytes, header).ok());
  bytes.resize(16);
  ByteWriter(bytes).fixed(crc32c(bytes));
  return bytes;
}

// The file, with an INDX chunk of `payload` and a footer that is right.
Bytes withIndex(Bytes file, const Bytes& payload) {
  Footer footer;
  footer.index_offset = file.size();
  EXPECT_TRUE(appendChunk(file, kIndexType, payload).ok());
  footer.index_length = file.size() - footer.index_offset;
  footer.file_length = file.size() + Footer::kChunkBytes;
  Bytes bytes;
  EXPECT_TRUE(writeSyntax(bytes, footer).ok());
  EXPECT_TRUE(appendChunk(file, kFooterType, bytes).ok());
  return file;
}

TEST(Limits, LengthsThatLie) {
  const Modest modest;
  for (const char* name : {"FRAM", "TRAK", "TAGS", "INDX", "FOOT", "abcd"}) {
    const ChunkType type = {static_cast<std::uint8_t>(name[0]), static_cast<std::uint8_t>(name[1]),
                            static_cast<std::uint8_t>(name[2]), static_cast<std::uint8_t>(name[3])};
    for (const std::uint64_t length : {std::uint64_t{1000}, kMaxPacketBytes, std::uint64_t{1} << 40,
                                       std::uint64_t{1} << 63, ~std::uint64_t{0} - 23, ~std::uint64_t{0}}) {
      Bytes file = signedFile();
      append(file, headerOf(type, length));
      append(file, Bytes(100, 1));
      auto reader = openBytes(file);
      ASSERT_TRUE(reader.ok());
      EXPECT_EQ((*reader)->frameCount(), 0u);
      EXPECT_EQ((*reader)->info().damage.size(), 1u);
      auto stream = streamBytes(file);
      ASSERT_TRUE(stream.ok());
      const auto packet = (*stream)->next();
      ASSERT_FALSE(packet.ok());
      EXPECT_TRUE(packet.error().code == ErrorCode::kTruncated || packet.error().code == ErrorCode::kLimit);
    }
  }
}

TEST(Limits, ContentAboveItsBoundIsNotDecompressed) {
  const Modest modest;
  // A zstd frame header that promises 2^62 bytes.
  Bytes bomb = {0x28, 0xB5, 0x2F, 0xFD, 0xE0};
  ByteWriter(bomb).fixed(std::uint64_t{1} << 62);
  append(bomb, {0x01, 0x00, 0x00});
  EXPECT_EQ(decompress(bomb, kMaxIndexContent).error().code, ErrorCode::kLimit);
  // A real one: 16 MiB of zeros in a kilobyte or so.
  const Bytes zeros = *compress(Bytes(16 << 20, 0));
  ASSERT_LT(zeros.size(), 4096u);
  auto reader = openBytes(withIndex(signedFile(), zeros));
  ASSERT_TRUE(reader.ok());  // by scan
  EXPECT_FALSE((*reader)->info().indexed);
  ASSERT_EQ((*reader)->info().damage.size(), 1u);
  EXPECT_NE((*reader)->info().damage.front().find("is above"), std::string::npos);

  Bytes tags = signedFile();
  ASSERT_TRUE(appendChunk(tags, kTagsType, zeros).ok());
  auto scanned = openBytes(tags);
  ASSERT_TRUE(scanned.ok());
  EXPECT_EQ((*scanned)->info().tags, "{}");
  EXPECT_EQ((*scanned)->info().damage.size(), 1u);
}

TEST(Limits, ZstdPayloadsAreOneFrameThatStatesItsSize) {
  const Bytes frame = *compress(Bytes{1, 2, 3});
  EXPECT_EQ(*decompress(frame, 3), (Bytes{1, 2, 3}));
  Bytes two = frame;
  append(two, frame);
  EXPECT_MESSAGE(decompress(two, 100).status(), "bytes follow the zstd frame");
  EXPECT_FALSE(decompress({}, 100).ok());
  for (std::size_t size = 0; size < frame.size(); ++size) {
    EXPECT_FALSE(decompress(ByteSpan(frame).first(size), 100).ok());
  }
}

TEST(Limits, IndexThatListsMoreFramesThanTheFileHolds) {
  const Modest modest;
  FileRecord record;
  for (const std::uint64_t frames : {std::uint64_t{2}, std::uint64_t{1} << 40, ~std::uint64_t{0}}) {
    record.entries = frames;
    Bytes content;
    ASSERT_TRUE(writeSized(content, record).ok());
    ASSERT_TRUE(writeSized(content, TrackRecord{}).ok());
    auto reader = openBytes(withIndex(signedFile(), *compress(content)));
    ASSERT_TRUE(reader.ok());
    EXPECT_FALSE((*reader)->info().indexed);
    ASSERT_FALSE((*reader)->info().damage.empty());
  }
}

TEST(Limits, IndexEntriesMustLieInTheFile) {
  for (const std::uint64_t gap :
       {std::uint64_t{0}, std::uint64_t{1} << 40, ~std::uint64_t{0}, ~std::uint64_t{0} - 32}) {
    for (const std::uint64_t length : {kMinFrameChunk, std::uint64_t{500}, kMaxFrameChunk}) {
      FileRecord record;
      record.entries = 1;
      IndexEntry entry;
      entry.gap = gap;
      entry.chunk_length = length;
      Bytes content;
      ASSERT_TRUE(writeSized(content, record).ok());
      ASSERT_TRUE(writeSized(content, TrackRecord{}).ok());
      ASSERT_TRUE(writeSyntax(content, entry).ok());
      ASSERT_TRUE(writeSized(content, FrameHeader{}).ok());
      auto reader = openBytes(withIndex(signedFile(), *compress(content)));
      ASSERT_TRUE(reader.ok());
      EXPECT_FALSE((*reader)->info().indexed) << gap << " " << length;
    }
  }
}

// A whole file with frames of these numbers, and an index whose UUID is `uuid`.
Bytes withFrames(const std::vector<std::uint64_t>& numbers, const Uuid& uuid) {
  Bytes file = signedFile();
  FileRecord record;
  record.uuid = uuid;
  record.entries = numbers.size();
  Bytes content;
  EXPECT_TRUE(writeSized(content, record).ok());
  EXPECT_TRUE(writeSized(content, TrackRecord{}).ok());
  std::uint64_t end = Signature::kBytes;
  for (const std::uint64_t number : numbers) {
    const Packet packet = makePacket(number, 5);
    Bytes payload;
    EXPECT_TRUE(appendFrameStart(payload, 0, packet.header, packet.data.size()).ok());
    append(payload, packet.data);
    IndexEntry entry;
    entry.gap = file.size() - end;
    entry.chunk_length = payload.size() + kChunkOverhead;
    EXPECT_TRUE(writeSyntax(content, entry).ok());
    EXPECT_TRUE(writeSized(content, packet.header).ok());
    append(file, chunkOf("FRAM", payload));
    end = file.size();
  }
  return withIndex(file, *compress(content));
}

TEST(Limits, TheIndexKeepsTheRulesOfTheFile) {
  EXPECT_TRUE((*openBytes(withFrames({0, 1, 2}, {})))->info().indexed);
  for (const auto& numbers : std::vector<std::vector<std::uint64_t>>{{1, 2}, {0, 2}, {0, 0}, {1, 0}}) {
    auto reader = openBytes(withFrames(numbers, {}));
    ASSERT_TRUE(reader.ok());
    EXPECT_FALSE((*reader)->info().indexed);
  }
  EXPECT_FALSE((*openBytes(withFrames({0, 1}, {1})))->info().indexed);
}

TEST(Limits, FootersMustBeRightInAPipeToo) {
  const Bytes good = withFrames({0, 1}, {});
  const ChunkPlace index = findChunk(good, "INDX");
  const auto play = [&](Footer footer) {
    Bytes file(good.begin(), good.end() - static_cast<std::ptrdiff_t>(Footer::kChunkBytes));
    Bytes payload;
    EXPECT_TRUE(writeSyntax(payload, footer).ok());
    EXPECT_TRUE(appendChunk(file, kFooterType, payload).ok());
    auto stream = streamBytes(file);
    EXPECT_TRUE(stream.ok());
    std::vector<Packet> played;
    Status status = playAll(**stream, played);
    EXPECT_EQ(played.size(), 2u);
    return status;
  };
  Footer right;
  right.index_offset = index.offset;
  right.index_length = index.bytes;
  right.file_length = good.size();
  EXPECT_TRUE(play(right).ok());
  Footer wrong = right;
  wrong.uuid[3] = 1;
  EXPECT_MESSAGE(play(wrong), "its UUID is not the signature's");
  wrong = right;
  ++wrong.file_length;
  EXPECT_MESSAGE(play(wrong), "it stands at the end of");
  wrong = right;
  --wrong.index_offset;
  EXPECT_MESSAGE(play(wrong), "the index is not where it says");
  wrong = right;
  --wrong.index_length;
  EXPECT_MESSAGE(play(wrong), "the index is not where it says");
}

TEST(Limits, AnUnknownVersionInTheIndexIsNotScannedPast) {
  FileRecord record;
  record.version = 2;
  Bytes content;
  ASSERT_TRUE(writeSized(content, record).ok());
  ASSERT_TRUE(writeSized(content, TrackRecord{}).ok());
  EXPECT_EQ(openBytes(withIndex(signedFile(), *compress(content))).error().code, ErrorCode::kUnsupported);
}

TEST(Limits, FooterThatPointsElsewhere) {
  const Bytes good = withIndex(signedFile(), *compress({}));
  for (const std::uint64_t offset :
       {std::uint64_t{0}, std::uint64_t{31}, std::uint64_t{good.size()}, ~std::uint64_t{0}}) {
    for (const std::uint64_t length :
         {std::uint64_t{0}, std::uint64_t{23}, std::uint64_t{40}, ~std::uint64_t{0}}) {
      Footer footer;
      footer.index_offset = offset;
      footer.index_length = length;
      footer.file_length = good.size();
      Bytes payload;
      ASSERT_TRUE(writeSyntax(payload, footer).ok());
      Bytes file(good.begin(), good.end() - static_cast<std::ptrdiff_t>(Footer::kChunkBytes));
      ASSERT_TRUE(appendChunk(file, kFooterType, payload).ok());
      auto reader = openBytes(file);
      ASSERT_TRUE(reader.ok());
      EXPECT_FALSE((*reader)->info().indexed);
    }
  }
}

TEST(Limits, ChunksInsideChunksAreScannedInLinearTime) {
  // Good headers, each claiming all that follows, whose payload CRCs are wrong: naively the square of the
  // file's size.
  Bytes file = signedFile();
  constexpr std::size_t kSize = 8 << 20;
  while (file.size() + 20 < kSize) append(file, headerOf(kFrameType, kSize - file.size() - kChunkOverhead));
  file.resize(kSize);
  const Modest modest(5);
  auto reader = openBytes(file);
  ASSERT_TRUE(reader.ok());
  EXPECT_EQ((*reader)->frameCount(), 0u);
}

TEST(Limits, SyncMarkersWithoutEndAreScannedInLinearTime) {
  Bytes file = signedFile();
  while (file.size() < (4 << 20))
    file.insert(file.end(), ChunkHeader::kSync.begin(), ChunkHeader::kSync.end());
  const Modest modest(5);
  auto reader = openBytes(file);
  ASSERT_TRUE(reader.ok());
  EXPECT_EQ((*reader)->info().damage.size(), 1u);
}

TEST(Limits, FrameChunksThatAreWrongInside) {
  const Packet packet = makePacket(0, 5);
  Bytes start;
  ASSERT_TRUE(appendFrameStart(start, 0, packet.header, 6).ok());  // one byte more than there is
  append(start, packet.data);
  Bytes empty;
  ByteWriter(empty).varint(0);
  Bytes header;
  ASSERT_TRUE(writeSyntax(header, packet.header).ok());
  Bytes long_header;
  ByteWriter out(long_header);
  out.varint(0);
  out.varint(5000);  // above what a frame header may have
  out.bytes(header);
  out.bytes(Bytes(5000 - header.size() + 10, 1));
  for (const Bytes& payload : {Bytes{}, empty, start, long_header, Bytes(100, 0xFF)}) {
    Bytes file = signedFile();
    append(file, chunkOf("FRAM", payload));
    auto reader = openBytes(file);
    ASSERT_TRUE(reader.ok());
    EXPECT_EQ((*reader)->frameCount(), 0u);
    EXPECT_EQ((*reader)->info().damage.size(), 1u);
    auto stream = streamBytes(file);
    ASSERT_TRUE(stream.ok());
    EXPECT_MESSAGE((*stream)->next().status(), "frame 0 at byte ");
  }
}

class ThrowingSource final : public ByteSource {
 public:
  Result<std::size_t> read(std::uint64_t, std::span<std::uint8_t>) override { throw std::bad_alloc(); }
  std::optional<std::uint64_t> size() const override { return 1000; }
  std::string name() const override { return "throwing"; }
};

TEST(Limits, ExceptionsOfSourcesBecomeErrors) {
  EXPECT_MESSAGE(Reader::open(std::make_unique<ThrowingSource>()).status(), "throwing: failed: ");
  EXPECT_MESSAGE(StreamReader::open(std::make_unique<ThrowingSource>()).status(), "throwing: failed: ");
}

}  // namespace
}  // namespace isoreel
