// SPDX-License-Identifier: BSD-3-Clause
// Which files an input means, told by raw volumes of 2 x 2 x 2 bytes, all of one value.
#include <fmt/format.h>
#include <sys/stat.h>

#include "support.h"

namespace isoreel::io {
namespace {

class Inputs : public IoTest {
 protected:
  void volume(const std::string& name, int value, const std::string& more = "",
              const std::string& dims = "2,2,2", std::size_t bytes = 8) const {
    const std::string raw = std::filesystem::path(name).filename().string() + ".raw";
    write(name + ".raw", std::string(bytes, static_cast<char>(value)));
    write(name, fmt::format(R"({{"files":["{}"],"dtype":"uint8","dims":[{}]{}}})", raw, dims, more));
  }
  // The values of the volumes, in order.
  static std::vector<float> read(const std::vector<std::string>& inputs) {
    auto sequence = openVolumes(inputs);
    if (!sequence.ok()) {
      ADD_FAILURE() << sequence.error().message;
      return {};
    }
    std::vector<float> values;
    for (std::size_t i = 0; i < (*sequence)->size(); ++i) values.push_back((*sequence)->read(i)->samples[7]);
    return values;
  }
};

TEST_F(Inputs, ListKeepsItsOrder) {
  for (const int i : {1, 2, 3}) volume(fmt::format("v{}", i), i);
  EXPECT_EQ(read({path("v3"), path("v1"), path("v2"), path("v1")}), (std::vector<float>{3, 1, 2, 1}));
}

TEST_F(Inputs, FolderInNaturalOrderWithoutOtherFiles) {
  for (const int i : {10, 2, 1, 100}) volume(fmt::format("frame{}.json", i), i);
  write("README.md", "# words\n");
  write("isovalues.json", R"({"isovalues":[1,2]})");
  write(".hidden.json", R"({"dims":)");
  write("empty", "");
  EXPECT_EQ(read({folder_.string()}), (std::vector<float>{1, 2, 10, 100}));
}

TEST_F(Inputs, FolderWithoutVolumes) {
  write("README.md", "# words\n");
  EXPECT_TRUE(
      contains(errorOf({folder_.string()}), "no volume file in this folder; this build reads raw + JSON"));
}

TEST_F(Inputs, PatternFromTheLowestNumber) {
  for (int i = 8; i <= 12; ++i) volume(fmt::format("f_{:04}.json", i), i);
  volume("f_9.json", 99);  // not what %04d writes
  EXPECT_EQ(read({path("f_%04d.json")}), (std::vector<float>{8, 9, 10, 11, 12}));
  EXPECT_EQ(read({path("f_%d.json")}), (std::vector<float>{99}));
}

TEST_F(Inputs, PatternGapIsNamed) {
  for (const int i : {1, 2, 5}) volume(fmt::format("f_{:02}.json", i), i);
  EXPECT_TRUE(contains(errorOf({path("f_%02d.json")}), path("f_03.json") + " is missing"));
  EXPECT_TRUE(contains(errorOf({path("g_%02d.json")}), "no file of this pattern exists"));
  EXPECT_TRUE(contains(errorOf({path("none/f_%02d.json")}), path("none/f_%02d.json")));
}

TEST_F(Inputs, GlobsInNaturalOrder) {
  for (const int i : {10, 9, 101, 11}) volume(fmt::format("f{}.json", i), i);
  volume("g[1].json", 3);
  EXPECT_EQ(read({path("f*.json")}), (std::vector<float>{9, 10, 11, 101}));
  EXPECT_EQ(read({path("f1?.json"), path("f[9].json")}), (std::vector<float>{10, 11, 9}));
  EXPECT_EQ(read({path("g[1].json")}), (std::vector<float>{3}));  // a file's own name goes first
  EXPECT_TRUE(contains(errorOf({path("h*")}), path("h*") + ": no file of this pattern exists"));
  EXPECT_TRUE(contains(errorOf({path("f*")}), ": not a volume file"));  // the .raw files too
}

TEST_F(Inputs, FileWhoseNameLooksLikeAPattern) {
  volume("f_%d.json", 5);
  EXPECT_EQ(read({path("f_%d.json")}), (std::vector<float>{5}));
  for (const char* name : {"%s", "%n", "%99999999999d", "%d%d", "%", "%0"}) {
    EXPECT_TRUE(contains(errorOf({path(name)}), "no such file")) << name;
  }
}

TEST_F(Inputs, SizesThatDiffer) {
  volume("a", 1);
  volume("b", 2, "", "2,2,3", 12);
  const std::string error = errorOf({path("a"), path("b")});
  EXPECT_TRUE(contains(error, path("a.raw") + " has 2 x 2 x 2 nodes"));
  EXPECT_TRUE(contains(error, path("b.raw") + " has 2 x 2 x 3"));
}

TEST_F(Inputs, PlacesThatDiffer) {
  volume("a", 1);
  volume("b", 2, R"(,"origin":[0,0,0.01])");
  volume("c", 3, R"(,"origin":[0,0,0.0001])");  // rounding, not a difference
  const std::string error = errorOf({path("a"), path("b")});
  EXPECT_TRUE(contains(error, path("a.raw")));
  EXPECT_TRUE(contains(error, path("b.raw")));
  EXPECT_EQ(read({path("a"), path("c")}), (std::vector<float>{1, 3}));
}

TEST_F(Inputs, WhatIsNoVolumeFile) {
  write("empty", "");
  write("text", "hello");
  write("other.json", R"({"isovalues":[1,2]})");
  ASSERT_EQ(mkfifo(path("pipe").c_str(), 0600), 0);
  EXPECT_TRUE(contains(errorOf({}), "no volume files given"));
  EXPECT_TRUE(contains(errorOf({path("none")}), path("none") + ": no such file"));
  EXPECT_TRUE(contains(errorOf({path("empty")}), path("empty") + ": the file is empty"));
  EXPECT_TRUE(contains(errorOf({path("pipe")}), path("pipe") + ": not a regular file"));
  for (const char* name : {"text", "other.json"}) {
    const std::string error = errorOf({path(name)});
    EXPECT_TRUE(contains(error, path(name) + ": not a volume file"));
    for (const std::string& format : volumeFormats()) EXPECT_TRUE(contains(error, format));
  }
}

TEST_F(Inputs, TwoFormatsAreNoSequence) {
  volume("a", 1);
  write("b", "NRRD0004\n");
  const std::string error = errorOf({path("a"), path("b")});
  EXPECT_TRUE(contains(error, "NRRD"));
  EXPECT_TRUE(contains(error, path("b")));
}

// Formats are known by their content in every build; a build without one says so.
TEST_F(Inputs, FormatsThatThisBuildLacks) {
  write("a", "NRRD0004\n");
  write("b", std::string(" BDV\0\0\0\0", 8));
  write("c", "<VTKFile type=\"ImageData\">");
  const auto formats = volumeFormats();
  for (const auto& [file, name] :
       {std::pair("a", "NRRD"), std::pair("b", "OpenVDB"), std::pair("c", "VTI")}) {
    if (std::find(formats.begin(), formats.end(), name) != formats.end()) continue;
    EXPECT_TRUE(contains(errorOf({path(file)}), fmt::format("{}: built without {}", path(file), name)));
  }
}

}  // namespace
}  // namespace isoreel::io
