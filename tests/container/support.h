// SPDX-License-Identifier: BSD-3-Clause
// Frames, files and sources for the container's tests.
#pragma once

#include <gtest/gtest.h>
#include <isoreel/container/reader.h>
#include <isoreel/container/writer.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>

#include "src/chunk.h"
#include "src/format.h"

namespace isoreel {

/// A folder that goes with the test.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "isoreel-XXXXXX").string();
    if (mkdtemp(name.data()) != nullptr) path_ = name;
  }
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

inline Bytes readWhole(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

inline void writeWhole(const std::filesystem::path& path, const Bytes& bytes) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

/// Frame `number` of a made-up sequence: every field has a value of its own.
inline Packet makePacket(std::uint64_t number, std::size_t bytes) {
  std::mt19937_64 random(number);
  Packet packet;
  FrameHeader& h = packet.header;
  h.number = h.position = number;
  h.time = static_cast<std::int64_t>(number * 3) - 5;
  h.duration = 3;
  h.isovalue = 0.25 + static_cast<double>(number);
  h.vertices = static_cast<std::uint32_t>(random() % 100000);
  h.faces = static_cast<std::uint32_t>(random() % 100000);
  for (std::size_t i = 0; i < 3; ++i) {
    h.box_min[i] = static_cast<std::uint32_t>(random() % 1000000);
    h.box_max[i] = h.box_min[i] + 16384;
  }
  h.area = static_cast<double>(random() % 1000) / 7;
  h.volume = static_cast<double>(random() % 1000) / 3;
  h.components = 2;
  h.euler = 4 - static_cast<std::int64_t>(number);
  h.error_kind = ErrorKind::kExtracted;
  h.error_rms = 0.01f;
  h.error_max = 0.05f;
  h.surface_hash = random();
  packet.data.resize(bytes);
  for (auto& b : packet.data) b = static_cast<std::uint8_t>(random());
  return packet;
}

inline std::vector<Packet> makePackets(std::uint64_t count, std::size_t bytes = 20) {
  std::vector<Packet> packets;
  for (std::uint64_t i = 0; i < count; ++i) packets.push_back(makePacket(i, bytes + i % 3));
  return packets;
}

inline WriterSettings makeSettings() {
  WriterSettings settings;
  settings.time_base = {1, 24};
  settings.track_name = "fluid";
  settings.configuration = {'I', 'S', 'R', 'L', 1, 2, 3, 4};
  settings.tags = R"({"title":"Tröpfchen","made":{"by":"a test"}})";
  return settings;
}

/// The whole file that the writer makes of `packets`.
inline Bytes makeFile(const std::vector<Packet>& packets, const WriterSettings& settings = makeSettings()) {
  const TemporaryFolder folder;
  const auto path = folder / "made.isr";
  auto writer = Writer::create(path, settings);
  EXPECT_TRUE(writer.ok()) << writer.status().message();
  if (!writer.ok()) return {};
  for (const Packet& packet : packets) {
    const Status status = (*writer)->write(packet);
    EXPECT_TRUE(status.ok()) << status.message();
  }
  const Status status = (*writer)->finish();
  EXPECT_TRUE(status.ok()) << status.message();
  return readWhole(path);
}

struct Counts {
  int reads = 0;
  std::uint64_t bytes = 0;
};

/// Bytes in memory whose reads are counted; a pipe, going forward only, when `pipe`.
class TestSource final : public ByteSource {
 public:
  explicit TestSource(Bytes bytes, Counts* counts = nullptr, bool pipe = false)
      : bytes_(std::move(bytes)), counts_(counts), pipe_(pipe) {}
  Result<std::size_t> read(std::uint64_t offset, std::span<std::uint8_t> out) override {
    if (counts_ != nullptr) {
      ++counts_->reads;
      counts_->bytes += out.size();
    }
    if (pipe_ && offset != position_) return {ErrorCode::kIo, "asked to jump in a pipe"};
    if (offset >= bytes_.size()) return std::size_t{0};
    const std::size_t count =
        std::min<std::size_t>(out.size(), bytes_.size() - static_cast<std::size_t>(offset));
    std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(offset), count, out.begin());
    position_ = offset + count;
    return count;
  }
  std::optional<std::uint64_t> size() const override {
    return pipe_ ? std::nullopt : std::optional<std::uint64_t>(bytes_.size());
  }
  std::string name() const override { return "x.isr"; }

 private:
  const Bytes bytes_;
  Counts* const counts_;
  const bool pipe_;
  std::uint64_t position_ = 0;
};

inline Result<std::unique_ptr<Reader>> openBytes(Bytes bytes, Counts* counts = nullptr) {
  return Reader::open(std::make_unique<TestSource>(std::move(bytes), counts));
}
inline Result<std::unique_ptr<StreamReader>> streamBytes(Bytes bytes, Counts* counts = nullptr) {
  return StreamReader::open(std::make_unique<TestSource>(std::move(bytes), counts, true));
}

/// Where each chunk of a whole file starts, and its type.
struct ChunkPlace {
  std::string type;
  std::size_t offset;
  std::size_t bytes;
};
inline std::vector<ChunkPlace> listChunks(const Bytes& file) {
  std::vector<ChunkPlace> chunks;
  for (std::size_t offset = container::Signature::kBytes; offset < file.size();) {
    const auto header = container::readChunkHeader(ByteSpan(file).subspan(offset));
    EXPECT_TRUE(header.ok()) << header.status().message();
    if (!header.ok()) break;
    const std::size_t bytes = static_cast<std::size_t>(header->length) + container::kChunkOverhead;
    chunks.push_back({container::typeName(header->type), offset, bytes});
    offset += bytes;
  }
  return chunks;
}
inline ChunkPlace findChunk(const Bytes& file, const std::string& type) {
  for (const ChunkPlace& chunk : listChunks(file)) {
    if (chunk.type == type) return chunk;
  }
  ADD_FAILURE() << "no " << type;
  return {};
}

inline Bytes chunkOf(const char (&type)[5], const Bytes& payload) {
  Bytes out;
  EXPECT_TRUE(container::appendChunk(out, container::chunkType(type), payload).ok());
  return out;
}

/// Reads a file forward to its end: its packets, or what went wrong.
inline Status playAll(StreamReader& reader, std::vector<Packet>& packets) {
  while (true) {
    ISOREEL_ASSIGN(std::optional<Packet> packet, reader.next());
    if (!packet) return {};
    packets.push_back(std::move(*packet));
  }
}

inline void expectSame(const Packet& a, const Packet& b) {
  EXPECT_EQ(a.header, b.header);
  EXPECT_EQ(a.data, b.data);
}

#define EXPECT_MESSAGE(status, part)                                       \
  EXPECT_NE(std::string((status).message()).find(part), std::string::npos) \
      << "message: " << (status).message()

}  // namespace isoreel
