// SPDX-License-Identifier: BSD-3-Clause
// render and demo.
#include <chrono>
#include <csignal>
#include <cstdio>
#include <thread>

#include "support.h"

namespace isoreel::cli {
namespace {

class PngTest : public CliTest {
 protected:
  /// Width and height of a PNG, "" when it is none.
  std::string size(const std::string& name) const {
    const std::string png = content(name);
    if (png.size() < 24 || png.compare(0, 8, "\x89PNG\r\n\x1a\n") != 0) return "";
    const auto number = [&](std::size_t at) {
      unsigned value = 0;
      for (std::size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(png[at + i]);
      return value;
    };
    return fmt::format("{}x{}", number(16), number(20));
  }
};

class PicturesTest : public PngTest {
 protected:
  PicturesTest() {
    sequence();
    ok("isoreel encode seq.json -o seq.isr --iso 0");
  }
};

class DemoTest : public PngTest {};

TEST_F(PicturesTest, OneFrameOfTheSizeThatWasAskedFor) {
  ok("isoreel render seq.isr -o a.png --frames 2 --size 64x48");
  EXPECT_EQ(size("a.png"), "64x48");
  ok("isoreel render seq.isr -o again.png --frames 2 --size 64x48 --jobs 1");
  EXPECT_EQ(content("a.png"), content("again.png"));
  // Everything that changes the picture does.
  for (const char* option : {"--frames 3", "--frames 2 --facets", "--frames 2 --camera=-60,10",
                             "--frames 2 --zoom 2", "--frames 7"}) {
    ok(fmt::format("isoreel render seq.isr -o b.png --size 64x48 --force {}", option));
    EXPECT_EQ(size("b.png"), "64x48") << option;
    EXPECT_NE(content("b.png"), content("a.png")) << option;
  }
}

TEST_F(PicturesTest, NumberedPicturesShareACamera) {
  ok("isoreel render seq.isr -o p/%05d.png --size 48x32 --frames 1:4");
  EXPECT_EQ(list("p"), (std::vector<std::string>{"00001.png", "00002.png", "00003.png"}));
  for (const std::string& name : list("p")) EXPECT_EQ(size("p/" + name), "48x32");
  EXPECT_NE(content("p/00001.png"), content("p/00003.png"));
}

TEST_F(PicturesTest, AContactSheetHoldsTheSequence) {
  ok("isoreel render seq.isr -o all.png --size 48x32");
  ok("isoreel render seq.isr -o four.png --size 48x32 --tiles 4");
  unsigned width = 0, height = 0, small_width = 0, small_height = 0;
  ASSERT_EQ(std::sscanf(size("all.png").c_str(), "%ux%u", &width, &height), 2);
  ASSERT_EQ(std::sscanf(size("four.png").c_str(), "%ux%u", &small_width, &small_height), 2);
  EXPECT_GE(width, 3 * 48u);  // eight pictures in rows of three
  EXPECT_GE(height, 3 * 32u);
  EXPECT_GE(small_width, 2 * 48u);
  EXPECT_LT(small_width, width);
  EXPECT_LT(small_height, height);
}

TEST_F(PicturesTest, EveryStyleChangesThePicture) {
  ok("isoreel render seq.isr -o a.png --frames 2 --size 64x48");
  for (const char* option :
       {"--wireframe", "--color curvature", "--color error --volumes seq.json", "--level -1", "--view top"}) {
    ok(fmt::format("isoreel render seq.isr -o b.png --frames 2 --size 64x48 --force {}", option));
    EXPECT_EQ(size("b.png"), "64x48") << option;
    EXPECT_NE(content("b.png"), content("a.png")) << option;
    ok(fmt::format("isoreel render seq.isr -o c.png --frames 2 --size 64x48 --force --jobs 1 {}", option));
    EXPECT_EQ(content("b.png"), content("c.png")) << option;
  }
  ok("isoreel render seq.isr -o c.png --frames 2 --size 64x48 --force --camera 0,90");
  ok("isoreel render seq.isr -o b.png --frames 2 --size 64x48 --force --view top");
  EXPECT_EQ(content("b.png"), content("c.png"));
}

TEST_F(PicturesTest, AnOrbitTurnsTheCamera) {
  ok("isoreel render seq.isr -o o/%d.png --size 32x24 --orbit 360");
  ok("isoreel render seq.isr -o s/%d.png --size 32x24 --orbit 1e-9");
  EXPECT_EQ(content("o/0.png"), content("s/0.png"));
  EXPECT_NE(content("o/3.png"), content("s/3.png"));
}

TEST_F(PicturesTest, TwoFilesSideBySide) {
  ok("isoreel encode seq.json -o other.isr --iso 0 --step 1/2");
  const auto totals = nlohmann::json::parse(
      ok("isoreel render seq.isr --beside other.isr -o b.png --frames 2 --size 64x48 --json"));
  EXPECT_EQ(totals["frames"], 1);
  EXPECT_GT(totals["width"], 128);
  ok("isoreel encode seq.json -o short.isr --iso 0 --frames 0:2");
  fails("isoreel render seq.isr --beside short.isr -o c.png --size 64x48", 1, "short.isr has 2 frames");
}

TEST_F(PicturesTest, TheMotionOverlayIsDrawnEverywhere) {
  const std::string render = "isoreel render seq.isr --overlay motion --size 96x72 ";
  ok("isoreel render seq.isr -o plain.png --frames 2 --size 96x72");
  ok(render + "-o a.png --frames 2");
  ok(render + "-o b.png --frames 2 --jobs 1");
  ok(render + "-o c.png --frames 2 --overlay-scale 7");
  EXPECT_NE(content("a.png"), content("plain.png"));
  EXPECT_EQ(content("a.png"), content("b.png"));
  EXPECT_NE(content("a.png"), content("c.png"));
  ok(render + "-o sheet.png");
  ok("isoreel render seq.isr -o plain_sheet.png --size 96x72");
  EXPECT_EQ(size("sheet.png"), size("plain_sheet.png"));
  EXPECT_NE(content("sheet.png"), content("plain_sheet.png"));
  ok(render + "-o m.mp4 --beside seq.isr --color curvature");
  EXPECT_EQ(content("m.mp4").substr(4, 4), "ftyp");
}

TEST_F(PicturesTest, AMovieIsWholeOrNotThere) {
  ok("isoreel render seq.isr -o m.mp4 --size 33x25");
  EXPECT_EQ(content("m.mp4").substr(4, 4), "ftyp");
  const std::string movie = content("m.mp4");
  EXPECT_LT(movie.find("moov"), movie.find("mdat"));  // starts before it is all there
  ok("isoreel render seq.isr -o again.mp4 --size 33x25 --jobs 1");
  EXPECT_EQ(content("again.mp4"), movie);
  fails("isoreel render seq.isr -o m.mp4 --size 32x24", 1, "--force");
  longSequence(300);
  ok("isoreel encode long.json -o long.isr --iso 0");
  const pid_t process = start("isoreel render long.isr -o cut.mp4 --size 160x120");
  for (int i = 0; i < 1000 && !there("cut.mp4.part"); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  kill(process, SIGTERM);
  EXPECT_EQ(wait(process), 1);
  EXPECT_FALSE(there("cut.mp4"));
  EXPECT_FALSE(there("cut.mp4.part"));
}

TEST_F(PicturesTest, WrongUsage) {
  for (const char* bad : {"64", "0x0", "15x48", "64x99999", "64x48x2", "-64x48"})
    fails(fmt::format("isoreel render seq.isr -o x.png --size={}", bad), 2, "--size");
  for (const char* bad : {"1", "1,2,3", "a,b", "nan,0"})
    fails(fmt::format("isoreel render seq.isr -o x.png --camera={}", bad), 2, "--camera");
  fails("isoreel render seq.isr -o x.png --zoom 0", 2, "--zoom");
  fails("isoreel render seq.isr -o x.png --tiles 0", 2, "--tiles");
  fails("isoreel render seq.isr -o x.png --frames 9", 2, "--frames");
  fails("isoreel render seq.isr -o x.jpg", 2, "'x.jpg' does not end in .png or .mp4");
  fails("isoreel render seq.isr -o %d.mp4", 2, "a movie holds all");
  fails("isoreel render seq.isr -o x.png --fps 5", 2, "--fps");
  fails("isoreel render seq.isr -o x.png --color error", 2, "--volumes");
  fails("isoreel render seq.isr -o x.png --volumes seq.json", 2, "--color error");
  fails("isoreel render seq.isr -o x.png --color hue", 2, "--color");
  fails("isoreel render seq.isr -o x.png --range 1", 2, "--range");
  fails("isoreel render seq.isr -o x.png --overlay speed", 2, "--overlay");
  fails("isoreel render seq.isr -o x.png --overlay-scale 2", 2, "--overlay-scale");
  fails("isoreel render seq.isr -o x.png --overlay motion --overlay-scale 0", 2, "--overlay-scale");
  fails("isoreel render seq.isr -o x.png --overlay motion --level -1", 2, "--level");
  fails("isoreel render seq.isr -o x.png --view up", 2, "--view");
  fails("isoreel render seq.isr -o %s.png", 2, "%05d");
  fails("isoreel render seq.isr", 2, "--output");
  write("x.png", "mine");
  fails("isoreel render seq.isr -o x.png", 1, "x.png: is there already (--force replaces it)");
  EXPECT_EQ(content("x.png"), "mine");
}

TEST_F(DemoTest, TheDemoDoesWhatItSays) {
  if (!std::filesystem::exists(ISOREEL_DATA "/droplets")) GTEST_SKIP() << "no bundled sequence";
  const std::string text = ok("isoreel demo -o out");
  for (const char* verb : {"encode", "info", "verify", "decode", "compare", "render"})
    EXPECT_NE(text.find(std::string("\n$ isoreel ") + verb), std::string::npos) << verb;
  for (const char* size : {"PLY", "zstd", "droplets.isr"})
    EXPECT_NE(text.find(size), std::string::npos) << size;
  EXPECT_TRUE(there("out/droplets.isr"));
  EXPECT_EQ(size("out/frame.png"), "1280x960");
  EXPECT_NE(size("out/contact.png"), "");
  EXPECT_FALSE(there("out/droplets.isr.part"));
  std::size_t meshes = 0;
  for (const std::string& name : list("out")) meshes += name.ends_with(".ply") ? 1u : 0u;
  EXPECT_EQ(meshes, 1u);
  // The commands that it shows work as they stand, from here.
  ok("isoreel verify out/droplets.isr");
  const auto totals = json("isoreel encode " ISOREEL_DATA "/droplets -o again.isr --json");
  EXPECT_EQ(totals["frames"], 12);
  EXPECT_EQ(content("again.isr"), content("out/droplets.isr"));
}

}  // namespace
}  // namespace isoreel::cli
