// SPDX-License-Identifier: BSD-3-Clause
// What a system may do to sources and sinks of files: calls that give or take a part, calls that a signal
// interrupts, a disk that is full.
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>

#include "support.h"

namespace {

/// Of the calls to read and write files.
struct Faults {
  bool short_calls = false, interrupted = false;
  std::int64_t room = -1;  // bytes that can still be written; -1: as many as you like
  std::uint64_t calls = 0;

  /// What a call for `count` bytes may do: so many, or none with `errno` set.
  ssize_t allow(std::size_t count, bool writes) {
    ++calls;
    if (interrupted && calls % 2 == 1) return errno = EINTR, -1;
    if (short_calls) count = std::min<std::size_t>(count, 1 + calls % 7);
    if (!writes || room < 0) return static_cast<ssize_t>(count);
    if (room == 0) return errno = ENOSPC, -1;
    count = std::min(count, static_cast<std::size_t>(room));
    room -= static_cast<std::int64_t>(count);
    return static_cast<ssize_t>(count);
  }
};
Faults faults;

}  // namespace

// In place of the C library's.
extern "C" {
ssize_t readWithFaults(int file, void* out, std::size_t count, off_t offset) asm("pread");
ssize_t writeWithFaults(int file, const void* bytes, std::size_t count, off_t offset) asm("pwrite");

ssize_t readWithFaults(int file, void* out, std::size_t count, off_t offset) {
  const ssize_t now = faults.allow(count, false);
  return now < 0 ? now : syscall(SYS_pread64, file, out, now, offset);
}
ssize_t writeWithFaults(int file, const void* bytes, std::size_t count, off_t offset) {
  const ssize_t now = faults.allow(count, true);
  return now < 0 ? now : syscall(SYS_pwrite64, file, bytes, now, offset);
}
}

namespace isoreel {
namespace {

class FaultsTest : public testing::Test {
 protected:
  void TearDown() override { faults = {}; }
  static WriterSettings settings() {
    WriterSettings result;
    result.configuration = Bytes(30, 7);
    result.tags = R"({"title":"faults"})";
    return result;
  }
  Status write(const std::string& name) {
    ISOREEL_ASSIGN(auto writer, Writer::create(folder_ / name, settings()));
    for (const Packet& packet : packets_) ISOREEL_TRY(writer->write(packet));
    return writer->finish();
  }

  const TemporaryFolder folder_;
  const std::vector<Packet> packets_ = makePackets(5, 100);
};

TEST_F(FaultsTest, PartsAndInterruptionsChangeNothing) {
  for (const bool parts : {false, true}) {
    faults = {parts, true};
    ASSERT_TRUE(write(parts ? "a.isr" : "b.isr").ok());
    auto reader = Reader::open(folder_ / (parts ? "a.isr" : "b.isr"));
    ASSERT_TRUE(reader.ok()) << reader.error().message;
    EXPECT_EQ((*reader)->info().damage.size(), 0u);
    ASSERT_EQ((*reader)->frameCount(), packets_.size());
    for (std::size_t i = 0; i < packets_.size(); ++i) {
      const auto packet = (*reader)->packet(i);
      ASSERT_TRUE(packet.ok());
      EXPECT_EQ(*packet, packets_[i].data);
    }
    EXPECT_GT(faults.calls, 20u);
  }
}

TEST_F(FaultsTest, AFullDiskLeavesWholeFramesAndNoFinalName) {
  ASSERT_TRUE(write("whole.isr").ok());
  const Bytes whole = readWhole(folder_ / "whole.isr");
  std::size_t most = 0;
  for (std::int64_t room = 0; room < static_cast<std::int64_t>(whole.size()); room += 13) {
    SCOPED_TRACE(room);
    faults = {};
    faults.room = room;
    const Status status = write("full.isr");
    ASSERT_FALSE(status.ok());
    EXPECT_EQ(status.error().code, ErrorCode::kIo);
    EXPECT_NE(status.message().find("No space left"), std::string::npos) << status.message();
    faults = {};
    EXPECT_FALSE(std::filesystem::exists(folder_ / "full.isr"));
    if (auto left = Reader::open(folder_ / "full.isr.part"); left.ok()) {
      most = std::max<std::size_t>(most, (*left)->frameCount());
      for (std::size_t i = 0; i < (*left)->frameCount(); ++i) EXPECT_TRUE((*left)->packet(i).ok());
    }
    std::filesystem::remove(folder_ / "full.isr.part");
  }
  EXPECT_EQ(most, packets_.size());
}

}  // namespace
}  // namespace isoreel
