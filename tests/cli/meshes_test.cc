// SPDX-License-Identifier: BSD-3-Clause
// decode: which frames, which names, which levels, which formats.
#include <cmath>
#include <regex>

#include "support.h"

namespace isoreel::cli {
namespace {

class MeshesTest : public CliTest {
 protected:
  MeshesTest() {
    sequence();
    ok("isoreel encode seq.json -o seq.isr --iso 0 --frame-types intra");
  }
  using Names = std::vector<std::string>;
};

TEST_F(MeshesTest, FramesBySeekAreThoseOfTheWhole) {
  ok("isoreel decode seq.isr -o all/%05d.ply");
  ASSERT_EQ(list("all").size(), 8u);
  for (const int frame : {5, 0, 7, 3, 2}) {
    ok(fmt::format("isoreel decode seq.isr -o seek.ply --force --frames {}", frame));
    EXPECT_EQ(content("seek.ply"), content(fmt::format("all/{:05}.ply", frame))) << frame;
    ok(fmt::format("cat seq.isr | isoreel decode - -o seek.ply --force --frames {}", frame));
    EXPECT_EQ(content("seek.ply"), content(fmt::format("all/{:05}.ply", frame))) << frame;
  }
}

TEST_F(MeshesTest, NamesCountFramesOfTheFile) {
  ok("isoreel decode seq.isr -o a/%05d.obj --frames 3:5");
  EXPECT_EQ(list("a"), (Names{"00003.obj", "00004.obj"}));
  ok("isoreel decode seq.isr -o b/x%dy.ply --frames 6:");
  EXPECT_EQ(list("b"), (Names{"x6y.ply", "x7y.ply"}));
  ok("isoreel decode seq.isr -o c/%02d.PLY --frames :1");
  EXPECT_EQ(list("c"), (Names{"00.PLY"}));
  ok("isoreel decode seq.isr -o d/%03d.ply --frames 4");
  EXPECT_EQ(list("d"), (Names{"004.ply"}));
  ok("cat seq.isr | isoreel decode - -o e/%d.ply --frames 2:4");
  EXPECT_EQ(list("e"), (Names{"2.ply", "3.ply"}));
}

TEST_F(MeshesTest, SeveralFramesNeedANameThatCounts) {
  fails("isoreel decode seq.isr -o one.ply", 2, "'one.ply' must count frames");
  fails("isoreel decode seq.isr -o one.ply --frames 2:4", 2, "must count frames");
  fails("cat seq.isr | isoreel decode - -o one.ply", 2, "must count frames");
  EXPECT_FALSE(there("one.ply"));
  fails("isoreel decode seq.isr -o %x.ply", 2, "%05d");
  fails("isoreel decode seq.isr -o %d_%d.ply", 2, "%05d");
  fails("isoreel decode seq.isr", 2, "--output");
  fails("isoreel decode seq.isr -o x/%d.ply --discard", 2, "--discard");
  fails("isoreel decode seq.isr -o x/%d.stp", 2, ".ply .obj");
  fails("isoreel decode seq.isr -o x/%d", 2, ".ply .obj");
  EXPECT_FALSE(there("x"));
}

TEST_F(MeshesTest, FramesOutsideTheFileAreRefused) {
  for (const char* range : {"8", "8:", "3:9", "5:5", "5:3", "x", "-1", "1:2:3"}) {
    fails(fmt::format("isoreel decode seq.isr --discard --frames={}", range), 2, "--frames");
  }
  fails("cat seq.isr | isoreel decode - --discard --frames 3:9", 1, "8 frames");
  fails("cat seq.isr | isoreel decode - --discard --frames 8:", 1, "8 frames");
  ok("cat seq.isr | isoreel decode - --discard --frames 7:");
}

TEST_F(MeshesTest, LevelsAreClosedAndGrow) {
  const int levels = json("isoreel info seq.isr --json")["grid"]["levels"];
  ASSERT_GT(levels, 3);
  std::size_t faces = 0;
  for (int level = 0; level < levels; ++level) {
    ok(fmt::format("isoreel decode seq.isr -o l{0}.obj --frames 2 --level {0}", level));
    const Mesh mesh = parseObj(content(fmt::format("l{}.obj", level)));
    EXPECT_TRUE(closed(mesh)) << level;
    EXPECT_GE(mesh.faces.size(), faces) << level;
    faces = mesh.faces.size();
  }
  EXPECT_GT(faces, parseObj(content(fmt::format("l{}.obj", levels - 2))).faces.size() * 2);
  const int finest = levels - 1;
  ok("isoreel decode seq.isr -o whole.obj --frames 2");
  EXPECT_EQ(content("whole.obj"), content(fmt::format("l{}.obj", finest)));
  for (int coarser = 1; coarser <= finest; ++coarser) {
    ok(fmt::format("isoreel decode seq.isr -o c.obj --force --frames 2 --level -{}", coarser));
    EXPECT_EQ(content("c.obj"), content(fmt::format("l{}.obj", finest - coarser))) << coarser;
  }
  ok("isoreel decode seq.isr --discard --level -2147483648");
  ok("isoreel decode seq.isr --discard --level 2147483647");
}

TEST_F(MeshesTest, VerticesLieOnTheSphere) {
  ok("isoreel decode seq.isr -o f.obj --frames 6 --normals");
  const Mesh mesh = parseObj(content("f.obj"));
  const std::array<double, 3> centre{7.3 + 0.7 * 6, 12.1, 11.8};
  ASSERT_GT(mesh.vertices.size(), 200u);
  ASSERT_EQ(mesh.normals.size(), mesh.vertices.size());
  EXPECT_TRUE(closed(mesh));
  double volume = 0;
  for (const auto& f : mesh.faces) {
    const auto &a = mesh.vertices[f[0]], &b = mesh.vertices[f[1]], &c = mesh.vertices[f[2]];
    volume += (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
               a[2] * (b[0] * c[1] - b[1] * c[0])) /
              6;
  }
  EXPECT_NEAR(volume, 310, 12);  // 4/3 π 4.2³, and triangles look outwards
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    std::array<double, 3> away{};
    for (std::size_t axis = 0; axis < 3; ++axis) away[axis] = mesh.vertices[i][axis] - centre[axis];
    const double distance = std::hypot(away[0], away[1], away[2]);
    EXPECT_NEAR(distance, 4.2, 0.15);
    const auto& n = mesh.normals[i];
    EXPECT_NEAR(std::hypot(n[0], n[1], n[2]), 1, 1e-3);
    EXPECT_GT((n[0] * away[0] + n[1] * away[1] + n[2] * away[2]) / distance, 0.9);
  }
}

// Every format gets the level and the normals; what is in each is tested in tests/io.
TEST_F(MeshesTest, AllFormatsHoldTheSame) {
  for (const char* format : {"obj", "ply", "stl", "glb", "vtp"}) {
    for (const char* normals : {"", "--normals"})
      ok(fmt::format("isoreel decode seq.isr -o {0}{1}.{0} --frames 1 --level -1 {1}", format, normals));
  }
  const Mesh mesh = parseObj(content("obj.obj"));
  const std::size_t vertices = mesh.vertices.size(), faces = mesh.faces.size();
  EXPECT_TRUE(mesh.normals.empty());
  EXPECT_EQ(parseObj(content("obj--normals.obj")).normals.size(), vertices);
  for (const char* normals : {"", "--normals"}) {
    const auto text = [&](const char* format) { return content(fmt::format("{0}{1}.{0}", format, normals)); };
    const bool has = *normals != '\0';
    EXPECT_TRUE(text("ply").starts_with("ply\nformat binary_little_endian 1.0\n"));
    EXPECT_NE(text("ply").find(fmt::format("element vertex {}\n", vertices)), std::string::npos);
    EXPECT_NE(text("ply").find(fmt::format("element face {}\n", faces)), std::string::npos);
    EXPECT_EQ(text("ply").find("nx") != std::string::npos, has);
    EXPECT_EQ(text("stl").size(), 84 + 50 * faces);
    EXPECT_NE(text("glb").find(fmt::format("\"count\":{},", vertices)), std::string::npos);
    EXPECT_NE(text("glb").find(fmt::format("\"count\":{},", 3 * faces)), std::string::npos);
    EXPECT_EQ(text("glb").find("\"NORMAL\"") != std::string::npos, has);
    EXPECT_NE(text("vtp").find(fmt::format("NumberOfPoints=\"{}\"", vertices)), std::string::npos);
    EXPECT_NE(text("vtp").find(fmt::format("NumberOfPolys=\"{}\"", faces)), std::string::npos);
    EXPECT_EQ(text("vtp").find("\"Normals\"") != std::string::npos, has);
  }
}

/// The (time, file) pairs of a ParaView collection.
std::vector<std::pair<double, std::string>> seriesOf(const std::string& text) {
  std::vector<std::pair<double, std::string>> result;
  const std::regex entry("timestep=\"([^\"]*)\" file=\"([^\"]*)\"");
  for (std::sregex_iterator i(text.begin(), text.end(), entry), end; i != end; ++i)
    result.emplace_back(std::stod((*i)[1]), (*i)[2]);
  return result;
}

TEST_F(MeshesTest, SeriesForParaViewHasExactTimes) {
  write("times", "-1/3\n0\n1/7\n1\n1001/30\n40\n50\n1000\n");
  ok("isoreel encode seq.json -o timed.isr --iso 0 --times times");
  using Series = std::vector<std::pair<double, std::string>>;
  ok("isoreel decode timed.isr -o out/run_%03d.vtp --frames 2:5");
  EXPECT_EQ(list("out"), (Names{"run.pvd", "run_002.vtp", "run_003.vtp", "run_004.vtp"}));
  EXPECT_EQ(seriesOf(content("out/run.pvd")),
            (Series{{1.0 / 7, "run_002.vtp"}, {1, "run_003.vtp"}, {1001.0 / 30, "run_004.vtp"}}));
  EXPECT_NE(content("out/run_002.vtp")
                .find(fmt::format("\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">{}<", 1.0 / 7)),
            std::string::npos);
  ok("cat timed.isr | isoreel decode - -o pipe/run_%03d.vtp --frames 2:5 && diff -r out pipe");
  ok("isoreel decode timed.isr -o all/%d.VTP");
  ASSERT_EQ(list("all").size(), 9u);
  const Series all = seriesOf(content("all/frames.pvd"));
  ASSERT_EQ(all.size(), 8u);
  EXPECT_EQ(all[0], std::make_pair(-1.0 / 3, std::string("0.VTP")));
  ok("isoreel decode timed.isr -o steps/f%d/mesh.vtp --frames 1:3");
  EXPECT_EQ(seriesOf(content("steps/f.pvd")), (Series{{0, "f1/mesh.vtp"}, {1.0 / 7, "f2/mesh.vtp"}}));
  ok("isoreel decode timed.isr -o here-%d.vtp --frames 3");
  EXPECT_EQ(seriesOf(content("here.pvd")), (Series{{1, "here-3.vtp"}}));
  ok("isoreel decode timed.isr -o one/mesh.vtp --frames 3");
  EXPECT_EQ(list("one"), (Names{"mesh.vtp"}));
  ok("isoreel decode timed.isr -o ply/%d.ply --frames 3:5");
  EXPECT_EQ(list("ply"), (Names{"3.ply", "4.ply"}));
}

TEST_F(MeshesTest, SeriesThatIsThereStays) {
  ok("mkdir out");
  write("out/frames.pvd", "mine");
  fails("isoreel decode seq.isr -o out/%d.vtp", 1, "frames.pvd: is there already (--force replaces it)");
  EXPECT_EQ(list("out"), (Names{"frames.pvd"}));
  EXPECT_EQ(content("out/frames.pvd"), "mine");
  ok("isoreel decode seq.isr -o out/%d.vtp --force");
  EXPECT_EQ(seriesOf(content("out/frames.pvd")).size(), 8u);
}

// The index comes last: a series that broke off has none.
TEST_F(MeshesTest, BrokenSeriesHasNoIndex) {
  std::string bytes = content("seq.isr");
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  write("bad.isr", bytes);
  const Outcome outcome = sh("isoreel decode bad.isr -o out/%d.vtp --jobs 1");
  EXPECT_EQ(outcome.code, 1);
  for (const std::string& name : list("out")) EXPECT_TRUE(name.ends_with(".vtp")) << name;
}

TEST_F(MeshesTest, EmptyFramesAreEmptyMeshes) {
  ok("isoreel decode seq.isr -o e.obj --frames 7 && isoreel decode seq.isr -o e.ply --frames 7 --normals");
  EXPECT_TRUE(parseObj(content("e.obj")).vertices.empty());
  EXPECT_NE(content("e.ply").find("element vertex 0\n"), std::string::npos);
}

TEST_F(MeshesTest, DiscardWritesNothingAndTellsTheSeconds) {
  const auto before = list(".");
  const auto result = json("isoreel decode seq.isr --discard --json");
  EXPECT_EQ(list(".").size(), before.size());
  EXPECT_EQ(result["frames"], 8);
  EXPECT_EQ(result["vertices"], json("isoreel info seq.isr --json")["vertices"]);
  EXPECT_GT(result["faces"], 0);
  EXPECT_GE(result["seconds"], 0.0);
  EXPECT_LT(result["seconds"], 60.0);
}

TEST_F(MeshesTest, MeshesThatAreThereStay) {
  write("3.ply", "mine");
  fails("isoreel decode seq.isr -o %d.ply --frames 3", 1, "3.ply: is there already (--force replaces it)");
  EXPECT_EQ(content("3.ply"), "mine");
  ok("isoreel decode seq.isr -o %d.ply --frames 3 --force");
  EXPECT_TRUE(content("3.ply").starts_with("ply"));
}

TEST_F(MeshesTest, NothingIsWrittenWhenOneMeshIsThere) {
  ok("mkdir out");
  for (const char* format : {"ply", "obj", "stl", "glb", "vtp"}) {
    write(fmt::format("out/6.{}", format), "mine");
    fails(fmt::format("isoreel decode seq.isr -o out/%d.{}", format), 1, "is there already (--force");
    EXPECT_EQ(list("out"), (Names{fmt::format("6.{}", format)}));
    EXPECT_EQ(content(fmt::format("out/6.{}", format)), "mine");
    ok("rm out/*");
  }
}

TEST_F(MeshesTest, TheNameOfTheInputDoesNotMatter) {
  ok("isoreel decode seq.isr -o a/%d.ply && cp seq.isr plain && isoreel decode plain -o b/%d.ply && diff -r "
     "a b");
  ok("cp seq.isr 'with space %d.isr.part' && isoreel decode 'with space %d.isr.part' -o c/%d.ply && diff -r "
     "a c");
}

TEST_F(MeshesTest, WhatIsNoFileOfOursIsNamed) {
  write("text", "not a reel at all, however long this text may be");
  write("empty", "");
  for (const char* verb : {"decode --discard", "info", "render -o x.png"}) {
    fails(fmt::format("isoreel {} text", verb), 1, "text: not an .isr file");
    fails(fmt::format("isoreel {} empty", verb), 1, "empty:");
    fails(fmt::format("isoreel {} nope.isr", verb), 1, "nope.isr:");
    fails(fmt::format("isoreel {} .", verb), 1, ".: is a directory");
    fails(fmt::format("isoreel {} - < text", verb), 1, "standard input: ");
  }
}

TEST_F(MeshesTest, CoordinatesAreThoseOfTheWorld) {
  auto description = nlohmann::json::parse(content("step_06.json"));
  description["origin"] = {10, -20, 30};
  description["spacing"] = {0.5, 2, 1};
  write("world.json", description.dump());
  // Profile main would choose other heights, since quads are split in the world.
  for (const std::string name : {"world", "step_06"}) {
    ok(fmt::format("isoreel encode {0}.json -o {0}.isr --iso 0 --profile classic", name));
    ok(fmt::format("isoreel decode {0}.isr -o {0}.obj", name));
  }
  const Mesh world = parseObj(content("world.obj")), grid = parseObj(content("step_06.obj"));
  ASSERT_EQ(world.vertices.size(), grid.vertices.size());
  for (std::size_t i = 0; i < grid.vertices.size(); ++i) {
    EXPECT_NEAR(world.vertices[i][0], 10 + 0.5 * grid.vertices[i][0], 1e-4);
    EXPECT_NEAR(world.vertices[i][1], -20 + 2 * grid.vertices[i][1], 1e-4);
    EXPECT_NEAR(world.vertices[i][2], 30 + grid.vertices[i][2], 1e-4);
  }
}

}  // namespace
}  // namespace isoreel::cli
