// SPDX-License-Identifier: BSD-3-Clause
// VTI files by hand: what must be refused, and forms that other writers than VTK use.
#include <fmt/format.h>

#include "support.h"

namespace isoreel::io {
namespace {

// 2 x 2 x 2 unsigned bytes 0 to 7, as text, unless a field is changed.
struct Vti {
  std::string root = R"(type="ImageData" version="1.0" byte_order="LittleEndian")";
  std::string image = R"(WholeExtent="0 1 0 1 0 1" Origin="0 0 0" Spacing="1 1 1")";
  std::string extent = "0 1 0 1 0 1";
  std::string array = R"(type="UInt8" Name="phi" format="ascii")";
  std::string data = "0 1 2 3 4 5 6 7";
  std::string more;      // behind the array
  std::string appended;  // behind the image

  std::string text() const {
    return fmt::format(
        "<?xml version=\"1.0\"?>\n<VTKFile {}>\n<ImageData {}>\n<Piece Extent=\"{}\">\n<PointData "
        "Scalars=\"phi\">\n<DataArray {}>\n{}\n</DataArray>{}</PointData></Piece></ImageData>{}</VTKFile>\n",
        root, image, extent, array, data, more, appended);
  }
};

class VtiReader : public IoTest {
 protected:
  std::string error(const Vti& vti, const VolumeOptions& options = {}) const {
    write("x.vti", vti.text());
    const std::string message = errorOf({path("x.vti")}, options);
    EXPECT_TRUE(message.empty() || contains(message, path("x.vti")));
    return message;
  }
  template <class Change>
  std::string errorWith(Change change) const {
    Vti vti;
    change(vti);
    return error(vti);
  }
  // The array's bytes in base64, appended as raw bytes, in either width of header.
  void expectRamp(const Vti& vti) const {
    ASSERT_EQ(error(vti), "");
    const auto volume = (*openVolumes({path("x.vti")}))->read(0);
    for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(volume->samples[i], static_cast<float>(i));
  }
};

TEST_F(VtiReader, FormsOfOtherWriters) {
  expectRamp({});
  Vti vti;
  vti.root = R"(type='ImageData' byte_order='LittleEndian')";
  expectRamp(vti);
  vti = {};
  vti.array = R"(type="UInt8" Name="phi" format="binary" NumberOfComponents="1")";
  vti.data = "CAAAAAABAgMEBQYH";  // count and data as one stream
  expectRamp(vti);
  vti.data = "CAAA\nAA==  AAEC AwQF Bgc=";  // as two
  expectRamp(vti);
  vti.array = R"(type="UInt8" Name="phi" format="appended" offset="2")";
  vti.data = "";
  vti.appended = "<AppendedData encoding=\"raw\">\n _<>" + std::string("\x08\0\0\0\0\1\2\3\4\5\6\7", 12) +
                 "</AppendedData>";
  expectRamp(vti);
  vti = {};
  vti.image = R"(WholeExtent="-5 9 0 1 0 1")";  // a piece of something larger
  vti.extent = "-5 -4 0 1 0 1";
  expectRamp(vti);
  EXPECT_EQ((*openVolumes({path("x.vti")}))->grid().origin[0], -5);
}

TEST_F(VtiReader, WhatIsRefused) {
  EXPECT_TRUE(contains(errorWith([](Vti& v) { v.root = R"(type="PolyData" byte_order="LittleEndian")"; }),
                       "not a volume file"));
  EXPECT_TRUE(contains(errorWith([](Vti& v) { v.root = R"(type="ImageData")"; }), "byte_order \"\""));
  EXPECT_TRUE(
      contains(errorWith([](Vti& v) { v.root += R"( header_type="UInt16")"; }), "header_type \"UInt16\""));
  EXPECT_TRUE(
      contains(errorWith([](Vti& v) { v.image = R"(WholeExtent="0 1 0 1 0")"; }), "must be 6 numbers"));
  EXPECT_TRUE(contains(errorWith([](Vti& v) { v.image += R"( Direction="1 0")"; }), "must be 9 numbers"));
  EXPECT_TRUE(contains(errorWith([](Vti& v) { v.image = R"(WholeExtent="0 1 0 1 0 1" Spacing="1 0 1")"; }),
                       "spacing"));
  EXPECT_TRUE(contains(errorWith([](Vti& v) { v.extent = "0 1 0 1 0 2"; }), "outside of WholeExtent"));
  EXPECT_TRUE(contains(errorWith([](Vti& v) { v.extent = "0 1 0 1 1 0"; }), "axis 2 has 0 nodes"));
  EXPECT_TRUE(contains(errorWith([](Vti& v) { v.extent = "0 1 0 1 0 1\"/><Piece Extent=\"0 1 0 1 0 1"; }),
                       "one Piece"));
  EXPECT_TRUE(contains(errorWith([](Vti& v) {
                         v.extent = v.image = "-9223372036854775808 9223372036854775807 0 1 0 1";
                         v.image = "WholeExtent=\"" + v.image + '"';
                       }),
                       "outside of WholeExtent"));
  EXPECT_TRUE(contains(errorWith([](Vti& v) { v.array = R"(type="Bit" Name="phi" format="ascii")"; }),
                       "no scalar array; its point data have \"phi\" (Bit)"));
  EXPECT_TRUE(contains(errorWith([](Vti& v) { v.array = R"(type="UInt8" Name="phi" format="hex")"; }),
                       "format \"hex\""));
  EXPECT_TRUE(contains(errorWith([](Vti& v) { v.data = "0 1 2 3 4 5 6"; }),
                       "array \"phi\": holds 7 numbers, but its extent needs 8"));
  EXPECT_TRUE(contains(errorWith([](Vti& v) { v.data += " 8"; }), "holds more than the 8"));
  EXPECT_TRUE(contains(errorWith([](Vti& v) { v.data = "0 1 2 3 4 5 6 x"; }), "'x' is no number"));
  EXPECT_TRUE(contains(errorWith([](Vti& v) { v.more = "<x>"; }), "not whole XML"));
  EXPECT_TRUE(contains(errorWith([](Vti& v) { v.more = R"(<DataArray type="Int8" Name="b">0</DataArray>)"; }),
                       "choose an array by name; its point data have \"phi\" (UInt8), \"b\" (Int8)"));
}

TEST_F(VtiReader, SizesThatLie) {
  const auto sized = [&](const std::string& array, const std::string& data, const std::string& more = "") {
    Vti vti;
    vti.image = R"(WholeExtent="0 59999 0 59999 0 59999")";
    vti.extent = "0 59999 0 59999 0 59999";
    vti.array = R"(type="Float64" Name="phi" format=)" + array;
    vti.data = data;
    vti.root += more;
    return error(vti);
  };
  EXPECT_TRUE(contains(sized("\"ascii\"", "0 1 2"), "bytes of text cannot hold"));
  EXPECT_TRUE(contains(sized("\"binary\"", "CAAAAAABAgMEBQYH"),
                       "holds 8 bytes, but its extent needs 1728000000000000"));
  const std::string wide = R"( header_type="UInt64")", zlib = R"( compressor="vtkZLibDataCompressor")";
  // 1728000000000000 bytes, as a count and as one block of zlib.
  EXPECT_TRUE(
      contains(sized("\"binary\"", "AAAsWpsjBgA=", wide), "expected 1728000000000000 bytes, found at most"));
  EXPECT_TRUE(
      contains(sized("\"binary\"", "AQAAAAAAAAAAACxamyMGAAAALFqbIwYACAAAAAAAAAA=AAAAAAAAAAA=", wide + zlib),
               "cannot hold the samples"));
  EXPECT_TRUE(contains(sized("\"binary\"", "/////////////////////////////////////////w==", wide + zlib),
                       "blocks cannot lie"));
  EXPECT_TRUE(contains(sized("\"appended\" offset=\"99\"", ""), "its offset 99 lies behind the end"));
  EXPECT_TRUE(contains(sized("\"appended\"", ""), "its offset 18446744073709551615 lies behind"));
}

TEST_F(VtiReader, GridsThatChange) {
  write("a.vti", Vti().text());
  Vti other;
  other.image = R"(WholeExtent="0 1 0 1 0 1" Origin="0 0 5")";
  write("b.vti", other.text());
  other = {};
  other.image = R"(WholeExtent="0 1 0 1 0 3")";
  other.extent = "0 1 0 1 0 3";
  write("c.vti", other.text());
  EXPECT_TRUE(contains(errorOf({path("a.vti"), path("b.vti")}), "frames of one sequence lie in one place"));
  const std::string error = errorOf({path("a.vti"), path("c.vti")});
  EXPECT_TRUE(
      contains(error, path("a.vti") + " has 2 x 2 x 2 nodes but " + path("c.vti") + " has 2 x 2 x 4"));
  other = {};
  other.array = R"(type="UInt8" Name="rho" format="ascii")";
  write("d.vti", other.text());
  EXPECT_TRUE(contains(errorOf({path("a.vti"), path("d.vti")}), path("d.vti") + ": no array \"phi\""));
}

}  // namespace
}  // namespace isoreel::io
