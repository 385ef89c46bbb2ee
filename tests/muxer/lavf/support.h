// SPDX-License-Identifier: BSD-3-Clause
// A coded sequence, and files of it in a folder that goes with the test.
#pragma once

#include <gtest/gtest.h>
#include <isoreel/lavf/carrier_reader.h>
#include <isoreel/lavf/carrier_writer.h>

#include <filesystem>
#include <string>
#include <vector>

namespace isoreel::lavf {

/// Packets in memory.
class Sequence final : public PacketSource {
 public:
  explicit Sequence(std::vector<Packet> all);
  std::uint64_t frameCount() const override { return shown_.size(); }
  const FrameHeader& header(std::uint64_t frame) const override { return packets[shown_[frame]].header; }
  Result<Bytes> packet(std::uint64_t frame) override { return packets[shown_[frame]].data; }
  std::uint64_t entryCount() const override { return packets.size(); }
  std::uint64_t entryOf(std::uint64_t frame) const override { return shown_[frame]; }
  const FrameHeader& entryHeader(std::uint64_t entry) const override { return packets[entry].header; }
  Result<Bytes> entryPacket(std::uint64_t entry) override { return packets[entry].data; }

  std::vector<Packet> packets;

 private:
  std::vector<std::uint64_t> shown_;
};

/// A ball that moves: ten frames in GOPs of four, coded once. Frame i is at times[i], or i.
Sequence movingBall(TimeBase base = {1, 25}, const std::vector<std::int64_t>& times = {});
/// The configuration record of its first packet.
Bytes recordOf(const Sequence& sequence);

class LavfTest : public testing::Test {
 protected:
  LavfTest();
  ~LavfTest() override;
  std::filesystem::path path(const std::string& name) const { return folder_ / name; }
  /// By the extension of `name`; must succeed. Gives what the carrier could not keep.
  std::vector<std::string> write(const std::string& name, Sequence& sequence, TimeBase base = {1, 25},
                                 const CarrierSettings& settings = {}) const;
  Status tryToWrite(const std::string& name, Sequence& sequence, TimeBase base = {1, 25}) const;
  /// Must succeed.
  std::unique_ptr<CarrierReader> read(const std::string& name) const;
  Bytes content(const std::string& name) const;

 private:
  std::filesystem::path folder_;
};

/// A source that cannot go back.
std::unique_ptr<ByteSource> pipeOf(Bytes bytes);

/// All entries are those of the sequence, bit for bit; asked for backwards and forwards.
void expectSame(CarrierReader& reader, const Sequence& sequence);

}  // namespace isoreel::lavf
