// SPDX-License-Identifier: BSD-3-Clause
// NIfTI headers by hand, byte by byte: all types and byte orders of both versions, and what must be refused.
#include <fmt/format.h>
#include <zlib.h>

#include <random>

#include "support.h"

namespace isoreel::io {
namespace {

// A header of 3 x 4 x 5 nodes, whose fields can be changed.
struct Header {
  int version = 1;
  std::endian order = std::endian::little;
  std::vector<std::int64_t> dim{3, 3, 4, 5, 1, 1, 1, 1};
  std::vector<double> pixdim{1, 1, 1, 1, 1, 1, 1, 1};
  int datatype = 2, units = 0, sform = 0;
  double offset = -1;  // where the header and its four bytes of extension end
  double slope = 0, intercept = 0;
  std::vector<double> srow;
  std::string magic;  // "" for that of a single file

  std::string bytes() const {
    const bool one = version == 1;
    std::string result(one ? 352 : 544, '\0');
    const auto put = [&](std::size_t at, auto value) {
      const std::string field = bytesOf(std::vector{value}, order);
      result.replace(at, field.size(), field);
    };
    const auto real = [&](std::size_t at1, std::size_t at2, std::size_t i, double value) {
      one ? put(at1 + 4 * i, static_cast<float>(value)) : put(at2 + 8 * i, value);
    };
    put(0, static_cast<std::int32_t>(one ? 348 : 540));
    for (std::size_t i = 0; i < 8; ++i) {
      one ? put(40 + 2 * i, static_cast<std::int16_t>(dim[i])) : put(16 + 8 * i, dim[i]);
      real(76, 104, i, pixdim[i]);
    }
    put(one ? 70 : 12, static_cast<std::int16_t>(datatype));
    const double start = offset == -1 ? static_cast<double>(result.size()) : offset;
    one ? put(108, static_cast<float>(start)) : put(168, static_cast<std::int64_t>(start));
    real(112, 176, 0, slope);
    real(116, 184, 0, intercept);
    one ? put(123, static_cast<std::int8_t>(units)) : put(500, static_cast<std::int32_t>(units));
    one ? put(254, static_cast<std::int16_t>(sform)) : put(348, static_cast<std::int32_t>(sform));
    for (std::size_t i = 0; i < srow.size(); ++i) real(280, 400, i, srow[i]);
    const std::string kind = magic.empty() ? (one ? "n+1" : "n+2") : magic;
    result.replace(one ? 344 : 4, 3, kind);
    if (!one) result.replace(8, 4, "\r\n\x1a\n");
    return result;
  }
};

class Nifti : public IoTest {
 protected:
  std::string error(const Header& header, const std::string& data = std::string(60, 'x')) const {
    write("x.nii", header.bytes() + data);
    const std::string message = errorOf({path("x.nii")});
    EXPECT_TRUE(message.empty() || contains(message, path("x.nii")));
    return message;
  }
  template <class Change>
  std::string errorWith(Change change, const std::string& data = std::string(60, 'x')) const {
    std::string message;
    for (const int version : {1, 2}) {
      Header header;
      header.version = version;
      change(header);
      message = error(header, data);
    }
    return message;
  }
};

template <class T>
class NiftiTypes : public Nifti {
 protected:
  static int type() {
    if (std::is_floating_point_v<T>) return sizeof(T) == 4 ? 16 : 64;
    const bool isSigned = std::is_signed_v<T>;
    switch (sizeof(T)) {
      case 1:
        return isSigned ? 256 : 2;
      case 2:
        return isSigned ? 4 : 512;
      case 4:
        return isSigned ? 8 : 768;
      default:
        return isSigned ? 1024 : 1280;
    }
  }
};
TYPED_TEST_SUITE(NiftiTypes, ScalarTypes);

TYPED_TEST(NiftiTypes, BothVersionsAndByteOrders) {
  const auto values = spread<TypeParam>(120);
  for (const int version : {1, 2}) {
    for (const std::endian order : {std::endian::little, std::endian::big}) {
      Header header;
      header.version = version;
      header.order = order;
      header.datatype = this->type();
      header.dim = {4, 3, 4, 5, 2, 1, 1, 1};
      // Known by content: the name says nothing.
      this->write("volume", header.bytes() + bytesOf(values, order));
      auto sequence = openVolumes({this->path("volume")});
      ASSERT_TRUE(sequence.ok()) << sequence.error().message;
      ASSERT_EQ((*sequence)->size(), 2u);
      ASSERT_NO_FATAL_FAILURE(expectSamples(*(*sequence)->read(1), values, 60)) << version;
      ASSERT_NO_FATAL_FAILURE(expectSamples(*(*sequence)->read(0), values)) << version;
    }
  }
}

TEST_F(Nifti, SlopeInterceptUnitsAndPlacement) {
  for (const int version : {1, 2}) {
    Header header;
    header.version = version;
    header.dim = {4, 3, 4, 5, 2, 1, 1, 1};
    header.pixdim = {1, 2, 3, 4, 735, 1, 1, 1};
    header.units = 2 + 16;  // mm, msec
    header.slope = 0.25;
    header.intercept = -7;
    EXPECT_EQ(error(header, std::string(120, '\x08')), "");
    auto sequence = openVolumes({path("x.nii")});
    EXPECT_EQ((*sequence)->read(1)->samples[59], -5);
    EXPECT_EQ((*sequence)->grid().world(Vec3d{1, 1, 1}), (Vec3d{2, 3, 4}));  // no form: pixdim alone
    EXPECT_EQ((*sequence)->time(1), 0.735);
    header.sform = 2;
    header.srow = {0, -2, 0, 5, 1, 0, 0, 6, 0, 0.5, 3, 7};
    EXPECT_EQ(error(header, std::string(120, '\x08')), "");
    EXPECT_EQ((*openVolumes({path("x.nii")}))->grid().world(Vec3d{1, 1, 1}), (Vec3d{3, 7, 10.5}));
    header.srow = std::vector<double>(12, 0.0);
    EXPECT_TRUE(contains(error(header, std::string(120, '\x08')), "spacing is not above 0"));
  }
}

TEST_F(Nifti, WhatIsRefused) {
  EXPECT_EQ(errorWith([](Header&) {}), "");  // the form that all others break
  EXPECT_TRUE(contains(errorWith([](Header& h) { h.dim[0] = 2; }), "has 2 dimensions"));
  EXPECT_TRUE(contains(errorWith([](Header& h) { h.dim[0] = 9; }), "has 9 dimensions"));
  EXPECT_TRUE(contains(errorWith([](Header& h) { h.dim[2] = -4; }), "dimension 2 is -4"));
  EXPECT_TRUE(contains(errorWith([](Header& h) { h.dim[3] = 1; }), "axis 2 has 1 nodes"));
  EXPECT_TRUE(contains(errorWith([](Header& h) { h.dim = {5, 2, 2, 3, 1, 5, 1, 1}; }), "dimension 5 is 5"));
  EXPECT_TRUE(contains(errorWith([](Header& h) { h.datatype = 128; }), "datatype 128 (RGB24)"));
  EXPECT_TRUE(contains(errorWith([](Header& h) { h.datatype = 7; }), "datatype 7"));
  EXPECT_TRUE(contains(errorWith([](Header& h) { h.offset = -8; }), "samples start at byte -8"));
  EXPECT_TRUE(contains(errorWith([](Header& h) { h.offset = 1e17; }), "expected"));
  EXPECT_TRUE(contains(errorWith([](Header& h) {
                         h.pixdim[1] = 0;
                         h.sform = 1;
                       }),
                       "spacing"));
  EXPECT_TRUE(contains(errorWith([](Header& h) { h.magic = h.version == 1 ? "ni1" : "ni2"; }),
                       "its own name is not .hdr"));
  EXPECT_TRUE(contains(errorWith([](Header& h) { h.magic = "no!"; }), "not a volume file"));
  Header half;
  half.offset = 352.5;
  EXPECT_TRUE(contains(error(half), "samples start at byte 352.5"));
}

TEST_F(Nifti, SizesThatLie) {
  EXPECT_TRUE(contains(errorWith([](Header& h) { h.dim[3] = 6; }), "expected"));
  EXPECT_TRUE(contains(errorWith([](Header& h) { h.dim[3] = 4; }), "expected"));
  EXPECT_TRUE(contains(errorWith([](Header& h) { h.dim = {4, 20000, 20000, 20000, 20000, 1, 1, 1}; }),
                       "20000 times 20000 x 20000 x 20000 nodes"));
  Header huge;
  huge.version = 2;
  huge.dim = {4, 60000, 60000, 60000, std::int64_t{1} << 62, 1, 1, 1};
  EXPECT_TRUE(contains(error(huge), "too many"));
}

TEST_F(Nifti, PairsOfFiles) {
  Header header;
  header.magic = "ni1";
  header.offset = 0;
  write("a.hdr", header.bytes().substr(0, 348));
  EXPECT_TRUE(contains(errorOf({path("a.hdr")}), path("a.img") + ": no such file"));
  write("a.img", std::string(60, 'x'));
  EXPECT_EQ(errorOf({path("a.hdr")}), "");
  EXPECT_EQ(errorOf({folder_.string()}), "");  // the folder's one volume: its .img is not another
  write("a.img", std::string(59, 'x'));
  EXPECT_TRUE(contains(errorOf({path("a.hdr")}), path("a.img") + ": expected 60 bytes"));
}

// Volumes of compressed 4-D files in any order, as several GOPs under way at once ask for them: each goes on
// from a copy of whatever is nearest before it.
TEST_F(Nifti, CompressedInSeveralOrdersAtOnce) {
  Header header;
  constexpr std::size_t kVolumes = 100;
  constexpr std::int64_t kSide = 24;
  header.dim = {4, kSide, kSide, kSide, kVolumes, 1, 1, 1};
  std::mt19937 random(1);  // does not compress, so that buffers end anywhere
  std::string data(kVolumes * kSide * kSide * kSide, '\0');
  for (char& c : data) c = static_cast<char>(random());
  const std::string bytes = header.bytes() + data;
  gzFile file = gzopen(path("x.nii.gz").c_str(), "wb1");
  ASSERT_EQ(gzwrite(file, bytes.data(), static_cast<unsigned>(bytes.size())), static_cast<int>(bytes.size()));
  ASSERT_EQ(gzclose(file), Z_OK);

  auto sequence = openVolumes({path("x.nii.gz")});
  ASSERT_TRUE(sequence.ok()) << sequence.error().message;
  const auto expectVolume = [&](std::size_t i) {
    const Result<Volume> volume = (*sequence)->read(i);
    ASSERT_TRUE(volume.ok()) << i << ": " << volume.error().message;
    const std::size_t count = volume->samples.size();
    for (std::size_t j = 0; j < count; ++j)
      ASSERT_EQ(volume->samples[j], static_cast<float>(static_cast<std::uint8_t>(data[i * count + j]))) << i;
  };
  for (std::size_t i = 0; i < 12; ++i) {
    for (const std::size_t gop : {0u, 24u, 12u, 84u}) expectVolume(gop + i);
  }
  for (int trial = 0; trial < 100; ++trial) expectVolume(random() % kVolumes);
  const auto open_files = std::distance(std::filesystem::directory_iterator("/proc/self/fd"), {});
  EXPECT_LT(open_files, 64 + 32);
  for (std::size_t i = 0; i < kVolumes; ++i) expectVolume(i);  // and to the end, where the checksum is
}

TEST_F(Nifti, RawBytesOfThatName) {
  write("x.nii", std::string(1000, '\x07'));
  EXPECT_TRUE(contains(errorOf({path("x.nii")}), "not a volume file"));
  write("x.nii.gz", "\x1f\x8b\x08 and no more");
  EXPECT_TRUE(contains(errorOf({path("x.nii.gz")}), "not a volume file"));
}

}  // namespace
}  // namespace isoreel::io
