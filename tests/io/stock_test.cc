// SPDX-License-Identifier: BSD-3-Clause
// The files in data/, which other software wrote (data/README.md): what they hold, and what is left of them
// when they are cut or changed.
#include <fmt/format.h>

#include <cmath>

#include "support.h"

namespace isoreel::io {
namespace {

class Stock : public IoTest {
 protected:
  static std::string data(const std::string& name) { return ISOREEL_IO_DATA "/" + name; }
  void SetUp() override {
    const auto formats = volumeFormats();
    for (const auto& [format, folder] : {std::pair("NIfTI", "Nifti"), std::pair("VTI", "Vti")}) {
      const std::string test = testing::UnitTest::GetInstance()->current_test_info()->name();
      if (test.find(folder) != std::string::npos &&
          std::find(formats.begin(), formats.end(), format) == formats.end())
        GTEST_SKIP() << "built without " << format;
    }
  }
  static std::unique_ptr<VolumeSequence> open(const std::vector<std::string>& inputs,
                                              const std::string& array = "") {
    auto sequence = openVolumes(inputs, {array});
    if (!sequence.ok()) throw std::runtime_error(sequence.error().message);  // GoogleTest reports it
    return *std::move(sequence);
  }
  static double formula(std::size_t i, std::size_t frame, bool hasSign) {
    return static_cast<double>((7 * i + 13 * frame) % 100) - (hasSign ? 50 : 0);
  }
  static void expectFormula(VolumeSequence& sequence, std::size_t index, std::size_t frame, bool hasSign,
                            double slope = 1, double intercept = 0) {
    const auto volume = sequence.read(index);
    ASSERT_TRUE(volume.ok()) << volume.error().message;
    ASSERT_EQ(volume->grid.nodes, (std::array<std::uint32_t, 3>{3, 4, 5}));
    ASSERT_EQ(volume->samples.size(), 60u);
    for (std::size_t i = 0; i < 60; ++i) {
      ASSERT_EQ(volume->samples[i], static_cast<float>(slope * formula(i, frame, hasSign) + intercept)) << i;
    }
  }
  static void expectAt(const VolumeSequence& sequence, const Vec3d& node, const Vec3d& world) {
    const Vec3d found = sequence.grid().world(node);
    for (std::size_t a = 0; a < 3; ++a) EXPECT_NEAR(found[a], world[a], 1e-5) << a;
  }
  // The oblique matrix of make.py.
  static void expectOblique(const VolumeSequence& sequence) {
    expectAt(sequence, {0, 0, 0}, {10, -20, 30});
    expectAt(sequence, {1, 0, 0}, {10, -18.5, 30});
    expectAt(sequence, {0, 1, 0}, {8, -20, 30});
    expectAt(sequence, {2, 3, 4}, {4, -17, 40});
  }

  // Copies a file of data/, then gives every shorter one to openVolumes: an error that names it, or the same
  // samples.
  void everyCut(const std::string& name, std::size_t atMostWhole) {
    const std::string file = std::filesystem::path(name).filename();
    const std::string whole = contentOf(data(name));
    ASSERT_FALSE(whole.empty());
    std::size_t complete = 0;
    for (std::size_t size = 0; size < whole.size(); ++size) {
      write(file, whole.substr(0, size));
      const std::string error = errorOf({path(file)});
      if (error.empty()) {
        ++complete;
      } else {
        EXPECT_TRUE(contains(error, path(file))) << size;
      }
    }
    EXPECT_LE(complete, atMostWhole) << name;
    write(file, whole);
    EXPECT_EQ(errorOf({path(file)}), "");
  }
  // Every byte changed: whatever that says, no crash, no hang, no memory out of proportion.
  void everyByteChanged(const std::string& name) {
    const std::string file = std::filesystem::path(name).filename();
    const std::string whole = contentOf(data(name));
    for (std::size_t i = 0; i < whole.size(); ++i) {
      for (const int change : {0xff, 0x10}) {
        std::string broken = whole;
        broken[i] = static_cast<char>(broken[i] ^ change);
        write(file, broken);
        const std::string error = errorOf({path(file)});
        EXPECT_TRUE(error.empty() || contains(error, path(file))) << i;
      }
    }
  }
  static std::string contentOf(const std::string& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
};

TEST_F(Stock, NiftiOfNibabel) {
  auto scaled = open({data("nifti/scaled.nii.gz")});
  expectOblique(*scaled);
  expectFormula(*scaled, 0, 0, true, 0.5, -3);
  EXPECT_EQ(scaled->time(0), std::nullopt);
  for (const char* name : {"nifti/pair.hdr", "nifti/int32.nii", "nifti/float64.nii"}) {
    auto sequence = open({data(name)});
    expectOblique(*sequence);
    expectFormula(*sequence, 0, 0, true);
  }
}

TEST_F(Stock, NiftiOverTime) {
  auto frames = open({data("nifti/frames.nii")});
  ASSERT_EQ(frames->size(), 3u);
  expectOblique(*frames);
  auto packed = open({data("nifti/frames.nii.gz")});
  ASSERT_EQ(packed->size(), 3u);
  for (const std::size_t t : {2u, 0u, 1u, 1u, 2u}) {
    expectFormula(*frames, t, t, false);
    expectFormula(*packed, t, t, false);
    EXPECT_NEAR(frames->time(t).value(), 1 + 0.04 * static_cast<double>(t), 1e-12);
    EXPECT_EQ(packed->time(t), std::nullopt);
  }
  EXPECT_EQ(frames->name(1), data("nifti/frames.nii") + " (volume 1)");
}

TEST_F(Stock, MetaImageOfVtk) {
  for (const auto& [name, hasSign] :
       {std::pair("short.mhd", true), {"short.mha", true}, {"double.mha", true}, {"packed.mhd", false}}) {
    auto sequence = open({data(std::string("metaimage/") + name)});
    ASSERT_EQ(sequence->size(), 1u);
    expectAt(*sequence, {0, 0, 0}, {10, -20, 30});
    expectAt(*sequence, {2, 3, 4}, {13, -14, 40});
    expectFormula(*sequence, 0, 0, hasSign);
  }
}

TEST_F(Stock, VtiOfVtkInEveryForm) {
  for (const char* name : {"ascii", "binary", "binary_zlib_wide", "binary_wide_big", "appended",
                           "appended_zlib_big", "appended_base64", "appended_base64_zlib_wide"}) {
    const std::string file = data(fmt::format("vti/{}.vti", name));
    for (const char* type :
         {"int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "float32", "float64"}) {
      auto sequence = open({file}, type);
      expectAt(*sequence, {2, 3, 4}, {13, -14, 40});
      expectFormula(*sequence, 0, 0, type[0] != 'u');
    }
    EXPECT_TRUE(
        contains(errorOf({file}), file + ": choose an array by name; its point data have \"int8\" (Int8), "));
    EXPECT_TRUE(contains(errorOf({file}, {"phi"}), "no array \"phi\"; its point data have"));
  }
}

TEST_F(Stock, VtiPlacementAndTimes) {
  auto turned = open({data("vti/turned.vti")});  // one scalar among its arrays
  expectFormula(*turned, 0, 0, true);
  expectAt(*turned, {0, 0, 0}, {10 + 4, -20 + 6, 30 + 17.5});  // extent 4 -2 7, axes turned by a quarter
  expectAt(*turned, {1, 0, 0}, {14, -12.5, 47.5});
  expectAt(*turned, {0, 1, 0}, {12, -14, 47.5});
  auto frames = open({data("vti/time_*.vti")});  // 8 9 10: natural order
  ASSERT_EQ(frames->size(), 3u);
  for (const std::size_t t : {0u, 1u, 2u}) {
    expectFormula(*frames, t, t, true);
    EXPECT_EQ(frames->time(t), 0.1 * static_cast<double>(t));
  }
}

TEST_F(Stock, VtiThatCannotBeRead) {
  EXPECT_TRUE(contains(errorOf({data("vti/lz4.vti")}), "lz4.vti: compressor \"vtkLZ4DataCompressor\": only"));
  EXPECT_TRUE(contains(errorOf({data("vti/lzma.vti")}), "lzma.vti: compressor \"vtkLZMADataCompressor\""));
  EXPECT_TRUE(contains(errorOf({data("vti/cells.vti")}),
                       "no scalar array; its point data have none; cell data (\"pressure\") cannot be read"));
  EXPECT_TRUE(contains(errorOf({data("vti/turned.vti")}, {"velocity"}),
                       "array \"velocity\" (Float32 x 3) is not scalar"));
}

TEST_F(Stock, NiftiCutAndChanged) {
  everyCut("nifti/frames.nii", 0);
  everyCut("nifti/scaled.nii.gz", 0);
  everyByteChanged("nifti/frames.nii");
  everyByteChanged("nifti/scaled.nii.gz");
}

TEST_F(Stock, NiftiInSeveralGzipMembers) {
  using namespace std::string_literals;
  const std::string whole = contentOf(data("nifti/scaled.nii.gz"));
  const std::string start = "\x1f\x8b\x08\0\0\0\0\0\0\x03"s;
  const std::string empty = start + "\x03\0\0\0\0\0\0\0\0\0"s;
  const std::string one = start + "\1\1\0\xfe\xffx\x83\x16\xdc\x8c\1\0\0\0"s;  // the byte x
  for (const std::string& more : {empty, empty + empty, std::string(512, '\0')}) {
    write("a.nii.gz", whole + more);
    EXPECT_EQ(errorOf({path("a.nii.gz")}), "");
  }
  write("a.nii.gz", whole + empty + one);
  EXPECT_TRUE(contains(errorOf({path("a.nii.gz")}), "holds more samples than its header says"));
  write("a.nii.gz", whole + one.substr(0, 12));
  EXPECT_TRUE(contains(errorOf({path("a.nii.gz")}), "end early"));
}

TEST_F(Stock, MetaImageCutAndChanged) {
  everyCut("metaimage/short.mha", 0);
  everyCut("metaimage/double.mha", 0);
  everyByteChanged("metaimage/short.mha");
  std::filesystem::copy(data("metaimage/packed.mhd"), path("packed.mhd"));
  const std::string whole = contentOf(data("metaimage/packed.zraw"));
  for (std::size_t size = 0; size < whole.size(); ++size) {
    write("packed.zraw", whole.substr(0, size));
    EXPECT_TRUE(contains(errorOf({path("packed.mhd")}), path("packed.zraw"))) << size;
  }
}

// What follows the last block (closing tags) may be missing.
TEST_F(Stock, VtiCutAndChanged) {
  everyCut("vti/time_9.vti", 32);
  everyByteChanged("vti/time_9.vti");
}

}  // namespace
}  // namespace isoreel::io
