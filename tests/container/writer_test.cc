// SPDX-License-Identifier: BSD-3-Clause
#include <sys/resource.h>

#include <csignal>

#include "support.h"

namespace isoreel {
namespace {

namespace fs = std::filesystem;

std::unique_ptr<Writer> createWriter(const fs::path& path, bool overwrite = false) {
  auto settings = makeSettings();
  settings.overwrite = overwrite;
  auto writer = Writer::create(path, settings);
  EXPECT_TRUE(writer.ok()) << writer.status().message();
  return writer.ok() ? std::move(*writer) : nullptr;
}

TEST(Writer, ThePartIsReadableAfterEveryFrame) {
  const TemporaryFolder folder;
  const auto packets = makePackets(4);
  auto writer = createWriter(folder / "a.isr");
  ASSERT_NE(writer, nullptr);
  for (std::size_t i = 0; i < packets.size(); ++i) {
    ASSERT_TRUE(writer->write(packets[i]).ok());
    EXPECT_EQ(fs::file_size(folder / "a.isr.part"), writer->bytesWritten());
    EXPECT_FALSE(fs::exists(folder / "a.isr"));
    auto reader = Reader::open(folder / "a.isr.part");
    ASSERT_TRUE(reader.ok()) << reader.status().message();
    EXPECT_FALSE((*reader)->info().indexed);
    EXPECT_TRUE((*reader)->info().damage.empty());
    EXPECT_EQ((*reader)->info().tags, makeSettings().tags);
    ASSERT_EQ((*reader)->frameCount(), i + 1);
    EXPECT_EQ(*(*reader)->packet(i), packets[i].data);
  }
  ASSERT_TRUE(writer->finish().ok());
  EXPECT_FALSE(fs::exists(folder / "a.isr.part"));
  EXPECT_EQ(fs::file_size(folder / "a.isr"), writer->bytesWritten());
  EXPECT_TRUE((*Reader::open(folder / "a.isr"))->info().indexed);
  EXPECT_MESSAGE(writer->write(packets[0]), "finished already");
  EXPECT_MESSAGE(writer->finish(), "finished already");
}

TEST(Writer, GoneBeforeFinishItLeavesThePart) {
  const TemporaryFolder folder;
  const auto packets = makePackets(2);
  auto writer = createWriter(folder / "a.isr");
  ASSERT_NE(writer, nullptr);
  for (const Packet& packet : packets) ASSERT_TRUE(writer->write(packet).ok());
  writer.reset();
  EXPECT_FALSE(fs::exists(folder / "a.isr"));
  auto reader = Reader::open(folder / "a.isr.part");
  ASSERT_TRUE(reader.ok());
  EXPECT_EQ((*reader)->frameCount(), 2u);

  // The part is not lost to the next writer unless that may overwrite.
  const auto second = Writer::create(folder / "a.isr", makeSettings());
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().code, ErrorCode::kIo);
  EXPECT_MESSAGE(second.status(), "a.isr.part: exists already");
  auto third = createWriter(folder / "a.isr", true);
  ASSERT_NE(third, nullptr);
  ASSERT_TRUE(third->finish().ok());
  EXPECT_EQ((*Reader::open(folder / "a.isr"))->frameCount(), 0u);
}

TEST(Writer, DiscardLeavesNothing) {
  const TemporaryFolder folder;
  auto writer = createWriter(folder / "a.isr");
  ASSERT_NE(writer, nullptr);
  ASSERT_TRUE(writer->write(makePacket(0, 5)).ok());
  writer->discard();
  EXPECT_FALSE(fs::exists(folder / "a.isr.part"));
  EXPECT_MESSAGE(writer->write(makePacket(1, 5)), "discarded");
  EXPECT_MESSAGE(writer->finish(), "discarded");
  EXPECT_FALSE(fs::exists(folder / "a.isr"));
}

TEST(Writer, AFileThatIsThereIsKept) {
  const TemporaryFolder folder;
  writeWhole(folder / "a.isr", {1, 2, 3});
  const auto refused = Writer::create(folder / "a.isr", makeSettings());
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kIo);
  EXPECT_MESSAGE(refused.status(), "a.isr: exists already");
  auto writer = createWriter(folder / "a.isr", true);
  ASSERT_NE(writer, nullptr);
  EXPECT_EQ(readWhole(folder / "a.isr"), (Bytes{1, 2, 3}));  // until the new one is whole
  ASSERT_TRUE(writer->finish().ok());
  EXPECT_TRUE(Reader::open(folder / "a.isr").ok());
}

TEST(Writer, AFileThatCameMeanwhileIsKept) {
  const TemporaryFolder folder;
  auto writer = createWriter(folder / "a.isr");
  ASSERT_NE(writer, nullptr);
  ASSERT_TRUE(writer->write(makePacket(0, 5)).ok());
  writeWhole(folder / "a.isr", {1, 2, 3});
  const Status status = writer->finish();
  EXPECT_MESSAGE(status, "came to exist meanwhile");
  EXPECT_EQ(readWhole(folder / "a.isr"), (Bytes{1, 2, 3}));
  auto part = Reader::open(folder / "a.isr.part");
  ASSERT_TRUE(part.ok());
  EXPECT_TRUE((*part)->info().indexed);
}

TEST(Writer, TwoWritersDoNotShareAPart) {
  const TemporaryFolder folder;
  auto writer = createWriter(folder / "a.isr", true);
  ASSERT_NE(writer, nullptr);
  ASSERT_TRUE(writer->write(makePacket(0, 5)).ok());
  auto settings = makeSettings();
  settings.overwrite = true;
  const auto second = Writer::create(folder / "a.isr", settings);
  ASSERT_FALSE(second.ok());
  EXPECT_MESSAGE(second.status(), "another writer is at work");
  ASSERT_TRUE(writer->finish().ok());
  EXPECT_EQ((*Reader::open(folder / "a.isr"))->frameCount(), 1u);
}

TEST(Writer, RefusesFramesThatBreakTheOrder) {
  const TemporaryFolder folder;
  auto writer = createWriter(folder / "a.isr");
  ASSERT_NE(writer, nullptr);
  EXPECT_MESSAGE(writer->write(makePacket(1, 5)), "frame number 1 where 0 is due");
  ASSERT_TRUE(writer->write(makePacket(0, 5)).ok());
  EXPECT_MESSAGE(writer->write(makePacket(0, 5)), "frame number 0 where 1 is due");
  EXPECT_MESSAGE(writer->write(makePacket(2, 5)), "frame number 2 where 1 is due");
  Packet packet = makePacket(1, 5);
  packet.header.time = makePacket(0, 5).header.time;
  EXPECT_MESSAGE(writer->write(packet), "frame time -5 is not after -5");
  packet = makePacket(1, 5);
  packet.header.back = 1;
  EXPECT_MESSAGE(writer->write(packet), "must be its own key");
  packet.header.type = PacketType::kPredicted;
  packet.header.back = 2;
  EXPECT_MESSAGE(writer->write(packet), "the packet before it is not of its GOP");
  EXPECT_MESSAGE(writer->write(makePacket(1, 0)), "packet_length 0 is below 1");
  packet = makePacket(1, 5);
  packet.header.area = std::numeric_limits<double>::quiet_NaN();
  EXPECT_MESSAGE(writer->write(packet), "area is not finite");
  // None of them left a trace.
  ASSERT_TRUE(writer->write(makePacket(1, 5)).ok());
  ASSERT_TRUE(writer->finish().ok());
  auto reader = Reader::open(folder / "a.isr");
  ASSERT_TRUE(reader.ok());
  EXPECT_EQ((*reader)->frameCount(), 2u);
}

TEST(Writer, RefusesSettingsThatReadersWouldRefuse) {
  const TemporaryFolder folder;
  const auto refuse = [&](const WriterSettings& settings, const std::string& why) {
    const auto writer = Writer::create(folder / "a.isr", settings);
    ASSERT_FALSE(writer.ok()) << why;
    EXPECT_EQ(writer.error().code, ErrorCode::kInvalidArgument);
    EXPECT_MESSAGE(writer.status(), why);
    EXPECT_FALSE(fs::exists(folder / "a.isr.part"));
  };
  WriterSettings settings;
  settings.tags = "[]";
  refuse(settings, "tags are not a JSON object");
  settings.tags = "{" + std::string(1 << 20, ' ') + "}";
  refuse(settings, "tags of 1048578 bytes are above 1048576");
  settings = {};
  settings.time_base = {1, 0};
  refuse(settings, "time_denominator 0 is below 1");
  settings = {};
  settings.track_name = std::string(1025, 'n');
  refuse(settings, "name 1025 is above 1024");
  settings = {};
  settings.configuration.resize(65537);
  refuse(settings, "configuration 65537 is above 65536");
}

TEST(Writer, TheLargestTagsAreReadBackEachWay) {
  auto settings = makeSettings();
  settings.tags = R"({"x":")";
  std::mt19937 random(1);
  while (settings.tags.size() < (1 << 20) - 2) settings.tags += static_cast<char>('!' + 2 + random() % 50);
  settings.tags += "\"}";
  ASSERT_EQ(settings.tags.size(), std::size_t{1} << 20);
  const Bytes file = makeFile(makePackets(1), settings);
  EXPECT_EQ((*openBytes(file))->info().tags, settings.tags);
  EXPECT_EQ((*openBytes(Bytes(file.begin(), file.end() - 1)))->info().tags, settings.tags);
  EXPECT_EQ((*streamBytes(file))->info().tags, settings.tags);
}

TEST(Writer, ADiskThatIsFullKeepsTheFramesBefore) {
  const TemporaryFolder folder;
  auto writer = createWriter(folder / "a.isr");
  ASSERT_NE(writer, nullptr);
  ASSERT_TRUE(writer->write(makePacket(0, 1000)).ok());
  rlimit old{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &old), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit tight = old;
  tight.rlim_cur = 5000;  // the second frame does not fit
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &tight), 0);
  const Status status = writer->write(makePacket(1, 10000));
  setrlimit(RLIMIT_FSIZE, &old);
  std::signal(SIGXFSZ, handler);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kIo);
  EXPECT_MESSAGE(status, "a.isr.part: cannot write at byte ");
  EXPECT_EQ(writer->write(makePacket(1, 10)).message(), status.message());
  EXPECT_EQ(writer->finish().message(), status.message());
  auto reader = Reader::open(folder / "a.isr.part");
  ASSERT_TRUE(reader.ok());
  EXPECT_EQ((*reader)->frameCount(), 1u);
  EXPECT_TRUE((*reader)->info().damage.empty());
}

TEST(Writer, PlacesThatCannotBeWritten) {
  const TemporaryFolder folder;
  EXPECT_MESSAGE(Writer::create(folder / "none/a.isr", makeSettings()).status(), "cannot create: ");
  auto settings = makeSettings();
  settings.overwrite = true;
  EXPECT_MESSAGE(Writer::create(folder / ".", settings).status(), "is a directory");
}

}  // namespace
}  // namespace isoreel
