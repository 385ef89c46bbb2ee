// SPDX-License-Identifier: BSD-3-Clause
// The seek index: what it costs, and that files from later minor versions stay readable.
#include "src/index.h"

#include <chrono>

#include "src/signature.h"
#include "support.h"

namespace isoreel {
namespace {

TEST(Index, AnyFrameInTwoReads) {
  const auto packets = makePackets(50, 3000);
  const Bytes file = makeFile(packets);
  ASSERT_GT(file.size(), 65536u);
  for (const std::uint64_t frame : {0u, 17u, 49u}) {
    Counts counts;
    auto reader = openBytes(file, &counts);
    ASSERT_TRUE(reader.ok()) << reader.status().message();
    EXPECT_EQ(counts.reads, 1);
    EXPECT_LE(counts.bytes, 65536u);
    const auto data = (*reader)->packet(frame);
    ASSERT_TRUE(data.ok());
    EXPECT_EQ(*data, packets[frame].data);
    EXPECT_EQ(counts.reads, 2);
  }
}

TEST(Index, LongerThanTheTailCostsOneMoreRead) {
  const auto packets = makePackets(10000, 1);
  const Bytes file = makeFile(packets);
  ASSERT_GT(findChunk(file, "INDX").bytes, 65536u);
  Counts counts;
  const auto start = std::chrono::steady_clock::now();
  auto reader = openBytes(file, &counts);
  const auto taken = std::chrono::steady_clock::now() - start;
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  EXPECT_LT(taken, std::chrono::milliseconds(500));  // generous: for slow machines and sanitizers
  EXPECT_EQ(counts.reads, 2);
  ASSERT_EQ((*reader)->frameCount(), packets.size());
  for (std::uint64_t i = 0; i < packets.size(); ++i) ASSERT_EQ((*reader)->header(i), packets[i].header);
  const auto data = (*reader)->packet(9999);
  ASSERT_TRUE(data.ok());
  EXPECT_EQ(*data, packets[9999].data);
  EXPECT_EQ(counts.reads, 3);
}

/// A file made chunk by chunk, for what the writer does not write.
class FileMaker {
 public:
  FileMaker() {
    EXPECT_TRUE(container::appendChunk(file_, container::kTrackType, trackPayload({})).ok());
    uuid_[0] = 1;
    const Bytes signature = *container::makeSignature(uuid_);
    file_.insert(file_.begin(), signature.begin(), signature.end());
  }
  static Bytes trackPayload(const Bytes& extension) {
    Bytes payload;
    EXPECT_TRUE(writeSyntax(payload, container::TrackRecord{}).ok());
    payload.insert(payload.end(), extension.begin(), extension.end());
    return payload;
  }
  void add(const Bytes& chunk) { file_.insert(file_.end(), chunk.begin(), chunk.end()); }
  // `header_extension` stands behind the frame header's last field, `extension` behind the packet.
  void addFrame(const Packet& packet, const Bytes& header_extension, const Bytes& extension,
                std::uint64_t track = 0) {
    Bytes payload;
    ByteWriter out(payload);
    out.varint(track);
    Bytes header;
    EXPECT_TRUE(writeSyntax(header, packet.header).ok());
    out.varint(header.size() + header_extension.size());
    out.bytes(header);
    out.bytes(header_extension);
    out.varint(packet.data.size());
    out.bytes(packet.data);
    out.bytes(extension);
    const Bytes chunk = chunkOf("FRAM", payload);
    EXPECT_TRUE(index_.add(track, packet.header, file_.size(), chunk.size()).ok());
    add(chunk);
  }
  Bytes finish() {
    FileInfo info;
    info.uuid = uuid_;
    add(*index_.finish(info, {container::TrackRecord{}}, file_.size()));
    return file_;
  }
  const Bytes& bytes() const { return file_; }

 private:
  Bytes file_;
  container::Uuid uuid_{};
  container::IndexBuilder index_;
};

void expectPackets(const Bytes& file, const std::vector<Packet>& packets) {
  auto indexed = openBytes(file);
  ASSERT_TRUE(indexed.ok()) << indexed.status().message();
  EXPECT_TRUE((*indexed)->info().indexed);
  auto scanned = openBytes(Bytes(file.begin(), file.end() - 1));
  ASSERT_TRUE(scanned.ok());
  EXPECT_FALSE((*scanned)->info().indexed);
  auto stream = streamBytes(file);
  ASSERT_TRUE(stream.ok());
  std::vector<Packet> played;
  const Status status = playAll(**stream, played);
  ASSERT_TRUE(status.ok()) << status.message();
  ASSERT_EQ(played.size(), packets.size());
  ASSERT_EQ((*indexed)->frameCount(), packets.size());
  ASSERT_EQ((*scanned)->frameCount(), packets.size());
  for (std::uint64_t i = 0; i < packets.size(); ++i) {
    expectSame(played[i], packets[i]);
    for (Reader* reader : {indexed->get(), scanned->get()}) {
      EXPECT_EQ(reader->header(i), packets[i].header);
      const auto data = reader->packet(i);
      ASSERT_TRUE(data.ok()) << data.status().message();
      EXPECT_EQ(*data, packets[i].data);
    }
  }
}

TEST(Extension, UnknownChunksAreSkipped) {
  const auto packets = makePackets(3);
  FileMaker maker;
  for (const Packet& packet : packets) {
    maker.add(chunkOf("LATR", {1, 2, 3}));
    maker.addFrame(packet, {}, {});
    maker.add(chunkOf("zzzz", Bytes(200000, 7)));
    maker.add(chunkOf("NONE", {}));
  }
  expectPackets(maker.finish(), packets);
}

TEST(Extension, BytesBehindKnownFieldsAreIgnored) {
  const auto packets = makePackets(3);
  FileMaker maker;
  maker.add(chunkOf("TRAK", FileMaker::trackPayload({9, 9, 9})));
  for (const Packet& packet : packets) maker.addFrame(packet, {1, 2, 3, 4}, {5, 6});
  expectPackets(maker.finish(), packets);
}

TEST(Extension, AFileMayGrowBehindItsFooter) {
  const auto packets = makePackets(4);
  FileMaker maker;
  maker.addFrame(packets[0], {}, {});
  maker.addFrame(packets[1], {}, {});
  maker.finish();  // a first session; what follows belongs to a second
  maker.addFrame(packets[2], {}, {});
  maker.addFrame(packets[3], {}, {});
  expectPackets(maker.finish(), packets);
}

TEST(Index, AFrameThatIsNotTheOneListedIsRefused) {
  const auto packets = makePackets(2);
  FileMaker maker;
  maker.addFrame(packets[0], {}, {});
  const std::size_t second = maker.bytes().size();
  maker.addFrame(packets[1], {}, {});
  Bytes file = maker.finish();
  // The second chunk becomes another whole frame of the same length.
  Packet other = packets[1];
  other.header.surface_hash ^= 1;
  Bytes payload;
  ASSERT_TRUE(container::appendFrameStart(payload, 0, other.header, other.data.size()).ok());
  payload.insert(payload.end(), other.data.begin(), other.data.end());
  const Bytes chunk = chunkOf("FRAM", payload);
  std::copy(chunk.begin(), chunk.end(), file.begin() + static_cast<std::ptrdiff_t>(second));
  auto reader = openBytes(file);
  ASSERT_TRUE(reader.ok());
  EXPECT_TRUE((*reader)->packet(0).ok());
  const auto data = (*reader)->packet(1);
  ASSERT_FALSE(data.ok());
  EXPECT_MESSAGE(data.status(), "x.isr: frame 1 at byte " + std::to_string(second) +
                                    ": frame header is not the one that is listed (spec container 7.2)");
}

}  // namespace
}  // namespace isoreel
