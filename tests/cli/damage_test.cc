// SPDX-License-Identifier: BSD-3-Clause
// Files that are cut, flipped or made to annoy.
#include <isoreel/container/reader.h>
#include <isoreel/container/writer.h>

#include "support.h"

namespace isoreel::cli {
namespace {

class DamageTest : public CliTest {
 protected:
  DamageTest() {
    sequence();
    ok("isoreel encode seq.json -o seq.isr --iso 0 --frame-types intra");
    whole_ = content("seq.isr");
  }
  /// Where the chunks of frames start, by their type.
  std::vector<std::size_t> frameChunks() const {
    std::vector<std::size_t> found;
    for (std::size_t at = whole_.find("FRAM"); at != std::string::npos; at = whole_.find("FRAM", at + 1))
      found.push_back(at);
    return found;
  }
  void flip(const std::vector<std::size_t>& places) const {
    std::string flipped = whole_;
    for (const std::size_t place : places) flipped[place] = static_cast<char>(flipped[place] ^ 0x10);
    write("bad.isr", flipped);
  }

  std::string whole_;
};

TEST_F(DamageTest, VerifyNamesTheFramesThatAreDamaged) {
  const auto chunks = frameChunks();
  ASSERT_EQ(chunks.size(), 8u);
  for (const std::size_t frame : {0u, 4u, 7u}) {
    flip({chunks[frame] + 60});
    const Outcome outcome = sh("isoreel verify bad.isr");
    EXPECT_EQ(outcome.code, 1);
    EXPECT_NE(outcome.out.find(fmt::format("bad.isr: frame {} at byte {}:", frame, chunks[frame] - 4)),
              std::string::npos)
        << outcome.out;
    EXPECT_EQ(outcome.err, "isoreel verify: bad.isr: 1 problem\n");
    fails("isoreel decode bad.isr --discard --jobs 1", 1, fmt::format("bad.isr: frame {} at byte", frame));
    ok(fmt::format("isoreel decode bad.isr --discard --frames {}",
                   frame == 0 ? "1:" : "0"));  // others are well
  }
  flip({chunks[2] + 60, chunks[5] + 60});  // a list, not only the first
  const Outcome outcome = sh("isoreel verify bad.isr --json");
  EXPECT_EQ(outcome.code, 1);
  const auto result = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(result["ok"], false);
  EXPECT_EQ(result["frames"], 6);
  ASSERT_EQ(result["problems"].size(), 2u) << outcome.out;
  EXPECT_NE(result["problems"][0].get<std::string>().find("frame 2"), std::string::npos);
  EXPECT_NE(result["problems"][1].get<std::string>().find("frame 5"), std::string::npos);
}

TEST_F(DamageTest, VerifyFindsFlipsAnywhere) {
  for (std::size_t place = 0; place < whole_.size(); place += 211) {
    flip({place});
    const Outcome outcome = sh("isoreel verify bad.isr --jobs 1");
    EXPECT_EQ(outcome.code, 1) << place;
    EXPECT_TRUE(outcome.out.starts_with("bad.isr: ")) << outcome.out;
  }
}

TEST_F(DamageTest, ACutFileGivesTheFramesThatAreWhole) {
  ok("isoreel decode seq.isr -o all/%d.ply");
  const auto chunks = frameChunks();
  for (const std::size_t frames : {0u, 1u, 5u, 8u}) {
    // Inside the chunk after the last whole one.
    const std::size_t end = frames < 8 ? chunks[frames] + 40 : whole_.size() - 5;
    write("cut.isr", whole_.substr(0, end));
    EXPECT_EQ(sh("isoreel verify cut.isr").code, 1) << end;
    const auto info = json("isoreel info cut.isr --json");
    EXPECT_EQ(info["frames"], frames) << end;
    EXPECT_EQ(info["indexed"], false);
    EXPECT_EQ(info["damage"].size(), 1u) << info["damage"];
    EXPECT_EQ(json("cat cut.isr | isoreel info - --json")["frames"], frames);
    const Outcome outcome = sh(fmt::format("isoreel decode cut.isr -o {}/%d.ply", frames));
    EXPECT_EQ(outcome.code, 0);
    EXPECT_TRUE(outcome.err.starts_with("isoreel: warning: cut.isr: byte ")) << outcome.err;
    // From a pipe, what is whole is there when the end turns out to be none.
    EXPECT_EQ(sh(fmt::format("cat cut.isr | isoreel decode - -o pipe{}/%d.ply", frames)).code, 1);
    for (std::size_t i = 0; i < frames; ++i) {
      EXPECT_EQ(content(fmt::format("{}/{}.ply", frames, i)), content(fmt::format("all/{}.ply", i)));
      EXPECT_EQ(content(fmt::format("pipe{}/{}.ply", frames, i)), content(fmt::format("all/{}.ply", i)));
    }
    EXPECT_FALSE(there(fmt::format("{0}/{0}.ply", frames)));
  }
}

TEST_F(DamageTest, CutsAnywhereNeverCrash) {
  for (std::size_t end = 0; end < whole_.size(); end += 411) {
    write("cut.isr", whole_.substr(0, end));
    EXPECT_EQ(sh("isoreel verify cut.isr").code, 1) << end;
    EXPECT_LE(sh("isoreel info cut.isr --json").code, 1) << end;
  }
}

TEST_F(DamageTest, TagsMayBeAnything) {
  auto reader = Reader::open(path("seq.isr"));
  ASSERT_TRUE(reader.ok());
  const auto withTags = [&](const std::string& name, const std::string& tags) {
    const FileInfo& info = (*reader)->info();
    auto writer = Writer::create(path(name), {info.time_base, "", info.configuration, tags, true});
    ASSERT_TRUE(writer.ok());
    for (std::uint64_t i = 0; i < (*reader)->frameCount(); ++i) {
      ASSERT_TRUE((*writer)->write({(*reader)->header(i), *(*reader)->packet(i)}).ok());
    }
    ASSERT_TRUE((*writer)->finish().ok());
  };
  withTags("broken.isr", "{this is no JSON");
  EXPECT_EQ(json("isoreel info broken.isr --json")["tags"], nullptr);
  ok("isoreel info broken.isr");
  const std::string deep = "{\"a\":" + std::string(400'000, '[') + std::string(400'000, ']') + "}";
  withTags("deep.isr", deep);
  EXPECT_EQ(json("isoreel info deep.isr --json")["frames"], 8);
  ok("isoreel info deep.isr && isoreel verify deep.isr");
}

}  // namespace
}  // namespace isoreel::cli
