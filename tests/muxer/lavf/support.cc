// SPDX-License-Identifier: BSD-3-Clause
#include "support.h"

#include <isoreel/codec/encoder.h>
#include <isoreel/codec/packet_header.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>

namespace isoreel::lavf {
namespace {

class PipeSource final : public ByteSource {
 public:
  explicit PipeSource(Bytes bytes) : memory_(openMemory(std::move(bytes))) {}
  Result<std::size_t> read(std::uint64_t offset, std::span<std::uint8_t> out) override {
    EXPECT_GE(offset, position_) << "went back in a pipe";
    auto got = memory_->read(offset, out);
    position_ = offset + *got;
    return got;
  }
  std::optional<std::uint64_t> size() const override { return std::nullopt; }
  std::string name() const override { return "pipe"; }

 private:
  std::unique_ptr<ByteSource> memory_;
  std::uint64_t position_ = 0;
};

Volume ballAt(const Grid& grid, double x) {
  std::vector<float> samples(grid.nodeCount());
  for (std::uint32_t z = 0; z < grid.nodes[2]; ++z) {
    for (std::uint32_t y = 0; y < grid.nodes[1]; ++y) {
      for (std::uint32_t i = 0; i < grid.nodes[0]; ++i)
        samples[grid.nodeIndex(i, y, z)] = static_cast<float>(4.2 - std::hypot(i - x, y - 8.1, z - 7.8));
    }
  }
  return Volume::own(grid, std::move(samples));
}

}  // namespace

Sequence::Sequence(std::vector<Packet> all) : packets(std::move(all)) {
  for (std::uint64_t i = 0; i < packets.size(); ++i) {
    if (!packets[i].header.hidden()) shown_.push_back(i);
  }
}

Sequence movingBall(TimeBase base, const std::vector<std::int64_t>& times) {
  EncoderSettings settings;
  settings.configuration.grid.nodes = {17, 17, 17};
  settings.configuration.time_base = base;
  settings.frame_types = FrameTypes::kAuto;
  settings.gop = 4;
  auto encoder = Encoder::create(settings);
  EXPECT_TRUE(encoder.ok());
  std::vector<Packet> packets;
  for (std::uint64_t i = 0; i < 10; ++i) {
    const auto at = [&](std::uint64_t n) { return times.empty() ? static_cast<std::int64_t>(n) : times[n]; };
    const std::int64_t gap = i < 9 ? at(i + 1) - at(i) : at(9) - at(8);
    FrameTiming timing{.number = i, .time = at(i), .duration = static_cast<std::uint64_t>(gap)};
    auto packet =
        encoder->encode(ballAt(settings.configuration.grid, 6.0 + 0.4 * static_cast<double>(i)), timing);
    EXPECT_TRUE(packet.ok()) << packet.status().message();
    packets.push_back(*std::move(packet));
  }
  return Sequence(std::move(packets));
}

Bytes recordOf(const Sequence& sequence) { return readPacketHeader(sequence.packets[0].data)->configuration; }

LavfTest::LavfTest() {
  std::string name = (std::filesystem::temp_directory_path() / "isoreel-XXXXXX").string();
  if (mkdtemp(name.data()) != nullptr) folder_ = name;
}
LavfTest::~LavfTest() { std::filesystem::remove_all(folder_); }

std::vector<std::string> LavfTest::write(const std::string& name, Sequence& sequence, TimeBase base,
                                         const CarrierSettings& settings) const {
  std::filesystem::remove(path(name));
  const auto notes =
      writeCarrier(path(name), *carrierOf(name), {{&sequence, base, "", recordOf(sequence)}}, settings);
  EXPECT_TRUE(notes.ok()) << name << ": " << notes.status().message();
  return notes.ok() ? *notes : std::vector<std::string>();
}

Status LavfTest::tryToWrite(const std::string& name, Sequence& sequence, TimeBase base) const {
  return writeCarrier(path(name), *carrierOf(name), {{&sequence, base, "", recordOf(sequence)}}).status();
}

std::unique_ptr<CarrierReader> LavfTest::read(const std::string& name) const {
  auto reader = CarrierReader::open(*openFile(path(name)));
  EXPECT_TRUE(reader.ok()) << name << ": " << reader.status().message();
  return reader.ok() ? *std::move(reader) : nullptr;
}

Bytes LavfTest::content(const std::string& name) const {
  std::ifstream in(path(name), std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

std::unique_ptr<ByteSource> pipeOf(Bytes bytes) { return std::make_unique<PipeSource>(std::move(bytes)); }

void expectSame(CarrierReader& reader, const Sequence& sequence) {
  ASSERT_EQ(reader.entryCount(), sequence.packets.size());
  const auto same = [&](std::size_t i) {
    EXPECT_EQ(reader.entryHeader(i), sequence.packets[i].header) << i;
    const auto packet = reader.entryPacket(i);
    ASSERT_TRUE(packet.ok()) << packet.status().message();
    EXPECT_EQ(*packet, sequence.packets[i].data) << i;
  };
  for (std::size_t i = sequence.packets.size(); i-- > 0;) same(i);
  for (std::size_t i = 0; i < sequence.packets.size(); ++i) same(i);
  for (const std::size_t i : {5u, 2u, 8u, 8u, 0u, 9u}) {
    if (i < sequence.packets.size()) same(i);
  }
}

}  // namespace isoreel::lavf
