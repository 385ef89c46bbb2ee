// SPDX-License-Identifier: BSD-3-Clause
// Sequences of predicted frames.
#include "support.h"

namespace isoreel::cli {
namespace {

class GopTest : public CliTest {
 protected:
  GopTest() {
    sequence();
    ok("isoreel encode seq.json -o seq.isr --iso 0 --gop 4");
  }
  std::string types(const std::string& file) const {
    std::string result;
    const auto info = json("isoreel info " + file + " --frames --json");
    for (const auto& frame : info["frame_list"]) result += frame["type"].get<std::string>();
    return result;
  }
};

TEST_F(GopTest, KeysComeAtTheLimit) {
  EXPECT_EQ(types("seq.isr").substr(0, 7), "IPPPIPP");  // the last is I where P would not be smaller
  ok("isoreel verify seq.isr");
  const auto totals = json("isoreel encode seq.json -o intra.isr --iso 0 --gop 1 --json");
  EXPECT_EQ(totals["predicted_frames"], 0);
  EXPECT_LT(bytes("seq.isr"), bytes("intra.isr"));
  ok("isoreel encode seq.json -o same.isr --iso 0 --frame-types intra");
  EXPECT_EQ(types("same.isr"), "IIIIIIII");
  fails("isoreel encode seq.json -o x.isr --iso 0 --gop 0", 2, "--gop");
  fails("isoreel encode seq.json -o x.isr --iso 0 --block 7", 2, "--block");
}

TEST_F(GopTest, ProfileMainIsSmallerAndIntraOnly) {
  fails("isoreel encode seq.json -o main.isr --iso 0 --profile main", 2, "--frame-types intra");
  fails("isoreel encode seq.json -o main.isr --iso 0 --profile other --frame-types intra", 2, "--profile");
  fails("isoreel encode seq.json -o main.isr --iso 0 --profile main --frame-types intra --without luck", 2,
        "--without");
  ok("isoreel encode seq.json -o main.isr --iso 0 --profile main --frame-types intra");
  ok("isoreel encode seq.json -o main1.isr --iso 0 --profile main --gop 1 --jobs 1");
  EXPECT_EQ(types("main.isr"), "IIIIIIII");
  ok("isoreel verify main.isr && cmp main.isr main1.isr");
  ok("isoreel encode seq.json -o plain.isr --iso 0 --profile main --frame-types intra --without "
     "neighbours,signs,fit,rate");
  ok("isoreel verify plain.isr");
  ok("isoreel encode seq.json -o classic.isr --iso 0 --frame-types intra");
  EXPECT_LT(bytes("main.isr"), bytes("classic.isr"));
}

TEST_F(GopTest, FramesInsideAGopAreThoseOfTheWhole) {
  ok("isoreel decode seq.isr -o all/%05d.ply");
  for (const char* range : {"2", "1:3", "6:8", "3:6"}) {
    ok(fmt::format("isoreel decode seq.isr -o some/%05d.ply --frames {} --force", range));
    ok(fmt::format("cat seq.isr | isoreel decode - -o pipe/%05d.ply --frames {} --force", range));
  }
  for (const int frame : {1, 2, 3, 4, 5, 6, 7}) {
    const std::string name = fmt::format("{:05}.ply", frame);
    EXPECT_EQ(content("some/" + name), content("all/" + name));
    EXPECT_EQ(content("pipe/" + name), content("all/" + name));
  }
  EXPECT_FALSE(there("some/00000.ply"));
  EXPECT_EQ(json("isoreel decode seq.isr --discard --json --frames 6:")["frames"], 2);
}

TEST_F(GopTest, CoarserLevelsAreTheSameWhateverTheFrameType) {
  ok("isoreel encode seq.json -o intra.isr --iso 0 --frame-types intra");
  ok("isoreel decode seq.isr -o a/%05d.ply --level -1 && isoreel decode intra.isr -o b/%05d.ply --level -1");
  for (int frame = 0; frame < 8; ++frame) {
    const std::string name = fmt::format("{:05}.ply", frame);
    EXPECT_EQ(content("a/" + name), content("b/" + name));
  }
}

TEST_F(GopTest, DamageTakesTheFramesThatDependOnIt) {
  const std::string whole = content("seq.isr");
  std::size_t at = 0;
  for (int frame = 0; frame <= 1; ++frame) at = whole.find("FRAM", at + 1);
  std::string bad = whole;
  bad[at + 60] = static_cast<char>(bad[at + 60] ^ 0x10);
  write("bad.isr", bad);
  const Outcome outcome = sh("isoreel verify bad.isr --json");
  EXPECT_EQ(outcome.code, 1);
  const auto result = nlohmann::json::parse(outcome.out);
  ASSERT_EQ(result["problems"].size(), 1u) << outcome.out;
  EXPECT_NE(result["problems"][0].get<std::string>().find("frame 1"), std::string::npos);
  EXPECT_EQ(result["lost"], (std::vector<int>{2, 3}));
  EXPECT_NE(sh("isoreel verify bad.isr").out.find("frames 2 to 3 cannot be decoded without"),
            std::string::npos);
  ok("isoreel decode bad.isr --discard --frames 0:1 && isoreel decode bad.isr --discard --frames 4:");
  fails("isoreel decode bad.isr --discard --frames 2", 1, "frame 1 at byte");
}

}  // namespace
}  // namespace isoreel::cli
