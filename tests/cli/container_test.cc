// SPDX-License-Identifier: BSD-3-Clause
// Files that are continued, followed, repaired, and given tags, chapters, attachments and tracks.
#include <isoreel/container/reader.h>
#include <isoreel/container/writer.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <random>
#include <thread>

#include "support.h"

namespace isoreel::cli {
namespace {

class ContainerTest : public CliTest {
 protected:
  ContainerTest() { sequence(); }
  std::vector<std::string> hashes(const std::string& file) const {
    std::vector<std::string> result;
    const auto info = json("isoreel info " + file + " --frames --json");
    for (const auto& frame : info["frame_list"]) result.push_back(frame["hash"]);
    return result;
  }
  void pause(int milliseconds) const { std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds)); }
  void flip(const std::string& file, std::size_t byte) const {
    std::string bytes = content(file);
    bytes[byte] = static_cast<char>(bytes[byte] ^ 0x10);
    write(file, bytes);
  }
};

TEST_F(ContainerTest, AppendGoesOn) {
  ok("isoreel encode seq.json -o all.isr --iso 0 --gop 4");
  ok("isoreel encode seq.json -o a.isr --iso 0 --gop 4 --frames 0:4 --tag a=1");
  ok("isoreel encode seq.json -o a.isr --iso 0 --gop 4 --frames 4:8 --append --tag b=2 --sync gop");
  EXPECT_EQ(hashes("a.isr"), hashes("all.isr"));
  const auto info = json("isoreel info a.isr --frames --json"),
             all = json("isoreel info all.isr --frames --json");
  EXPECT_EQ(info["frame_list"], all["frame_list"]);
  EXPECT_EQ(info["tags"]["a"], "1");
  EXPECT_EQ(info["tags"]["b"], "2");
  ok("isoreel verify a.isr && cat a.isr | isoreel decode - --discard");
  // Times that do not lie behind the end go on there; what does not fit is refused and changes nothing.
  ok("isoreel encode seq.json -o a.isr --iso 0 --frames 0:2 --append --step 1/8");
  EXPECT_EQ(json("isoreel info a.isr --frames --json")["frame_list"][8]["time"], 0.32);
  ok("isoreel verify a.isr");
  const std::string before = content("a.isr");
  balls("other", 9, {{{4, 4, 4}, 3}});
  fails("isoreel encode other.json -o a.isr --iso 0 --append", 1, "it has another grid");
  fails("isoreel encode seq.json -o a.isr --iso 0 --append --inside below", 1, "other side inside");
  fails("isoreel encode seq.json -o a.isr --iso 0 --append --fps 24", 1, "time base is 1/25");
  fails("isoreel encode seq.json -o a.isr --track x=0 --track y=1 --append", 1, "it has 1 track");
  EXPECT_EQ(content("a.isr"), before);
  fails("isoreel encode seq.json -o none.isr --iso 0 --append", 1, "none.isr");
  flip("a.isr", 60);
  write("a.isr", content("a.isr").substr(0, content("a.isr").size() - 1));
  fails("isoreel encode seq.json -o a.isr --iso 0 --append", 1, "is damaged");
}

TEST_F(ContainerTest, HiddenFramesAreDecodedAndNotShown) {
  ok("isoreel encode seq.json -o all.isr --iso 0 --gop 4 && isoreel decode all.isr -o all/%05d.ply");
  // Frames 2 to 5: the first two of the GOP are only needed.
  {
    auto reader = *Reader::open(path("all.isr"));
    WriterSettings settings;
    settings.configuration = reader->info().configuration;
    auto writer = *Writer::create(path("cut.isr"), settings);
    for (std::uint64_t i = 0; i < 6; ++i) {
      Packet packet{reader->header(i), *reader->packet(i)};
      packet.header.number = i < 2 ? 0 : i - 2;
      packet.header.flags = i < 2 ? FrameHeader::kHidden : 0;
      ASSERT_TRUE(writer->write(packet).ok());
    }
    ASSERT_TRUE(writer->finish().ok());
  }
  EXPECT_EQ(json("isoreel verify cut.isr --json")["frames"], 4);
  EXPECT_EQ(json("cat cut.isr | isoreel verify - --json")["frames"], 4);
  const auto shown = json("isoreel info cut.isr --frames --json")["frame_list"];
  ASSERT_EQ(shown.size(), 4u);
  EXPECT_EQ(shown[0]["key"], 0);
  EXPECT_EQ(shown[0]["time"], 0.08);
  ok("isoreel decode cut.isr -o cut/%05d.ply && cat cut.isr | isoreel decode - -o pipe/%05d.ply");
  ok("isoreel decode cut.isr -o one/%05d.ply --frames 1 && isoreel render cut.isr -o cut.png --size 64x48");
  ok("cat cut.isr | isoreel decode - -o one/%05d.ply --frames 3");
  for (int i = 0; i < 4; ++i) {
    const std::string whole = content(fmt::format("all/{:05}.ply", i + 2));
    EXPECT_EQ(content(fmt::format("cut/{:05}.ply", i)), whole) << i;
    EXPECT_EQ(content(fmt::format("pipe/{:05}.ply", i)), whole) << i;
  }
  EXPECT_EQ(list("cut"), list("pipe"));
  EXPECT_EQ(content("one/00001.ply"), content("cut/00001.ply"));
  EXPECT_EQ(content("one/00003.ply"), content("cut/00003.ply"));
  EXPECT_EQ(list("one").size(), 2u);
  // The hidden key is lost: what needs it cannot be shown, and that is said; the next GOP can.
  flip("cut.isr", content("cut.isr").find("FRAM") + 100);
  const auto found = nlohmann::json::parse(sh("isoreel verify cut.isr --json").out);
  EXPECT_EQ(found["lost"], (std::vector<int>{0, 1}));
  EXPECT_EQ(sh("isoreel decode cut.isr --discard --frames 0").code, 1);
  ok("isoreel decode cut.isr --discard --frames 2:");
}

TEST_F(ContainerTest, KilledEncodesAndAppendsLoseNothingThatWasThere) {
  const int kills = std::getenv("ISOREEL_LONG") != nullptr ? 50 : 1;
  longSequence(60'000);
  ok("isoreel encode seq.json -o old.isr --iso 0 --gop 4");
  describe("more", 25, std::vector<std::string>(20'000, "step_00.raw"));
  std::mt19937 random(static_cast<unsigned>(kills));
  for (int i = 0; i < kills; ++i) {
    const auto kill9 = [&](const std::string& line) {
      const pid_t process = start(line);
      pause(100 + static_cast<int>(random() % 400));
      kill(process, SIGKILL);
      EXPECT_EQ(wait(process), 128 + SIGKILL);
    };
    kill9("isoreel encode long.json -o k.isr --iso 0 --gop 4 --force");
    if (there("k.isr.part") && bytes("k.isr.part") > 1000) {
      const auto info = json("isoreel info k.isr.part --json");
      EXPECT_EQ(json("isoreel decode k.isr.part --discard --json --jobs 1")["frames"], info["frames"]);
      ok("isoreel repair k.isr.part -o fixed.isr --force && isoreel verify fixed.isr");
      EXPECT_EQ(json("isoreel info fixed.isr --json")["frames"], info["frames"]);
    }
    ok("cp old.isr a.isr");
    kill9("isoreel encode more.json -o a.isr --iso 0 --gop 4 --append");
    kill9("isoreel encode more.json -o a.isr --iso 0 --gop 4 --append");
    const std::string grown = content("a.isr"), old = content("old.isr");
    EXPECT_EQ(grown.substr(0, old.size()), old);
    const auto info = json("isoreel info a.isr --json");
    EXPECT_GE(info["frames"], 8);
    EXPECT_EQ(json("isoreel decode a.isr --discard --json --jobs 1")["frames"], info["frames"]);
    ok("isoreel encode seq.json -o a.isr --iso 0 --gop 4 --append && isoreel verify a.isr");
    EXPECT_EQ(json("isoreel info a.isr --json")["frames"], info["frames"].get<int>() + 8);
  }
}

TEST_F(ContainerTest, TracksAreReadByName) {
  ok("isoreel encode seq.json -o t.isr --track outer=0 --track inner=0.5 --gop 4");
  ok("isoreel encode seq.json -o inner.isr --iso 0.5 --gop 4 && isoreel encode seq.json -o outer.isr --iso 0 "
     "--gop 4");
  ok("isoreel verify t.isr");
  for (const std::string name : {"outer", "inner"}) {
    EXPECT_EQ(hashes("t.isr --track " + name), hashes(name + ".isr"));
    ok("isoreel decode t.isr --track " + name + " -o a/%05d.ply --force && isoreel decode " + name +
       ".isr -o b/%05d.ply --force && cat t.isr | isoreel decode - --track " + name +
       " -o c/%05d.ply --force");
    EXPECT_EQ(content("a/00003.ply"), content("b/00003.ply"));
    EXPECT_EQ(content("a/00003.ply"), content("c/00003.ply"));
  }
  EXPECT_EQ(hashes("t.isr"), hashes("outer.isr"));
  const auto tracks = json("isoreel info t.isr --json")["tracks"];
  ASSERT_EQ(tracks.size(), 2u);
  EXPECT_EQ(tracks[1]["name"], "inner");
  EXPECT_EQ(tracks[1]["frames"], 8);
  fails("isoreel decode t.isr --track none --discard", 1, "no track 'none'");
  std::size_t at = 0;  // the tracks' GOPs take turns
  for (int chunk = 0; chunk < 6; ++chunk) at = content("t.isr").find("FRAM", at + 1);
  write("bad.isr", content("t.isr"));
  flip("bad.isr", at + 60);
  const auto found = nlohmann::json::parse(sh("isoreel verify bad.isr --json").out);
  EXPECT_EQ(found["problems"].size(), 1u) << found;
  EXPECT_EQ(found["lost_by_track"], nlohmann::json::parse(R"([{"track":"inner","frames":[2,3]}])"));
  ok("isoreel encode seq.json -o t.isr --track inner=0.5 --track outer=0 --gop 4 --append && isoreel verify "
     "t.isr");
  EXPECT_EQ(json("isoreel info t.isr --track inner --json")["frames"], 16);
  fails("isoreel encode seq.json -o x.isr --track a=0 --iso 0", 2, "--iso");
  fails("isoreel encode seq.json -o x.isr --track a", 2, "is not NAME=ISO");
}

TEST_F(ContainerTest, TagsChaptersAndAttachments) {
  ok("isoreel encode seq.json -o a.isr --iso 0 --gop 4");
  const auto before = hashes("a.isr");
  ok("isoreel tag a.isr title=Balls 'who=a b' && isoreel tag a.isr --delete who");
  write("more.json", R"({"deep":{"x":[1,2]}})");
  ok("isoreel tag a.isr --from more.json");
  const auto tags = json("isoreel tag a.isr --json");
  EXPECT_EQ(tags["title"], "Balls");
  EXPECT_EQ(tags["deep"]["x"][1], 2);
  EXPECT_FALSE(tags.contains("who"));
  ok("isoreel chapter a.isr --add 0:4=Apart --add 0.16s=Together --marker 2=Here");
  const auto listed = json("isoreel chapter a.isr --json"), chapters = listed["chapters"];
  ASSERT_EQ(chapters.size(), 3u);
  EXPECT_EQ(chapters[0]["title"], "Apart");
  EXPECT_EQ(chapters[0]["end"], 0.16);
  EXPECT_EQ(chapters[1]["kind"], "marker");
  EXPECT_TRUE(chapters[2]["end"].is_null());
  write("chapters.json", listed.dump());
  ok("isoreel chapter a.isr --clear && isoreel chapter a.isr --from chapters.json");
  EXPECT_EQ(json("isoreel chapter a.isr --json"), listed);
  ok("isoreel attach a.isr seq.json --type application/json && isoreel attach a.isr step_00.raw");
  ok("isoreel extract a.isr seq.json -o out.json && isoreel extract a.isr step_00.raw -o - > out.raw");
  EXPECT_EQ(content("out.json"), content("seq.json"));
  EXPECT_EQ(content("out.raw"), content("step_00.raw"));
  ok("isoreel attach a.isr --remove step_00.raw");
  ASSERT_EQ(json("isoreel attach a.isr --json")["attachments"].size(), 1u);
  EXPECT_EQ(json("isoreel info a.isr --json")["attachments"][0]["type"], "application/json");
  EXPECT_EQ(hashes("a.isr"), before);
  ok("isoreel verify a.isr && isoreel repair a.isr -o c.isr --compact && isoreel verify c.isr");
  EXPECT_LT(bytes("c.isr"), bytes("a.isr"));
  EXPECT_EQ(json("isoreel chapter c.isr --json"), listed);
  EXPECT_EQ(hashes("c.isr"), before);

  const std::string whole = content("a.isr");
  fails("isoreel attach a.isr seq.json", 1, "has an attachment 'seq.json' already (--force replaces it)");
  fails("isoreel attach a.isr none.txt", 1, "none.txt");
  fails("isoreel attach a.isr --remove none", 1, "there is no attachment 'none'");
  fails("isoreel extract a.isr seq.json", 1, "is there already");
  fails("isoreel extract a.isr none", 1, "there is no attachment 'none'");
  fails("isoreel tag a.isr --delete none", 1, "there is no tag 'none'");
  fails("isoreel tag a.isr none", 2, "is not KEY=VALUE");
  fails("isoreel chapter a.isr --add 99=x", 1, "there is no frame 99");
  fails("isoreel chapter a.isr --add 4:2=x", 2, "ends before it starts");
  write("bad.json", "[1]");
  fails("isoreel tag a.isr --from bad.json", 1, "bad.json: is no JSON object");
  fails("isoreel chapter a.isr --from bad.json", 1, "bad.json: is no JSON object");
  EXPECT_EQ(content("a.isr"), whole);
}

TEST_F(ContainerTest, RepairTellsTheTruth) {
  ok("isoreel encode seq.json -o a.isr --iso 0 --gop 4 --parity 20 && isoreel encode seq.json -o n.isr --iso "
     "0 --gop 4");
  EXPECT_NE(ok("isoreel verify a.isr").find("parity protects"), std::string::npos);
  for (const std::string file : {"a", "n"}) {
    ok("cp " + file + ".isr bad.isr");
    std::size_t at = content("bad.isr").find("FRAM");
    at = content("bad.isr").find("FRAM", at + 1);
    flip("bad.isr", at + 100);
    const auto found = nlohmann::json::parse(sh("isoreel verify bad.isr --json").out);
    EXPECT_EQ(found["ok"], false);
    EXPECT_EQ(found["parity"]["restorable_blocks"], file == "a" ? 1 : 0);
    const Outcome outcome = sh("isoreel repair bad.isr -o fixed.isr --force --json");
    const auto report = nlohmann::json::parse(outcome.out);
    EXPECT_EQ(outcome.code, file == "a" ? 0 : 1) << outcome.err;
    EXPECT_EQ(report["exact"], file == "a");
    EXPECT_EQ(report["frames"], file == "a" ? 8 : 5);
    ok("isoreel verify fixed.isr");
    if (file == "a") {
      EXPECT_EQ(content("fixed.isr"), content("a.isr"));
      continue;
    }
    EXPECT_EQ(report["lost"][0]["first"], 1);
    EXPECT_EQ(report["dependent"][0]["last"], 3);
    EXPECT_EQ(report["renumbered"][0]["number"], 1);
    const std::string said = sh("isoreel repair bad.isr -o fixed.isr --force").out;
    for (const char* line : {"lost: frame 1\n", "lost: frames 2 to 3, which cannot be decoded without",
                             "renumbered: frames 4 to 7, from 1 on", "fixed.isr: 5 frames, written anew"})
      EXPECT_NE(said.find(line), std::string::npos) << said;
  }
  fails("isoreel repair a.isr -o a.isr --force", 2, "is the input");
  fails("isoreel repair seq.json -o x.isr", 1, "not an .isr file");
  EXPECT_FALSE(there("x.isr"));
  EXPECT_FALSE(there("x.isr.part"));
}

TEST_F(ContainerTest, StandardOutputTakesAWholeFile) {
  ok("isoreel encode seq.json -o a.isr --iso 0 --gop 4");
  EXPECT_EQ(sh("isoreel encode seq.json -o - --iso 0 --gop 4 > b.isr").code, 0);
  EXPECT_EQ(content("a.isr"), content("b.isr"));
  longSequence(2000);
  const Outcome outcome =
      sh("bash -c 'set -o pipefail; isoreel encode long.json -o - --iso 0 | head -c 100 > c.isr'");
  EXPECT_EQ(outcome.code, 1);
  EXPECT_NE(outcome.err.find("standard output: cannot write: Broken pipe"), std::string::npos) << outcome.err;
}

TEST_F(ContainerTest, AFileIsFollowedWhileItGrows) {
  longSequence(200);
  const pid_t writer = start("isoreel encode long.json -o a.isr --iso 0 --gop 10");
  while (!there("a.isr.part") && !there("a.isr")) pause(1);
  const pid_t reader = start("isoreel decode a.isr --follow --discard --json");
  EXPECT_EQ(wait(writer), 0);
  EXPECT_EQ(wait(reader), 0);
  EXPECT_EQ(json("isoreel decode a.isr --follow --discard --json")["frames"], 200);
  fails("isoreel decode none.isr --follow --discard", 1, "none.isr: cannot open");
  // Facts as they come are those of the finished file.
  const auto facts = json("isoreel info a.isr --frames --json")["frame_list"];
  std::istringstream lines(sh("isoreel info a.isr --follow --json").out);
  std::size_t count = 0;
  for (std::string line; std::getline(lines, line); ++count)
    ASSERT_EQ(nlohmann::json::parse(line), facts.at(count)) << count;
  EXPECT_EQ(count, facts.size());
  EXPECT_NE(sh("isoreel info a.isr --follow").out.find("   199  "), std::string::npos);
  fails("isoreel info a.isr --follow --plot x.svg", 2, "--follow");
}

}  // namespace
}  // namespace isoreel::cli
