// SPDX-License-Identifier: BSD-3-Clause
// decode: which frames, which names, which levels, which formats.
#include <cmath>

#include "support.h"

namespace isoreel::cli {
namespace {

class MeshesTest : public CliTest {
 protected:
  MeshesTest() {
    sequence();
    ok("isoreel encode seq.json -o seq.isr --iso 0");
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

TEST_F(MeshesTest, PlyAndObjHoldTheSame) {
  ok("isoreel decode seq.isr -o f.obj --frames 1 && isoreel decode seq.isr -o f.ply --frames 1");
  ok("isoreel decode seq.isr -o n.ply --frames 1 --normals");
  const Mesh mesh = parseObj(content("f.obj"));
  const std::string ply = content("f.ply"), with_normals = content("n.ply");
  const auto counts = fmt::format("element vertex {}\n", mesh.vertices.size());
  EXPECT_TRUE(ply.starts_with("ply\nformat binary_little_endian 1.0\n"));
  EXPECT_NE(ply.find(counts), std::string::npos);
  EXPECT_NE(ply.find(fmt::format("element face {}\n", mesh.faces.size())), std::string::npos);
  EXPECT_EQ(ply.find("nx"), std::string::npos);
  EXPECT_NE(with_normals.find("nx"), std::string::npos);
  EXPECT_EQ(mesh.normals.size(), 0u);
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
  ok("isoreel encode world.json -o world.isr --iso 0 && isoreel decode world.isr -o world.obj");
  ok("isoreel decode seq.isr -o grid.obj --frames 6");
  const Mesh world = parseObj(content("world.obj")), grid = parseObj(content("grid.obj"));
  ASSERT_EQ(world.vertices.size(), grid.vertices.size());
  for (std::size_t i = 0; i < grid.vertices.size(); ++i) {
    EXPECT_NEAR(world.vertices[i][0], 10 + 0.5 * grid.vertices[i][0], 1e-4);
    EXPECT_NEAR(world.vertices[i][1], -20 + 2 * grid.vertices[i][1], 1e-4);
    EXPECT_NEAR(world.vertices[i][2], 30 + grid.vertices[i][2], 1e-4);
  }
}

}  // namespace
}  // namespace isoreel::cli
