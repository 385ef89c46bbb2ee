// SPDX-License-Identifier: BSD-3-Clause
// encode: isovalues, sides, odd volumes, times, tags.
#include <cmath>
#include <limits>

#include "support.h"

namespace isoreel::cli {
namespace {

class InputTest : public CliTest {
 protected:
  nlohmann::json frames(const std::string& file) const {
    return json("isoreel info " + file + " --frames --json")["frame_list"];
  }
};

TEST_F(InputTest, OneVolumeAtSeveralIsovalues) {
  balls("ball", 17, {{{8, 8, 8}, 6}});
  ok("isoreel encode ball.json -o scan.isr --iso -1,0,1.5,3 --frame-types intra");
  ok("isoreel verify scan.isr");
  const auto list = frames("scan.isr");
  ASSERT_EQ(list.size(), 4u);
  EXPECT_EQ(list[0]["isovalue"], -1.0);
  EXPECT_EQ(list[2]["isovalue"], 1.5);
  for (std::size_t i = 1; i < 4; ++i) EXPECT_LT(list[i]["volume"], list[i - 1]["volume"]);
  EXPECT_LT(json("isoreel compare scan.isr ball.json --samples 2000 --json")["extracted"]["rms"], 0.05);
  ok("isoreel encode ball.json -o part.isr --iso -1,0,1.5,3 --frames 2: --frame-types intra");
  const auto part = frames("part.isr");
  ASSERT_EQ(part.size(), 2u);
  EXPECT_EQ(part[0]["hash"], list[2]["hash"]);
}

TEST_F(InputTest, IsovaluesAreRequiredAndAsManyAsFrames) {
  sequence();
  fails("isoreel encode seq.json -o x.isr", 2, "--iso: is required");
  fails("isoreel encode seq.json -o x.isr --iso 0,1", 2, "2 values for 8 volumes");
  for (const char* bad : {"x", "0,", "nan", "inf", "0,,1", "1e999"})
    fails(fmt::format("isoreel encode seq.json -o x.isr --iso {}", bad), 2, "--iso");
  EXPECT_FALSE(there("x.isr"));
  EXPECT_FALSE(there("x.isr.part"));
  ok("isoreel encode seq.json -o x.isr --iso 0,0,0,1,0,0,0,0");
  EXPECT_EQ(frames("x.isr")[3]["isovalue"], 1.0);
}

TEST_F(InputTest, LevelSetsNeedNoIsovalueAndAreInsideBelow) {
  balls("ball", 17, {{{8, 8, 8}, 5}});
  auto description = nlohmann::json::parse(content("ball.json"));
  description["levelset"] = true;
  write("set.json", description.dump());
  ok("isoreel encode set.json -o set.isr");
  const auto info = json("isoreel info set.isr --json --frames");
  EXPECT_EQ(info["inside"], "below");
  EXPECT_EQ(info["frame_list"][0]["isovalue"], 0.0);
  ok("isoreel encode set.json -o above.isr --inside above");
  EXPECT_EQ(json("isoreel info above.isr --json")["inside"], "above");
}

TEST_F(InputTest, InsideTurnsTheSurfaceInsideOut) {
  balls("ball", 17, {{{8, 8, 8}, 5.2}});
  ok("isoreel encode ball.json -o above.isr --iso 0 --inside above && isoreel encode ball.json -o below.isr "
     "--iso 0 "
     "--inside below");
  const double ball = 4 / 3.0 * 3.14159265 * std::pow(5.2, 3);
  EXPECT_NEAR(frames("above.isr")[0]["volume"].get<double>(), ball, 15);
  // Outside is what lies beyond the border of the grid: the box around the nodes, less the ball.
  EXPECT_GT(frames("below.isr")[0]["volume"].get<double>(), std::pow(16.0, 3) - ball - 15);
  ok("isoreel verify below.isr");
  fails("isoreel encode ball.json -o x.isr --iso 0 --inside left", 2, "'left' is not above or below");
}

TEST_F(InputTest, SamplesThatAreNotFinite) {
  const auto with = [&](const std::string& name, double odd) {
    volume(name, 17, [&](double x, double y, double z) {
      if (x == 3 && y == 5 && z == 7) return odd;
      return 5 - std::hypot(x - 8, y - 8, z - 8);
    });
  };
  with("nan", std::numeric_limits<double>::quiet_NaN());
  with("infinite", -std::numeric_limits<double>::infinity());
  balls("good", 17, {{{8, 8, 8}, 5}});
  fails("isoreel encode nan.json -o x.isr --iso 0", 1, "nan.raw: sample at node (3, 5, 7) is not a number");
  fails("isoreel encode infinite.json -o x.isr --iso 0", 1,
        "infinite.raw: sample at node (3, 5, 7) is -infinity");
  EXPECT_FALSE(there("x.isr"));
  EXPECT_FALSE(there("x.isr.part"));  // no frame was done
  fails("isoreel encode nan.json -o x.isr --iso 0 --nan inside", 2, "'inside' is not error or outside");
  fails("isoreel encode nan.json -o x.isr --iso 0 --nan 1", 2, "--nan");
  for (const char* name : {"nan", "infinite"}) {
    ok(fmt::format("isoreel encode {0}.json -o {0}.isr --iso 0 --nan outside && isoreel verify {0}.isr",
                   name));
    EXPECT_EQ(frames(fmt::format("{}.isr", name))[0]["components"], 1);
  }
  // A frame in the middle: the message says which, and what is kept.
  const Outcome outcome = sh("isoreel encode good.json good.json nan.json good.json -o x.isr --iso 0");
  EXPECT_EQ(outcome.code, 1);
  EXPECT_NE(outcome.err.find("nan.raw"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("2 frames, is in x.isr.part"), std::string::npos) << outcome.err;
  EXPECT_FALSE(there("x.isr"));
  EXPECT_EQ(json("isoreel info x.isr.part --json")["frames"], 2);
  ok("isoreel decode x.isr.part -o kept/%d.ply");
  EXPECT_EQ(list("kept"), (std::vector<std::string>{"0.ply", "1.ply"}));
}

TEST_F(InputTest, VolumesWithoutASurface) {
  volume("outside", 9, [](double, double, double) { return -1.0; });
  volume("inside", 9, [](double, double, double) { return 1.0; });
  volume("equal", 9, [](double, double, double) { return 0.0; });
  ok("isoreel encode outside.json inside.json equal.json -o none.isr --iso 0 && isoreel verify none.isr");
  const auto list = frames("none.isr");
  EXPECT_EQ(list[0]["faces"], 0);
  // A volume that is all inside ends at the border of the grid, or nowhere: either way all its samples say
  // the same.
  EXPECT_EQ(list[1]["hash"] == list[2]["hash"], list[1]["faces"] == list[2]["faces"]);
  EXPECT_EQ(json("isoreel compare none.isr outside.json --frames 0 --json --samples 1000")["volume"]["max"],
            0.0);
  ok("isoreel decode none.isr -o %d.obj && isoreel render none.isr -o none.png --size 32x32");
}

TEST_F(InputTest, IsovalueEqualToSamples) {
  volume("steps", 17, [](double x, double y, double z) {
    return std::round(6 - std::max({std::abs(x - 8), std::abs(y - 8), std::abs(z - 8)}));
  });
  for (const char* inside : {"above", "below"}) {
    ok(fmt::format("isoreel encode steps.json -o s.isr --iso 0,1,2,3 --inside {} --force", inside));
    ok("isoreel verify s.isr && isoreel decode s.isr -o %d.obj --force");
    for (int i = 0; i < 4; ++i)
      EXPECT_TRUE(closed(parseObj(content(fmt::format("{}.obj", i))))) << inside << i;
    for (const auto& frame : frames("s.isr")) {
      EXPECT_GT(frame["faces"], 0);
      EXPECT_EQ(frame["components"], 1);
    }
  }
}

TEST_F(InputTest, TheSmallestGridAndFlatOnes) {
  volume("two", 2, [](double x, double y, double z) { return x + y + z - 0.5; });
  ok("isoreel encode two.json -o two.isr --iso 0 && isoreel verify two.isr && isoreel decode two.isr -o "
     "two.ply");
  EXPECT_EQ(frames("two.isr").size(), 1u);
}

TEST_F(InputTest, GridsThatChangeSize) {
  balls("a", 17, {{{8, 8, 8}, 5}});
  balls("b", 18, {{{8, 8, 8}, 5}});
  fails("isoreel encode a.json b.json -o x.isr --iso 0", 1, "a.raw");
  fails("isoreel encode a.json b.json -o x.isr --iso 0", 1, "b.raw");
  EXPECT_FALSE(there("x.isr.part"));
}

TEST_F(InputTest, FilesThatAreMissingCutOrNoVolumes) {
  balls("a", 17, {{{8, 8, 8}, 5}});
  write("text", "hello");
  fails("isoreel encode nope.json -o x.isr --iso 0", 1, "nope.json: no such file");
  fails("isoreel encode text -o x.isr --iso 0", 1, "text: not a volume file");
  write("a.raw", content("a.raw").substr(4));
  fails("isoreel encode a.json -o x.isr --iso 0", 1, "a.raw");
  std::filesystem::remove(path("a.raw"));
  fails("isoreel encode a.json -o x.isr --iso 0", 1, "a.raw");
  EXPECT_FALSE(there("x.isr.part"));
}

TEST_F(InputTest, PatternsFoldersAndListsAreTheSame) {
  sequence();
  std::filesystem::create_directory(path("in"));
  for (int i = 0; i < 8; ++i) {
    const std::string name = fmt::format("step_{:02}", i);
    std::filesystem::copy(path(name + ".raw"), path("in/" + name + ".raw"));
    std::filesystem::copy(path(name + ".json"), path("in/" + name + ".json"));
  }
  ok("isoreel encode seq.json -o a.isr --iso 0 --tag source=x");
  ok("isoreel encode step_0?.json -o b.isr --iso 0 --tag source=x");
  ok("isoreel encode step_%02d.json -o c.isr --iso 0 --tag source=x");
  ok("isoreel encode 'step_0?.json' -o d.isr --iso 0 --tag source=x");  // a glob that the shell leaves alone
  for (const char* other : {"b.isr", "c.isr", "d.isr"}) EXPECT_EQ(content("a.isr"), content(other)) << other;
}

TEST_F(InputTest, FramesPerSecondAreExact) {
  sequence();
  ok("isoreel encode seq.json -o a.isr --iso 0 --fps 30000/1001");
  const auto info = json("isoreel info a.isr --frames --json");
  EXPECT_EQ(info["time_base"], (std::vector<int>{1001, 30000}));
  EXPECT_NEAR(info["frame_list"][7]["time"].get<double>(), 7 * 1001.0 / 30000, 1e-12);
  ok("isoreel encode seq.json -o b.isr --iso 0 --fps 12.5");
  EXPECT_EQ(json("isoreel info b.isr --json")["time_base"], (std::vector<int>{2, 25}));
  for (const char* bad : {"0", "-1", "x", "1/0", "99999999999", "1/99999999999", "24fps"})
    fails(fmt::format("isoreel encode seq.json -o c.isr --iso 0 --fps {}", bad), 2, "--fps");
}

TEST_F(InputTest, TimesFromAFile) {
  sequence();
  write("times", "# seconds\n0\n0.5\n\n1/3+\n");
  fails("isoreel encode seq.json -o x.isr --iso 0 --times times", 2, "times line 5: '1/3+' is no number");
  write("times", "0\n0.5  # half\n 0.75\n1\n\n1\n2\n3\n4\n");
  fails("isoreel encode seq.json -o x.isr --iso 0 --times times", 2,
        "times line 6: the time does not come after");
  write("times", "0\n1\n");
  fails("isoreel encode seq.json -o x.isr --iso 0 --times times", 2, "times: 2 times for 8 frames");
  write("times", "0\n1\n2\n3\n4\n5\n6\n99999999999999999999\n");
  fails("isoreel encode seq.json -o x.isr --iso 0 --times times", 2, "times line 8");
  fails("isoreel encode seq.json -o x.isr --iso 0 --times nope", 2, "nope: cannot be read");
  fails("isoreel encode seq.json -o x.isr --iso 0 --times times --fps 25", 2, "--times");
  EXPECT_FALSE(there("x.isr.part"));
  write("times", "-1\r\n-1/3\r\n0.25 # a comment\n\n1\n1.5\n2\n3\n10\n");
  ok("isoreel encode seq.json -o t.isr --iso 0 --times times && isoreel verify t.isr");
  const auto list = frames("t.isr");
  const std::array<double, 8> expected{-1, -1 / 3.0, 0.25, 1, 1.5, 2, 3, 10};
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_NEAR(list[i]["time"].get<double>(), expected[i], 1e-12) << i;
    EXPECT_NEAR(list[i]["duration"].get<double>(), i < 7 ? expected[i + 1] - expected[i] : 7, 1e-12) << i;
  }
  ok("isoreel encode seq.json -o part.isr --iso 0 --times times --frames 2:4");
  EXPECT_NEAR(frames("part.isr")[0]["time"].get<double>(), 0.25, 1e-12);
  EXPECT_EQ(frames("part.isr")[0]["number"], 0);
}

TEST_F(InputTest, ArraysAndTimesOfVolumeFiles) {
  if (ok("isoreel encode --help").find("MetaImage, VTI") == std::string::npos)
    GTEST_SKIP() << "built without VTI";
  const auto vti = [&](const std::string& name, double time) {
    write(name, fmt::format(R"(<VTKFile type="ImageData" byte_order="LittleEndian">
<ImageData WholeExtent="0 2 0 1 0 1"><FieldData><DataArray type="Float64" Name="TimeValue">{}</DataArray></FieldData>
<Piece Extent="0 2 0 1 0 1"><PointData>
<DataArray type="Int8" Name="a" format="ascii">0 0 1 0 0 1 0 0 1 0 0 1</DataArray>
<DataArray type="Int8" Name="b" format="ascii">0 1 1 0 1 1 0 1 1 0 1 1</DataArray>
</PointData></Piece></ImageData></VTKFile>)",
                            time));
  };
  vti("f_9.vti", 0.1);
  vti("f_10.vti", 0.14);
  vti("f_11.vti", 0.2);
  fails("isoreel encode 'f_*.vti' -o x.isr --iso 0.5", 1, "f_9.vti: choose an array by name");
  ok("isoreel encode 'f_*.vti' -o a.isr --iso 0.5 --array a && isoreel encode 'f_*.vti' -o b.isr --iso 0.5 "
     "--array b");
  ok("isoreel encode 'f_*.vti' -o c.isr --iso 0.5 --grid b");
  EXPECT_EQ(content("b.isr"), content("c.isr"));
  EXPECT_NE(frames("a.isr")[0]["hash"], frames("b.isr")[0]["hash"]);
  EXPECT_LT(json("isoreel compare b.isr 'f_*.vti' --array b --samples 1000 --json")["extracted"]["rms"],
            0.05);
  EXPECT_EQ(json("isoreel info a.isr --json")["time_base"], (std::vector<int>{1, 50}));
  const auto list = frames("a.isr");
  for (const auto& [i, time, duration] : {std::tuple(0u, 0.1, 0.04), {1u, 0.14, 0.06}, {2u, 0.2, 0.06}}) {
    EXPECT_NEAR(list[i]["time"].get<double>(), time, 1e-12);
    EXPECT_NEAR(list[i]["duration"].get<double>(), duration, 1e-12);
  }
  ok("isoreel encode 'f_*.vti' -o d.isr --iso 0.5 --array a --fps 10");
  EXPECT_EQ(frames("d.isr")[2]["time"], 0.2);
  vti("f_11.vti", 0.14);  // times that do not rise are none
  ok("isoreel encode 'f_*.vti' -o e.isr --iso 0.5 --array a");
  EXPECT_EQ(frames("e.isr")[2]["time"], 0.08);
}

TEST_F(InputTest, TagsAreKept) {
  balls("ball", 9, {{{4, 4, 4}, 3}});
  ok("isoreel encode ball.json -o t.isr --iso 0 --tag who=me --tag 'title=a = b, ü \"quoted\"' --tag empty=");
  const auto tags = json("isoreel info t.isr --json")["tags"];
  EXPECT_EQ(tags["who"], "me");
  EXPECT_EQ(tags["title"], "a = b, ü \"quoted\"");
  EXPECT_EQ(tags["empty"], "");
  EXPECT_TRUE(tags["software"].get<std::string>().starts_with("isoreel "));
  fails("isoreel encode ball.json -o x.isr --iso 0 --tag who", 2, "'who' is not KEY=VALUE");
  fails("isoreel encode ball.json -o x.isr --iso 0 --tag =me", 2, "KEY=VALUE");
  ok("isoreel encode ball.json -o odd.isr --iso 0 --tag \"odd=$(printf 'a\\033[31mb')\"");
  EXPECT_EQ(ok("isoreel info odd.isr").find('\033'), std::string::npos);  // no orders to the terminal
  EXPECT_EQ(json("isoreel info odd.isr --json")["tags"]["odd"], "a\033[31mb");
}

TEST_F(InputTest, VertexPlacementsDiffer) {
  sequence();
  ok("isoreel encode seq.json -o q.isr --iso 0 --fit extracted --vertex qef && isoreel encode seq.json "
     "-o c.isr --iso 0 --fit extracted --vertex centroid");
  EXPECT_EQ(frames("q.isr")[0]["vertices"], frames("c.isr")[0]["vertices"]);
  EXPECT_NE(frames("q.isr")[0]["hash"], frames("c.isr")[0]["hash"]);
  fails("isoreel encode seq.json -o x.isr --iso 0 --vertex best", 2, "'best' is not centroid or qef");
  for (const char* bad : {"0", "2", "-1/2", "1/20000", "x", "1/0"})
    fails(fmt::format("isoreel encode seq.json -o x.isr --iso 0 --step {}", bad), 2, "--step");
}

}  // namespace
}  // namespace isoreel::cli
