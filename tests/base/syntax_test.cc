// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <isoreel/base/packet.h>
#include <isoreel/base/syntax.h>

#include <limits>
#include <string>
#include <vector>

namespace isoreel {
namespace {

enum class Colour : std::uint8_t { kRed = 1, kBlue = 2 };

struct Sample {
  static constexpr const char* kName = "sample";
  static constexpr const char* kSpec = "test 1";
  std::uint8_t small = 3;
  std::uint32_t medium = 70000;
  std::uint16_t narrow = 500;  // as a varint
  std::int64_t change = -5;
  double wide = 0.1;
  float single = 0.5f;
  double any = std::numeric_limits<double>::infinity();
  Colour colour = Colour::kBlue;
  std::array<std::uint8_t, 3> three{7, 8, 9};
  Bytes blob{1, 2, 3};
  std::string text = "text";

  template <class Visitor>
  void fields(Visitor& v) {
    v.fixed("small", small, 2, 10);
    v.fixed("medium", medium);
    v.varint("narrow", narrow);
    v.signedVarint("change", change);
    v.f64("wide", wide);
    v.f32("single", single);
    v.f64("any", any, true);
    v.fixed("colour", colour, 1, 2);
    v.array("three", three);
    v.blob("blob", blob, 4);
    v.text("text", text, 8);
    v.require(small != 9, "small must not be 9");
  }
  bool operator==(const Sample&) const = default;
};

struct Wide {
  static constexpr const char* kName = "wide";
  static constexpr const char* kSpec = "test 2";
  std::uint64_t value = 65536;
  template <class Visitor>
  void fields(Visitor& v) {
    v.varint("value", value);
  }
};
struct Narrow {
  static constexpr const char* kName = "narrow";
  static constexpr const char* kSpec = "test 2";
  std::uint16_t value = 7;
  template <class Visitor>
  void fields(Visitor& v) {
    v.varint("value", value);
  }
};

Bytes written(const Sample& sample) {
  Bytes bytes;
  EXPECT_TRUE(writeSyntax(bytes, sample).ok());
  return bytes;
}

TEST(Syntax, RoundTrip) {
  Sample sample;
  sample.small = 10;
  sample.medium = 0xFFFFFFFF;
  sample.narrow = 0xFFFF;
  sample.change = std::numeric_limits<std::int64_t>::min();
  sample.wide = -0.0;
  sample.text = "";
  const Bytes bytes = written(sample);
  Sample back;
  ByteReader in(bytes);
  ASSERT_TRUE(readSyntax(in, back).ok());
  EXPECT_EQ(back, sample);
  EXPECT_TRUE(std::signbit(back.wide));
  EXPECT_EQ(in.left(), 0u);
}

TEST(Syntax, ZigzagIsSmallForSmallNumbersOfEitherSign) {
  EXPECT_EQ(syntax::zigzag(0), 0u);
  EXPECT_EQ(syntax::zigzag(-1), 1u);
  EXPECT_EQ(syntax::zigzag(1), 2u);
  for (const std::int64_t value : {std::numeric_limits<std::int64_t>::min(), std::int64_t{-2},
                                   std::int64_t{3}, std::numeric_limits<std::int64_t>::max()}) {
    EXPECT_EQ(syntax::unzigzag(syntax::zigzag(value)), value);
  }
}

TEST(Syntax, EveryTruncationIsNamed) {
  const Bytes bytes = written(Sample{});
  for (std::size_t cut = 0; cut < bytes.size(); ++cut) {
    Sample back;
    ByteReader in(ByteSpan(bytes).first(cut));
    const Status status = readSyntax(in, back);
    ASSERT_FALSE(status.ok()) << cut;
    EXPECT_EQ(status.error().code, ErrorCode::kTruncated);
    EXPECT_NE(status.message().find("sample: ends inside "), std::string::npos) << status.message();
    EXPECT_NE(status.message().find("(spec test 1)"), std::string::npos);
  }
}

TEST(Syntax, WriterAndReaderRefuseTheSame) {
  // The wrong value at its place in the bytes, and in the struct.
  const auto refused = [](std::size_t place, std::uint8_t byte, Sample sample, const std::string& why) {
    Bytes bytes = written(Sample{});
    bytes[place] = byte;
    Sample back;
    ByteReader in(bytes);
    const Status read = readSyntax(in, back);
    ASSERT_FALSE(read.ok()) << why;
    EXPECT_EQ(read.error().code, ErrorCode::kBadData);
    EXPECT_NE(read.message().find(why), std::string::npos) << read.message();
    Bytes ignored;
    const Status write = writeSyntax(ignored, sample);
    ASSERT_FALSE(write.ok()) << why;
    EXPECT_NE(write.message().find(why), std::string::npos) << write.message();
  };
  Sample sample;
  sample.small = 1;
  refused(0, 1, sample, "small 1 is below 2");
  sample.small = 11;
  refused(0, 11, sample, "small 11 is above 10");
  sample.small = 9;
  refused(0, 9, sample, "small must not be 9");
  constexpr std::size_t kColour = 1 + 4 + 2 + 1 + 8 + 4 + 8;
  sample = {};
  sample.colour = static_cast<Colour>(3);
  refused(kColour, 3, sample, "colour 3 is above 2");
  sample = {};
  sample.blob.resize(5);
  refused(kColour + 1 + 3, 5, sample, "blob 5 is above 4");
  sample = {};
  sample.wide = std::numeric_limits<double>::infinity();
  Bytes ignored;
  EXPECT_NE(writeSyntax(ignored, sample).message().find("wide is not finite"), std::string::npos);
  sample = {};
  sample.single = std::numeric_limits<float>::quiet_NaN();
  EXPECT_NE(writeSyntax(ignored, sample).message().find("single is not finite"), std::string::npos);
}

TEST(Syntax, ReaderRefusesNotANumberAndTooWideVarints) {
  Bytes bytes = written(Sample{});
  for (std::size_t i = 0; i < 8; ++i) bytes[8 + i] = 0xFF;
  Sample back;
  ByteReader in(bytes);
  EXPECT_NE(readSyntax(in, back).message().find("wide is not finite"), std::string::npos);

  Bytes wide;
  ASSERT_TRUE(writeSyntax(wide, Wide{}).ok());
  Narrow narrow;
  ByteReader wide_in(wide);
  EXPECT_NE(readSyntax(wide_in, narrow).message().find("value 65536 is above 65535"), std::string::npos);
  EXPECT_EQ(narrow.value, 7);
}

TEST(Syntax, SizedStructsSkipWhatTheyDoNotKnow) {
  const Bytes known = written(Sample{});
  Bytes bytes;
  ByteWriter out(bytes);
  out.varint(known.size() + 3);
  out.bytes(known);
  out.bytes(Bytes{0xAA, 0xBB, 0xCC});  // fields of a later minor version
  out.fixed(std::uint8_t{42});         // what follows the struct
  Sample back;
  back.small = 4;
  ByteReader in(bytes);
  ASSERT_TRUE(readSized(in, back).ok());
  EXPECT_EQ(back, Sample{});
  EXPECT_EQ(in.fixed<std::uint8_t>(), 42);

  Bytes sized;
  ASSERT_TRUE(writeSized(sized, Sample{}).ok());
  for (std::size_t cut = 0; cut < sized.size(); ++cut) {
    ByteReader short_in(ByteSpan(sized).first(cut));
    EXPECT_EQ(readSized(short_in, back).error().code, ErrorCode::kTruncated);
  }
  sized[0] = static_cast<std::uint8_t>(sized[0] - 1);  // ends inside its last field
  ByteReader lying(sized);
  EXPECT_EQ(readSized(lying, back).error().code, ErrorCode::kTruncated);
  const Bytes malformed = {0x80, 0x00};
  ByteReader malformed_in(malformed);
  EXPECT_EQ(readSized(malformed_in, back).error().code, ErrorCode::kBadData);
}

TEST(Syntax, DumperNamesEveryFieldInOrder) {
  std::vector<std::string> names;
  std::vector<std::string> values;
  const auto sink = [&](const char* name, const auto& value) {
    names.emplace_back(name);
    using Value = std::decay_t<decltype(value)>;
    if constexpr (std::is_same_v<Value, std::string>) {
      values.push_back(value);
    } else if constexpr (std::is_same_v<Value, Bytes>) {
      values.push_back(std::to_string(value.size()) + " bytes");
    } else {
      values.push_back(std::to_string(value));
    }
  };
  dumpSyntax(Sample{}, sink);
  EXPECT_EQ(names, (std::vector<std::string>{"small", "medium", "narrow", "change", "wide", "single", "any",
                                             "colour", "three", "blob", "text"}));
  EXPECT_EQ(values, (std::vector<std::string>{"3", "70000", "500", "-5", "0.100000", "0.500000", "inf", "2",
                                              "3 bytes", "3 bytes", "text"}));
}

TEST(FrameHeader, RulesBetweenFields) {
  FrameHeader header;
  header.number = header.position = 5;
  header.back = 1;
  Bytes bytes;
  EXPECT_NE(writeSyntax(bytes, header).message().find("must be its own key"), std::string::npos);
  header.type = PacketType::kPredicted;
  header.back = 0;
  EXPECT_NE(writeSyntax(bytes, header).message().find("must be its own key"), std::string::npos);
  header.back = 2;
  bytes.clear();
  ASSERT_TRUE(writeSyntax(bytes, header).ok());
  FrameHeader back;
  ByteReader in(bytes);
  ASSERT_TRUE(readSyntax(in, back).ok());
  EXPECT_EQ(back, header);
}

}  // namespace
}  // namespace isoreel
