// SPDX-License-Identifier: BSD-3-Clause
// remux, and files in other containers, against the tools that know these: ffmpeg, ffprobe, mkvmerge.
#include "support.h"

namespace isoreel::cli {
namespace {

class CarriersTest : public CliTest {
 protected:
  /// a.isr: eight frames, a key every third, at 10 a second.
  CarriersTest() {
    sequence();
    ok("isoreel encode seq.json -o a.isr --iso 0 --gop 3 --fps 10 --tag title=Merge");
  }
  /// What tells frames apart: their surfaces, in order.
  std::vector<std::string> hashes(const std::string& file) const {
    std::vector<std::string> list;
    const auto frames = json("isoreel info " + file + " --frames --json")["frame_list"];
    for (const auto& frame : frames) list.push_back(frame["hash"]);
    return list;
  }
  std::vector<std::string> hashesOf(std::size_t begin, std::size_t end) const {
    const auto all = hashes("a.isr");
    return {all.begin() + static_cast<std::ptrdiff_t>(begin), all.begin() + static_cast<std::ptrdiff_t>(end)};
  }
  void verified(const std::string& file) const {
    const Outcome outcome = sh("isoreel verify " + file);
    EXPECT_EQ(outcome.code, 0) << outcome.out << outcome.err;
  }
};

TEST_F(CarriersTest, ThereAndBackIsTheSameFile) {
  for (const char* name : {"b.nut", "b.mov", "b.mkv"}) {
    ok(fmt::format("isoreel remux a.isr -o {}", name));
    verified(name);
    ok(fmt::format("isoreel remux {} -o back.isr --force", name));
    EXPECT_EQ(content("back.isr"), content("a.isr")) << name;
    EXPECT_EQ(json(fmt::format("isoreel info {} --json", name))["tags"]["title"], "Merge");
  }
  ok("isoreel decode a.isr --frames 4 -o n_%d.obj && cp b.mkv nameless");
  ok("isoreel decode nameless --frames 4 -o m_%d.obj && cmp m_4.obj n_4.obj");
  ok("cat b.nut | isoreel decode - --frames 4 -o m_%d.obj --force && cmp m_4.obj n_4.obj");
  ok("isoreel render b.mkv --frames 2 -o p.png --size 64x64 && isoreel render a.isr --frames 2 -o q.png "
     "--size 64x64");
  EXPECT_EQ(content("p.png"), content("q.png"));
  EXPECT_EQ(json("isoreel compare b.mov seq.json --frames 0:2 --samples 1000 --json")["extracted"],
            json("isoreel compare a.isr seq.json --frames 0:2 --samples 1000 --json")["extracted"]);
}

TEST_F(CarriersTest, TrimAndConcatTakeThemAsTheyTakeIsrFiles) {
  ok("isoreel remux a.isr -o b.mkv && isoreel remux a.isr -o b.mov && isoreel remux a.isr -o b.nut");
  ok("isoreel trim a.isr -o cut.isr --from 4 --to 7 && isoreel trim b.mkv -o same.isr --from 0.4s --to 0.7s");
  EXPECT_TRUE(content("same.isr") == content("cut.isr"));
  ok("cat b.nut | isoreel trim - -o same.isr --from 4 --to 7 --force");
  EXPECT_TRUE(content("same.isr") == content("cut.isr"));
  ok("isoreel concat a.isr cut.isr -o all.isr && isoreel concat b.mov cut.isr -o same.isr --force");
  EXPECT_TRUE(content("same.isr") == content("all.isr"));
}

TEST_F(CarriersTest, FfprobeSeesEveryPacket) {
  const auto frames = json("isoreel info a.isr --frames --json")["frame_list"];
  for (const char* name : {"b.nut", "b.mov", "b.mkv"}) {
    ok(fmt::format("isoreel remux a.isr -o {}", name));
    const auto probed = json(fmt::format("ffprobe -v quiet -show_packets -show_streams -of json {}", name));
    EXPECT_EQ(probed["streams"][0]["codec_tag_string"], "ISRL");
    ASSERT_EQ(probed["packets"].size(), frames.size());
    for (std::size_t i = 0; i < frames.size(); ++i) {
      const auto& packet = probed["packets"][i];
      EXPECT_EQ(packet["flags"].get<std::string>()[0] == 'K', frames[i]["type"] == "I") << name << i;
      EXPECT_NEAR(std::stod(packet["pts_time"].get<std::string>()), frames[i]["time"], 1e-6) << name << i;
    }
  }
}

TEST_F(CarriersTest, CutsByFfmpegStartAtAKeyOrAreHiddenUpToTheCut) {
  for (const char* name : {"b.nut", "b.mov", "b.mkv"}) ok(fmt::format("isoreel remux a.isr -o {}", name));
  for (const auto& [from, to] : {std::pair("b.nut", "c.mkv"), std::pair("b.mov", "c.nut"),
                                 std::pair("b.mkv", "c.mov"), std::pair("b.mov", "c.mov")}) {
    SCOPED_TRACE(fmt::format("{} to {}", from, to));
    ok(fmt::format("ffmpeg -v quiet -y -ss 0.4 -t 0.2 -i {} -map 0 -c copy {}", from, to));
    verified(to);
    // Frames 4 and 5 were asked for, and 3 is their key: a MOV has an edit list to hide it.
    EXPECT_EQ(hashes(to), hashesOf(std::string(to) == "c.mov" ? 4 : 3, 6));
  }
  ok("isoreel remux c.mov -o cut.isr 2>/dev/null");
  verified("cut.isr");
  EXPECT_EQ(hashes("cut.isr"), hashesOf(4, 6));
  ok("isoreel remux cut.isr -o again.mov");
  EXPECT_EQ(hashes("again.mov"), hashesOf(4, 6));
  fails("isoreel remux cut.isr -o again.mkv", 1, "hidden");
}

TEST_F(CarriersTest, MkvmergeAppendsAndSplits) {
  ok("isoreel remux a.isr -o b.mkv && mkvmerge -q -o twice.mkv b.mkv + b.mkv");
  verified("twice.mkv");
  auto both = hashesOf(0, 8);
  for (const std::string& hash : hashesOf(0, 8)) both.push_back(hash);
  EXPECT_EQ(hashes("twice.mkv"), both);
  ok("isoreel remux twice.mkv -o twice.isr");
  const auto frames = json("isoreel info twice.isr --frames --json")["frame_list"];
  for (std::size_t i = 0; i < 16; ++i) EXPECT_NEAR(frames[i]["time"], 0.1 * static_cast<double>(i), 1e-9);
  ok("mkvmerge -q -o part.mkv --split timestamps:0.25s b.mkv");
  for (const char* part : {"part-001.mkv", "part-002.mkv"}) verified(part);
  EXPECT_EQ(hashes("part-002.mkv").back(), hashes("a.isr").back());
  EXPECT_EQ(hashes("part-001.mkv").size() + hashes("part-002.mkv").size(), 8u);
}

TEST_F(CarriersTest, ASurfaceBesideSound) {
  ok("isoreel remux a.isr -o b.mkv");
  ok("ffmpeg -v quiet -i b.mkv -f lavfi -i sine=d=0.8 -map 1 -map 0 -c:v copy -c:a pcm_s16le sound.mkv");
  verified("sound.mkv");
  EXPECT_EQ(hashes("sound.mkv"), hashes("a.isr"));
  ok("isoreel remux sound.mkv -o back.isr");
  EXPECT_EQ(content("back.isr"), content("a.isr"));
  ok("ffmpeg -v quiet -i sound.mkv -map 0:a -c copy mute.mkv");
  fails("isoreel info mute.mkv", 1, "carries no ISRL track");
}

TEST_F(CarriersTest, HiddenPacketsAreRefusedAndRecodingHelps) {
  ok("isoreel trim a.isr -o cut.isr --from 4 --to 8 --shift");
  for (const char* name : {"x.mkv", "x.nut"}) {
    fails(fmt::format("isoreel remux cut.isr -o {}", name), 1, "isoreel trim --recode");
    EXPECT_FALSE(there(name));
  }
  ok("isoreel remux cut.isr -o cut.mov && isoreel trim cut.isr -o plain.isr --from 0 --recode && isoreel "
     "remux plain.isr -o "
     "plain.mkv");
  verified("cut.mov");
  EXPECT_EQ(hashes("cut.mov"), hashesOf(4, 8));
  verified("plain.mkv");
  EXPECT_EQ(hashes("plain.mkv"), hashes("plain.isr"));
}

TEST_F(CarriersTest, TracksAndAttachments) {
  ok("isoreel encode seq.json -o t.isr --track outer=0 --track inner=0.5 --gop 4");
  const auto outer = hashes("t.isr"), inner = hashes("t.isr --track inner");
  for (const std::string name : {"t.mov", "t.mkv"}) {
    ok("isoreel remux t.isr -o " + name + " && isoreel remux " + name + " -o back.isr --force");
    verified(name);
    EXPECT_EQ(hashes("back.isr"), outer);
    EXPECT_EQ(hashes("back.isr --track inner"), inner);
  }
  EXPECT_EQ(json("isoreel info t.mkv --json")["tracks"][1]["name"], "inner");
  ok("isoreel remux t.mkv --track inner -o inner.mov");
  EXPECT_EQ(hashes("inner.mov"), inner);
  write("case.json", "{}");
  ok("isoreel attach t.isr case.json && isoreel remux t.isr -o t.mkv --force && isoreel remux t.mkv -o "
     "back.isr --force");
  for (const char* name : {"t.mkv", "back.isr"})
    EXPECT_EQ(ok(fmt::format("isoreel extract {} case.json -o -", name)), "{}");
  EXPECT_EQ(json("isoreel info t.mkv --json")["attachments"][0]["name"], "case.json");
  ok("mkvmerge -q -o merged.mkv t.mkv && isoreel extract merged.mkv case.json -o copy.json");
  const auto left = json("isoreel remux t.isr -o t.nut --force --json")["notes"];
  ASSERT_EQ(left.size(), 1u);
  EXPECT_NE(left[0].get<std::string>().find("'case.json' stays behind"), std::string::npos);
  EXPECT_NE(sh("cat t.isr | isoreel remux - --track outer -o p.isr").err.find("the input is a pipe"),
            std::string::npos);
}

TEST_F(CarriersTest, WhatWouldLoseSomethingIsRefusedOrTold) {
  for (const char* name : {"x.ts", "x.webm", "x.ogg", "x.flv"}) {
    fails(fmt::format("isoreel remux a.isr -o {}", name), 1, "would lose the surface");
    EXPECT_FALSE(there(name));
  }
  fails("isoreel remux a.isr -o x.dat", 2, "ends in none of");
  fails("isoreel remux a.isr -o a.isr --force", 2, "is the input");
  const auto avi = json("isoreel remux a.isr -o x.avi --json");
  EXPECT_EQ(avi["frames"], 8);
  EXPECT_EQ(avi["notes"].size(), 1u);
  verified("x.avi");
  fails("isoreel remux a.isr -o x.avi", 1, "is there already");
  const Outcome poor = sh("isoreel remux x.avi -o poor.isr");
  EXPECT_EQ(poor.code, 0);
  EXPECT_NE(poor.err.find("the input does not tell them"), std::string::npos);
  ok("isoreel render x.avi --frames 0 -o p.png --size 64x64");
}

TEST_F(CarriersTest, DamageIsNamedAndTheRestIsSaved) {
  ok("isoreel remux a.isr -o b.mkv");
  std::string bytes = content("b.mkv");
  const auto whole = json("ffprobe -v quiet -show_packets -of json b.mkv")["packets"];
  const auto at = std::stoul(whole[4]["pos"].get<std::string>());
  bytes[at + 60] = static_cast<char>(bytes[at + 60] ^ 1);
  write("bad.mkv", bytes);
  const Outcome outcome = sh("isoreel verify bad.mkv");
  EXPECT_EQ(outcome.code, 1);
  EXPECT_NE(outcome.out.find("frame"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("frame 5 cannot be decoded without it"), std::string::npos) << outcome.out;
}

}  // namespace
}  // namespace isoreel::cli
