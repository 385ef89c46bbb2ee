// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include "support.h"

namespace isoreel::io {
namespace {

class RawJson : public IoTest {
 protected:
  // 3 x 4 x 5 nodes in a.raw, with `more` members in the JSON.
  std::string describe(const std::string& dtype, const std::string& more = "",
                       const std::string& files = "\"a.raw\"") const {
    write("a.json", fmt::format(R"({{"dims":[3,4,5],"dtype":"{}","files":[{}]{}}})", dtype, files, more));
    return path("a.json");
  }
};

template <class T>
class RawJsonTypes : public RawJson {
 protected:
  static std::string dtype() {
    if (std::is_floating_point_v<T>) return sizeof(T) == 4 ? "float32" : "float64";
    return fmt::format("{}int{}", std::is_signed_v<T> ? "" : "u", 8 * sizeof(T));
  }
};
TYPED_TEST_SUITE(RawJsonTypes, ScalarTypes);

TYPED_TEST(RawJsonTypes, EverySampleInBothByteOrdersAtAnyOffset) {
  const auto values = spread<TypeParam>(60);
  for (const std::endian order : {std::endian::little, std::endian::big}) {
    for (const std::size_t offset : {0u, 3u, 8u}) {
      this->write("a.raw", std::string(offset, 'x') + bytesOf(values, order));
      const std::string json = this->describe(
          this->dtype(),
          fmt::format(R"(,"offset":{},"endian":"{}")", offset, order == std::endian::big ? "big" : "little"));
      auto sequence = openVolumes({json});
      ASSERT_TRUE(sequence.ok()) << sequence.error().message;
      ASSERT_EQ((*sequence)->size(), 1u);
      EXPECT_FALSE((*sequence)->levelSet());
      const auto volume = (*sequence)->read(0);
      ASSERT_TRUE(volume.ok()) << volume.error().message;
      EXPECT_EQ(volume->grid.nodes, (std::array<std::uint32_t, 3>{3, 4, 5}));
      expectSamples(*volume, values);
    }
  }
}

// More samples than the converter takes at a time.
TEST_F(RawJson, ManySlabs) {
  const auto values = spread<std::int16_t>(70 * 61 * 53);
  write("a.raw", bytesOf(values));
  write("a.json", R"({"dims":[70,61,53],"dtype":"int16","files":["a.raw"]})");
  const auto volume = (*openVolumes({path("a.json")}).operator*()).read(0);
  ASSERT_TRUE(volume.ok());
  expectSamples(*volume, values);
}

TEST_F(RawJson, PlacementLevelSetAndSeveralFrames) {
  const auto a = spread<float>(60);
  auto b = a;
  std::reverse(b.begin(), b.end());
  write("a.raw", bytesOf(a));
  write("b.raw", bytesOf(b));
  auto sequence = openVolumes({describe(
      "float32", R"(,"spacing":[1,2,0.5],"origin":[-1,0,7],"direction":[0,-1,0,1,0,0,0,0,1],"levelset":true)",
      R"("b.raw","a.raw")")});
  ASSERT_TRUE(sequence.ok()) << sequence.error().message;
  ASSERT_EQ((*sequence)->size(), 2u);
  EXPECT_TRUE((*sequence)->levelSet());
  EXPECT_EQ((*sequence)->name(0), path("b.raw"));
  EXPECT_EQ((*sequence)->grid().world(Vec3d{1, 1, 1}), (Vec3d{-3, 1, 7.5}));
  expectSamples(*(*sequence)->read(1), a);
  // A volume outlives the sequence that it came from.
  const Volume first = *(*sequence)->read(0);
  *sequence = nullptr;
  expectSamples(first, b);
}

TEST_F(RawJson, SizesMustMatchExactly) {
  for (const std::size_t bytes : {0u, 239u, 241u}) {
    write("a.raw", std::string(bytes, 'x'));
    const std::string error = errorOf({describe("float32")});
    EXPECT_TRUE(contains(error, path("a.raw"))) << bytes;
    EXPECT_TRUE(contains(error, "expected 240 bytes"));
    EXPECT_TRUE(contains(error, fmt::format("found {}", bytes)));
  }
}

TEST_F(RawJson, FileThatShrinksAfterOpening) {
  for (const std::string dtype : {"float32", "int32"}) {
    write("a.raw", std::string(240, 'x'));
    auto sequence = openVolumes({describe(dtype)});
    ASSERT_TRUE(sequence.ok());
    write("a.raw", "short");
    const auto volume = (*sequence)->read(0);
    ASSERT_FALSE(volume.ok());
    EXPECT_TRUE(contains(volume.error().message, "expected 240 bytes"));
  }
}

TEST_F(RawJson, BrokenDescriptions) {
  write("a.raw", std::string(240, '\0'));
  const std::pair<const char*, const char*> cases[] = {
      {R"({"dims":[3,4,5],"dtype":"float32","files":["a.raw"])", "not valid JSON"},
      {R"({"dims":[3,4],"dtype":"float32","files":["a.raw"]})", "\"dims\""},
      {R"({"dims":[3,4,1],"dtype":"float32","files":["a.raw"]})", "\"dims\""},
      {R"({"dims":[3,4,5.5],"dtype":"float32","files":["a.raw"]})", "\"dims\""},
      {R"({"dims":[3,4,-5],"dtype":"float32","files":["a.raw"]})", "\"dims\""},
      {R"({"dims":[3,4,70000],"dtype":"float32","files":["a.raw"]})", "\"dims\""},
      {R"({"dims":[65536,65536,65536],"dtype":"float32","files":["a.raw"]})", "found 240"},
      {R"({"dims":[3,4,5],"files":["a.raw"]})", "\"dtype\""},
      {R"({"dims":[3,4,5],"dtype":"complex64","files":["a.raw"]})", "\"dtype\""},
      {R"({"dims":[3,4,5],"dtype":7,"files":["a.raw"]})", "\"dtype\""},
      {R"({"dims":[3,4,5],"dtype":"float32"})", "\"files\""},
      {R"({"dims":[3,4,5],"dtype":"float32","files":[]})", "\"files\""},
      {R"({"dims":[3,4,5],"dtype":"float32","files":[3]})", "\"files\""},
      {R"({"dims":[3,4,5],"dtype":"float32","files":["no.raw"]})", "no such file"},
      {R"({"dims":[3,4,5],"dtype":"float32","files":["."]})", "not a regular file"},
      {R"({"dims":[3,4,5],"dtype":"float32","files":["a.raw"],"endian":"middle"})", "\"endian\""},
      {R"({"dims":[3,4,5],"dtype":"float32","files":["a.raw"],"offset":-1})", "\"offset\""},
      {R"({"dims":[3,4,5],"dtype":"float32","files":["a.raw"],"offset":1e30})", "\"offset\""},
      {R"({"dims":[3,4,5],"dtype":"float32","files":["a.raw"],"spacing":[1,1]})", "\"spacing\""},
      {R"({"dims":[3,4,5],"dtype":"float32","files":["a.raw"],"spacing":[1,0,1]})", "spacing"},
      {R"({"dims":[3,4,5],"dtype":"float32","files":["a.raw"],"origin":"here"})", "\"origin\""},
      {R"({"dims":[3,4,5],"dtype":"float32","files":["a.raw"],"direction":[1,0,0]})", "\"direction\""},
      {R"({"dims":[3,4,5],"dtype":"float32","files":["a.raw"],"levelset":"yes"})", "\"levelset\""},
  };
  for (const auto& [json, says] : cases) {
    write("a.json", json);
    const std::string error = errorOf({path("a.json")});
    EXPECT_TRUE(contains(error, says)) << json;
    EXPECT_TRUE(contains(error, path(""))) << json;
  }
}

}  // namespace
}  // namespace isoreel::io
