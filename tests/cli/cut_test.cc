// SPDX-License-Identifier: BSD-3-Clause
// Cutting files and putting them together again: trim, concat, and the shards of one encode.
#include <isoreel/codec/player.h>
#include <isoreel/container/reader.h>

#include <random>

#include "support.h"

namespace isoreel::cli {
namespace {

class CutTest : public CliTest {
 protected:
  CutTest() {
    sequence();
    ok("isoreel encode seq.json -o seq.isr --iso 0 --gop 3 --tag title=balls");
  }

  /// Hashes of the decoded surfaces of all frames.
  std::vector<std::uint64_t> hashes(const std::string& file) const {
    std::vector<std::uint64_t> result;
    auto reader = Reader::open(path(file));
    if (!reader) {
      ADD_FAILURE() << reader.error().message;
      return result;
    }
    Player player(**reader);
    for (std::uint64_t i = 0; i < player.frameCount(); ++i) {
      const auto surface = player.frame(i);
      EXPECT_TRUE(surface.ok()) << file << ": " << surface.status().message();
      result.push_back(surface.ok() ? surfaceHash(*surface) : 0);
    }
    return result;
  }
  std::vector<double> times(const std::string& file) const {
    std::vector<double> result;
    const auto info = json("isoreel info " + file + " --frames --json");
    for (const auto& frame : info["frame_list"]) result.push_back(frame["time"]);
    return result;
  }
};

TEST_F(CutTest, EveryPairOfFramesPlaysWhatWasAskedFor) {
  describe("six", 25,
           {"step_00.raw", "step_01.raw", "step_02.raw", "step_03.raw", "step_04.raw", "step_05.raw"});
  ok("isoreel encode six.json -o six.isr --iso 0 --gop 2");
  const auto all = hashes("six.isr");
  ASSERT_EQ(all.size(), 6u);
  for (int from = 0; from < 6; ++from) {
    for (int to = from + 1; to <= 6; ++to) {
      ok(fmt::format("isoreel trim six.isr -o cut.isr --from {} --to {} --force", from, to));
      EXPECT_EQ(hashes("cut.isr"), std::vector<std::uint64_t>(all.begin() + from, all.begin() + to))
          << from << " " << to;
    }
  }
  ok("isoreel verify cut.isr");
}

TEST_F(CutTest, TrimKeepsPacketsAndTimesAndTellsWhatIsHidden) {
  const auto totals = json("isoreel trim seq.isr -o cut.isr --from 5 --to 7 --json");
  EXPECT_EQ(totals["frames"], 2);
  EXPECT_EQ(totals["hidden"], 2);
  EXPECT_EQ(totals["bytes"], bytes("cut.isr"));
  EXPECT_EQ(times("cut.isr"), (std::vector<double>{0.2, 0.24}));
  ok("isoreel verify cut.isr && cat cut.isr | isoreel decode - -o pipe/%05d.obj && isoreel decode cut.isr -o "
     "file/%05d.obj");
  ok("isoreel decode seq.isr -o whole/%05d.obj");
  EXPECT_EQ(list("pipe"), (std::vector<std::string>{"00000.obj", "00001.obj"}));
  EXPECT_EQ(content("pipe/00000.obj"), content("whole/00005.obj"));
  EXPECT_EQ(content("file/00001.obj"), content("whole/00006.obj"));
  ok("isoreel trim seq.isr -o once.isr --from 4 --to 6");
  EXPECT_NE(ok("isoreel trim once.isr -o twice.isr --from 1 --shift").find("2 packets"), std::string::npos);
  EXPECT_EQ(hashes("twice.isr"), std::vector<std::uint64_t>{hashes("seq.isr")[5]});
  EXPECT_EQ(times("twice.isr"), std::vector<double>{0});
}

TEST_F(CutTest, RecodedFramesNeedNothingInFrontOfThem) {
  const auto totals = json("isoreel trim seq.isr -o cut.isr --from 1 --to 7 --recode --json");
  EXPECT_EQ(totals["hidden"], 0);
  EXPECT_EQ(totals["recoded"], 2);
  EXPECT_GT(totals["moved"], 0);
  EXPECT_LE(totals["moved"], 0.0313 * std::sqrt(19));
  ok("isoreel verify cut.isr");
  const auto all = json("isoreel info seq.isr --frames --json")["frame_list"],
             cut = json("isoreel info cut.isr --frames --json")["frame_list"];
  ASSERT_EQ(cut.size(), 6u);
  EXPECT_EQ(cut[0]["type"], "I");
  EXPECT_EQ(cut[0]["error"]["against"], "none");
  for (std::size_t i = 0; i < 6; ++i) {
    for (const char* fact : {"time", "vertices", "faces", "components", "euler", "isovalue"})
      EXPECT_EQ(cut[i][fact], all[i + 1][fact]) << fact << " of " << i;
    EXPECT_NEAR(cut[i]["volume"].get<double>(), all[i + 1]["volume"].get<double>(),
                0.002 * all[i + 1]["volume"].get<double>());
    EXPECT_TRUE(i < 2 || cut[i]["hash"] == all[i + 1]["hash"]) << "packets of other GOPs are copied";
  }
}

TEST_F(CutTest, TrimByTime) {
  for (const auto& [range, frames] : std::vector<std::pair<std::string, int>>{{"--from 0.2s", 3},
                                                                              {"--from 0.2001s", 2},
                                                                              {"--from 200ms --to 0.28s", 2},
                                                                              {"--to 3/25s", 3},
                                                                              {"--from -1s --to 1us", 1}}) {
    EXPECT_EQ(json("isoreel trim seq.isr -o cut.isr --json --force " + range)["frames"], frames) << range;
  }
  fails("isoreel trim seq.isr -o x.isr --from 3s", 2, "holds no frame");
  fails("isoreel trim seq.isr -o x.isr --from 3 --to 9", 2, "last of 8 frames");
  fails("isoreel trim seq.isr -o x.isr --from 3.5", 2, "neither a frame");
  fails("isoreel trim seq.isr -o x.isr", 2, "--to is required");
  fails("isoreel trim seq.isr -o cut.isr --from 1", 1, "there already");
  fails("isoreel trim none.isr -o x.isr --from 1", 1, "none.isr");
  EXPECT_FALSE(there("x.isr") || there("x.isr.part"));
}

TEST_F(CutTest, FramesOfOtherVerbsByTime) {
  EXPECT_EQ(json("isoreel decode seq.isr --discard --json --frames 0.1s:0.2s")["frames"], 2);
  ok("isoreel decode seq.isr -o at.obj --frames 0.1s && isoreel decode seq.isr -o two.obj --frames 2");
  EXPECT_EQ(content("at.obj"), content("two.obj"));
  fails("cat seq.isr | isoreel decode - --discard --frames 0.1s:", 2, "pipe");
  fails("isoreel decode seq.isr --discard --frames 0.1x", 2, "neither a frame");
  fails("isoreel decode seq.isr --discard --frames 9999999999999999999min", 2, "is no number");
  EXPECT_EQ(json("isoreel encode seq.json -o part.isr --iso 0 --frames 40ms:0.16s --json")["frames"], 3);
}

TEST_F(CutTest, CutsOfAFileFitTogetherAgain) {
  std::mt19937 random(7);
  for (int round = 0; round < 2; ++round) {
    std::string names;
    int part = 0;
    for (std::size_t from = 0; from < 8; ++part) {
      const std::size_t to = std::min<std::size_t>(8, from + 1 + random() % 4);
      ok(fmt::format("isoreel trim seq.isr -o {}.isr --from {} --to {} --force", part, from, to));
      names += fmt::format(" {}.isr", part);
      from = to;
    }
    const auto totals = json("isoreel concat --json --force -o joined.isr" + names);
    EXPECT_EQ(totals["hidden"], 0);
    EXPECT_EQ(content("joined.isr"), content("seq.isr")) << names;
  }
  // In another order, what cuts need stays.
  ok("isoreel trim seq.isr -o a.isr --from 4 --to 6 && isoreel trim seq.isr -o b.isr --from 2 --to 4");
  EXPECT_EQ(json("isoreel concat a.isr b.isr a.isr -o mixed.isr --json")["hidden"], 1 + 2 + 0);
  const auto all = hashes("seq.isr");
  EXPECT_EQ(hashes("mixed.isr"),
            (std::vector<std::uint64_t>{all[4], all[5], all[2], all[3], all[4], all[5]}));
  ok("isoreel verify mixed.isr");
}

TEST_F(CutTest, ConcatOfFilesThatDiffer) {
  ok("isoreel encode seq.json -o fine.isr --iso 0.2 --step 1/64 --fps 30 --frame-types intra --tag other=1");
  const auto totals = json("isoreel concat seq.isr fine.isr -o joined.isr --json");
  EXPECT_EQ(totals["frames"], 16);
  EXPECT_EQ(totals["shards"], false);
  auto expected = hashes("seq.isr");
  const auto more = hashes("fine.isr");
  expected.insert(expected.end(), more.begin(), more.end());
  EXPECT_EQ(hashes("joined.isr"), expected);
  ok("isoreel verify joined.isr");
  const auto joined = times("joined.isr");
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_DOUBLE_EQ(joined[i], static_cast<double>(i) / 25);
    EXPECT_DOUBLE_EQ(joined[8 + i], 8.0 / 25 + static_cast<double>(i) / 30);
  }
  const auto info = json("isoreel info joined.isr --json");
  EXPECT_EQ(info["tags"]["title"], "balls");
  EXPECT_EQ(info["tags"]["other"], "1");
  EXPECT_EQ(info["time_base"], (std::vector<int>{1, 150}));
  fails("isoreel concat seq.isr fine.isr -o kept.isr --times keep", 1, "fine.isr: frame 0");
  EXPECT_FALSE(there("kept.isr") || there("kept.isr.part"));
  volume("small", 17, [](double x, double y, double z) { return 5 - std::hypot(x - 8, y - 8, z - 8); });
  ok("isoreel encode small.json -o small.isr --iso 0");
  fails("isoreel concat seq.isr small.isr -o x.isr", 1, "small.isr: the size of the grid differs");
  ok("isoreel encode seq.json -o below.isr --iso 0 --inside below");
  fails("isoreel concat seq.isr below.isr -o x.isr", 1, "inside");
}

TEST_F(CutTest, ChaptersAndAttachmentsComeAlong) {
  write("note.txt", "what this is");
  write("other.txt", "more");
  ok("isoreel chapter seq.isr --add 0:3=Fall --add 3:8=Splash --marker 0.2s=Impact && isoreel attach seq.isr "
     "note.txt");
  ok("isoreel trim seq.isr -o a.isr --from 2 --to 5 && isoreel trim seq.isr -o b.isr --from 5");
  const auto cut = json("isoreel info a.isr --json");
  ASSERT_EQ(cut["chapters"].size(), 2u) << cut["chapters"];
  EXPECT_EQ(cut["chapters"][0]["title"], "Fall");
  EXPECT_DOUBLE_EQ(cut["chapters"][0]["start"], 0.08);
  EXPECT_DOUBLE_EQ(cut["chapters"][0]["end"], 0.12);
  EXPECT_DOUBLE_EQ(cut["chapters"][1]["end"], 0.2);
  EXPECT_EQ(json("isoreel info b.isr --json")["chapters"].size(), 2u) << "the marker at its start, too";
  EXPECT_EQ(cut["attachments"][0]["name"], "note.txt");
  ok("isoreel attach b.isr other.txt && isoreel concat b.isr a.isr -o joined.isr");
  const auto joined = json("isoreel info joined.isr --json");
  ASSERT_EQ(joined["chapters"].size(), 4u);
  EXPECT_EQ(joined["chapters"][2]["title"], "Fall");
  EXPECT_DOUBLE_EQ(joined["chapters"][2]["start"], 0.32) << "where b ends";
  EXPECT_EQ(joined["attachments"].size(), 2u);
  ok("isoreel extract joined.isr note.txt -o back.txt && isoreel verify joined.isr");
  EXPECT_EQ(content("back.txt"), "what this is");
}

TEST_F(CutTest, ShardsAreTheSerialFile) {
  // Two GOPs and a half, over one to seven machines.
  const std::string encode = "isoreel encode seq.json --iso 0 --gop 3 --tag title=balls --force";
  for (const std::vector<int>& cuts : {std::vector<int>{0, 8}, {0, 3, 8}, {0, 6, 8}, {0, 3, 6, 8}}) {
    std::string names;
    for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
      ok(fmt::format("{} -o s{}.isr --frames {}:{}", encode, i, cuts[i], cuts[i + 1]));
      names = fmt::format(" s{}.isr", i) + names;  // the last first
    }
    ok("isoreel concat -o joined.isr --force" + names);
    EXPECT_EQ(content("joined.isr"), content("seq.isr")) << names;
  }
  const std::string other = "isoreel encode seq.json --gop 1 --track low=0 --track high=0.5 --parity 20";
  ok(other + " -o intra.isr");
  std::string names;
  for (int i = 0; i < 7; ++i) {
    ok(fmt::format("{} -o t{}.isr --frames {}:{}", other, i, i, i == 6 ? 8 : i + 1));
    names += fmt::format(" t{}.isr", i);
  }
  EXPECT_EQ(json("isoreel concat --json --parity 20 -o seven.isr" + names)["shards"], true);
  EXPECT_EQ(content("seven.isr"), content("intra.isr"));
}

TEST_F(CutTest, ShardsThatDoNotFitAreListed) {
  const std::string encode = "isoreel encode seq.json --iso 0 --gop 3 --force";
  for (const char* range : {"0:3", "3:6", "2:6", "6:8"})
    ok(fmt::format("{} -o {}.isr --frames {}", encode, std::string(range).replace(1, 1, "_"), range));
  fails("isoreel concat 0_3.isr 6_8.isr -o x.isr", 1, "frames 3:6 are missing");
  fails("isoreel concat 3_6.isr -o x.isr", 1, "frames 0:3 are missing; frames 6:8 are missing");
  fails("isoreel concat 0_3.isr 2_6.isr 6_8.isr -o x.isr", 1, "frames 2:3 are in 0_3.isr and in 2_6.isr");
  fails("isoreel concat 0_3.isr 2_6.isr 6_8.isr -o x.isr", 1, "2_6.isr starts at frame 2, inside a GOP of 3");
  ok(encode + " -o other.isr --frames 3:6 --step 1/32");
  fails("isoreel concat 0_3.isr other.isr 6_8.isr -o x.isr", 1,
        "other.isr: a setting is not that of 0_3.isr");
  EXPECT_FALSE(there("x.isr") || there("x.isr.part"));
  EXPECT_EQ(json("isoreel concat 0_3.isr 6_8.isr -o x.isr --no-shards --json")["frames"], 5);
  ok("isoreel verify x.isr");
  ok("isoreel trim 3_6.isr -o cut.isr --from 1");
  EXPECT_EQ(json("isoreel concat 0_3.isr cut.isr -o y.isr --json")["shards"], false);
}

}  // namespace
}  // namespace isoreel::cli
