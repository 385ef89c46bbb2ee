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

TEST_F(GopTest, ProfileMainIsSmaller) {
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
  ok("isoreel encode seq.json -o classic.isr --iso 0 --profile classic --frame-types intra");
  EXPECT_LT(bytes("main.isr"), bytes("classic.isr"));
  ok("isoreel encode seq.json -o mainp.isr --iso 0 --profile main --gop 5");
  EXPECT_EQ(types("mainp.isr"), "IPPPPIPP");
  ok("isoreel verify mainp.isr");
  EXPECT_LT(bytes("mainp.isr"), bytes("main.isr"));
  ok("isoreel decode mainp.isr -o main/%05d.ply && isoreel decode mainp.isr -o main3/%05d.ply --frames 3");
  EXPECT_EQ(content("main3/00003.ply"), content("main/00003.ply"));
  ok("isoreel trim mainp.isr -o cut.isr --from 2 --recode && isoreel verify cut.isr");
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

TEST_F(GopTest, InfoTellsWhatTheBlocksDo) {
  // A ball that moves by one cell along x, and then not at all.
  std::vector<std::string> files;
  for (const int moved : {0, 1, 2, 2}) {
    files.push_back(fmt::format("at_{}.raw", moved));
    balls(fmt::format("at_{}", moved), 25, {{{14.3 + moved, 15.2, 14.9}, 7.2}});
  }
  describe("moving", 25, files);
  ok("isoreel encode moving.json -o moving.isr --iso 0 --block 16");
  const auto info = json("isoreel info moving.isr --frames --packets --json");
  const auto packets = info["packet_list"];
  ASSERT_EQ(packets.size(), 4u);
  EXPECT_EQ(packets[0]["type"], "I");
  EXPECT_EQ(packets[0]["references"].size(), 0u);
  EXPECT_EQ(packets[0]["motion"], nullptr);
  for (std::size_t i = 1; i < 4; ++i) {
    EXPECT_EQ(packets[i]["type"], "P");
    EXPECT_EQ(packets[i]["references"], std::vector<int>{1});
    const auto& motion = packets[i]["motion"];
    EXPECT_EQ(motion["block"], 16);
    EXPECT_EQ(motion["blocks"], 8);
    EXPECT_EQ(motion["moving"], 8);
    EXPECT_EQ(motion["intra"], 0);
    EXPECT_EQ(motion["vertices"], info["frame_list"][i]["vertices"]);
    EXPECT_EQ(motion["predicted"], motion["vertices"]);
    EXPECT_NEAR(motion["mean"].get<double>(), i < 3 ? 1 : 0,
                i < 3 ? 0.08 : 0);  // drawn to none a little: vectors cost bits
    EXPECT_NEAR(motion["largest"].get<double>(), i < 3 ? 1 : 0, i < 3 ? 0.15 : 0);
  }
  const std::string text = ok("isoreel info moving.isr --packets --jobs 1");
  EXPECT_NE(text.find("from 2: 8 blocks of 16 cells, 8 predicted"), std::string::npos) << text;
  EXPECT_EQ(text.find("from 3"), std::string::npos);
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
  // Without the index the damaged frame is left out, and what depends on it is told one by one.
  write("cut.isr", bad.substr(0, bad.size() - 40));
  const auto packets = json("isoreel info cut.isr --packets --json")["packet_list"];
  ASSERT_GE(packets.size(), 4u);
  EXPECT_FALSE(packets[0].contains("problem"));
  EXPECT_EQ(packets[1]["number"], 2);
  EXPECT_EQ(packets[1]["motion"], nullptr);
  EXPECT_NE(packets[1]["problem"].get<std::string>().find("predicted from frame 1"), std::string::npos);
  EXPECT_NE(packets[4]["motion"], nullptr);
}

}  // namespace
}  // namespace isoreel::cli
