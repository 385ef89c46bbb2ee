// SPDX-License-Identifier: BSD-3-Clause
// MetaImage headers by hand: all types and byte orders, where samples may lie, and what must be refused.
#include <fmt/format.h>

#include "support.h"

namespace isoreel::io {
namespace {

class MetaImage : public IoTest {
 protected:
  // A header of 2 x 2 x 3 bytes, with `more` lines before ElementDataFile.
  void header(const std::string& name, const std::string& file, const std::string& more = "",
              const std::string& sizes = "2 2 3", const std::string& type = "MET_UCHAR") const {
    const auto axes = std::count(sizes.begin(), sizes.end(), ' ') + 1;
    write(name, fmt::format(
                    "ObjectType = Image\nNDims = {}\nDimSize = {}\nElementType = {}\n{}ElementDataFile = {}",
                    axes, sizes, type, more, file));
  }
  std::string error(const std::string& more, const std::string& sizes = "2 2 3",
                    const std::string& type = "MET_UCHAR", const std::string& data = "abcdefghijkl") const {
    header("x.mha", "LOCAL\n" + data, more, sizes, type);
    const std::string message = errorOf({path("x.mha")});
    EXPECT_TRUE(message.empty() || contains(message, path("x.mha")));
    return message;
  }
  std::string letters(const std::string& name) const {
    auto sequence = openVolumes({path(name)});
    if (!sequence.ok()) return sequence.error().message;
    std::string text;
    for (std::size_t i = 0; i < (*sequence)->size(); ++i) {
      const auto volume = (*sequence)->read(i);
      if (!volume.ok()) return volume.error().message;
      for (const float sample : volume->samples) text += static_cast<char>(sample);
    }
    return text;
  }
};

template <class T>
class MetaImageTypes : public MetaImage {
 protected:
  static std::vector<std::string> types() {
    if (std::is_floating_point_v<T>) return {sizeof(T) == 4 ? "MET_FLOAT" : "MET_DOUBLE"};
    const std::string u = std::is_signed_v<T> ? "MET_" : "MET_U";
    if (sizeof(T) == 4) return {u + "INT", u + "LONG"};  // MetaIO's long has 4 bytes everywhere
    return {u + (sizeof(T) == 1 ? "CHAR" : sizeof(T) == 2 ? "SHORT" : "LONG_LONG")};
  }
};
TYPED_TEST_SUITE(MetaImageTypes, ScalarTypes);

TYPED_TEST(MetaImageTypes, BothByteOrders) {
  const auto values = spread<TypeParam>(60);
  for (const std::string& type : this->types()) {
    for (const char* key : {"ElementByteOrderMSB", "BinaryDataByteOrderMSB"}) {
      for (const bool big : {false, true}) {
        this->header("a.mha", "LOCAL\n" + bytesOf(values, big ? std::endian::big : std::endian::little),
                     fmt::format("{} = {}\n", key, big ? "True" : "False"), "3 4 5", type);
        auto sequence = openVolumes({this->path("a.mha")});
        ASSERT_TRUE(sequence.ok()) << sequence.error().message;
        ASSERT_NO_FATAL_FAILURE(expectSamples(*(*sequence)->read(0), values)) << type << key << big;
      }
    }
  }
}

TEST_F(MetaImage, WhereSamplesLie) {
  write("a.raw", "abcdefghijkl");
  header("one.mhd", "a.raw");
  EXPECT_EQ(letters("one.mhd"), "abcdefghijkl");
  write("b.raw", "HEADabcdefghijkl");
  for (const char* size : {"4", "-1"}) {
    header("skip.mhd", "b.raw\n", fmt::format("HeaderSize = {}\n", size));
    EXPECT_EQ(letters("skip.mhd"), "abcdefghijkl") << size;
  }
  for (int z = 1; z <= 3; ++z)
    write(fmt::format("z{:02}.raw", z),
          std::string("abcdefghijkl").substr(4 * static_cast<std::size_t>(z) - 4, 4));
  for (const char* files : {"LIST\nz01.raw\nz02.raw\nz03.raw", "LIST 2\r\nz01.raw\r\nz02.raw\r\nz03.raw\r\n",
                            "z%02d.raw 1 3 1", "z%02d.raw 1 3"}) {
    header("slices.mhd", files);
    EXPECT_EQ(letters("slices.mhd"), "abcdefghijkl") << files;
  }
  header("rows.mhd", "LIST 3\na.raw");
  EXPECT_EQ(letters("rows.mhd"), "abcdefghijkl");
  write("c.raw", "ABCDEFGHIJKL");
  header("frames.mhd", "LIST\na.raw\nc.raw", "", "2 2 3 2");
  EXPECT_EQ(letters("frames.mhd"), "abcdefghijklABCDEFGHIJKL");
  header("frames.mha", "LOCAL\nabcdefghijklABCDEFGHIJKL", "", "2 2 3 2");
  EXPECT_EQ(letters("frames.mha"), "abcdefghijklABCDEFGHIJKL");
}

TEST_F(MetaImage, FilesThatDoNotFit) {
  write("a.raw", "abcdefghijk");
  header("a.mhd", "a.raw");
  EXPECT_TRUE(contains(errorOf({path("a.mhd")}), path("a.raw") + ": expected 12 bytes"));
  header("none.mhd", "none.raw");
  EXPECT_TRUE(
      contains(errorOf({path("none.mhd")}), path("none.mhd") + ": " + path("none.raw") + ": no such file"));
  header("two.mhd", "LIST\na.raw\na.raw");
  EXPECT_TRUE(contains(errorOf({path("two.mhd")}), "names 2 files where DimSize needs 3"));
  header("many.mhd", "a%d.raw 0 99999999999 1");
  EXPECT_TRUE(contains(errorOf({path("many.mhd")}), "is not like a%03d.raw 1 9 1"));
  header("axes.mhd", "LIST 9\na.raw");
  EXPECT_TRUE(contains(errorOf({path("axes.mhd")}), "how many axes has a file?"));
}

TEST_F(MetaImage, Placement) {
  for (const char* names : {"Offset,TransformMatrix,ElementSpacing", "Position,Rotation,ElementSize",
                            "Origin,Orientation,ElementSpacing"}) {
    const std::string text = names;
    const std::size_t a = text.find(','), b = text.find(',', a + 1);
    EXPECT_EQ(error(fmt::format("{} = 1 2 3\n{} = 0 1 0 -1 0 0 0 0 1\n{} = 2 3 0.5\n", text.substr(0, a),
                                text.substr(a + 1, b - a - 1), text.substr(b + 1))),
              "");
    // The first axis points along y, the second against x.
    EXPECT_EQ((*openVolumes({path("x.mha")}))->grid().world(Vec3d{1, 1, 1}), (Vec3d{-2, 4, 3.5}));
  }
}

TEST_F(MetaImage, WhatIsRefused) {
  EXPECT_EQ(error(""), "");  // the form that all others break
  EXPECT_EQ(error("ElementNumberOfChannels = 1\nComment = any = thing\nUnknownKey = 3\n"), "");
  EXPECT_TRUE(contains(error("ElementNumberOfChannels = 3\n"), "3 channels: only scalar volumes"));
  EXPECT_TRUE(contains(error("BinaryData = False\n"), "samples as text"));
  EXPECT_TRUE(contains(error("CompressedData = maybe\n"), "neither True nor False"));
  EXPECT_TRUE(contains(error("CompressedData = True\n"), "broken compressed data"));
  EXPECT_TRUE(contains(error("HeaderSize = -2\n"), "HeaderSize is -2"));
  EXPECT_TRUE(contains(error("HeaderSize = 9223372036854775807\n"), "2^62"));
  EXPECT_TRUE(contains(error("ElementSpacing = 1 1\n"), "must be 3 numbers"));
  EXPECT_TRUE(contains(error("ElementSpacing = 1 0 1\n"), "spacing is not above 0"));
  EXPECT_TRUE(contains(error("ElementSpacing = 1 -1 1\n"), "spacing is not above 0"));
  EXPECT_TRUE(contains(error("Offset = 1 nan 1\n"), "origin is not finite"));
  EXPECT_TRUE(contains(error("Offset = 1 x 1\n"), "'x' is no number"));
  EXPECT_TRUE(contains(error("nonsense\n"), "line 5 is not \"Key = Value\""));
  EXPECT_TRUE(contains(error("", "2 2"), "has 2 axes"));
  EXPECT_TRUE(contains(error("", "2 2 1"), "axis 2 has 1 nodes"));
  EXPECT_TRUE(contains(error("", "2 -2 3"), "axis 1 has -2 nodes"));
  EXPECT_TRUE(contains(error("", "2 2 3 0"), "DimSize says 0 volumes"));
  EXPECT_TRUE(
      contains(error("TransformMatrix = 1 0 0 1 0 1 0 0 0 0 1 0 0 0 0 1\n", "2 2 3 1"), "space and time"));
  EXPECT_TRUE(contains(error("", "2 2 3", "MET_FLOAT_ARRAY"), "ElementType MET_FLOAT_ARRAY"));
  header("x.mha", "LOCAL\n", "ObjectType = Tube\n");
  EXPECT_EQ(error("ObjectType = Tube\n"), "");  // the first of two values counts
  write("tube.mhd", "NDims = 3\nObjectType = Tube\nElementDataFile = LOCAL\n");
  EXPECT_TRUE(contains(errorOf({path("tube.mhd")}), "ObjectType Tube is not Image"));
  write("short.mhd", "NDims = 3\nDimSize = 2 2 2\n");
  EXPECT_TRUE(contains(errorOf({path("short.mhd")}), "ends before ElementDataFile"));
}

TEST_F(MetaImage, SizesThatLie) {
  EXPECT_TRUE(contains(error("", "2 2 4"), "found"));
  EXPECT_TRUE(contains(error("", "2 2 2"), "found"));  // more bytes than the header says
  EXPECT_TRUE(contains(error("", "60000 60000 60000"), "60000 x 60000 x 60000 nodes of 1 bytes"));
  EXPECT_TRUE(contains(error("CompressedData = True\n", "60000 60000 60000"), "cannot hold"));
  EXPECT_NE(error("", "60000 60000 60000 9223372036854775807"), "");
  EXPECT_NE(error("HeaderSize = -1\n", "60000 60000 60000"), "");
}

}  // namespace
}  // namespace isoreel::io
