// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <isoreel/base/bytes.h>

#include <random>
#include <string_view>

namespace isoreel {
namespace {

ByteSpan text(std::string_view s) { return {reinterpret_cast<const std::uint8_t*>(s.data()), s.size()}; }

// The definition, a bit at a time.
std::uint32_t slowCrc(ByteSpan bytes) {
  std::uint32_t crc = ~0u;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int i = 0; i < 8; ++i) crc = (crc >> 1) ^ ((crc & 1) != 0 ? 0x82F63B78u : 0u);
  }
  return ~crc;
}

TEST(Crc32c, CheckValues) {
  EXPECT_EQ(crc32c(text("123456789")), 0xE3069283u);
  EXPECT_EQ(crc32c({}), 0u);
  EXPECT_EQ(crc32c(Bytes(32, 0x00)), 0x8A9136AAu);  // RFC 3720 B.4
  EXPECT_EQ(crc32c(Bytes(32, 0xFF)), 0x62A8AB43u);
}

TEST(Crc32c, EqualsTheDefinitionAtEveryLengthAndSplit) {
  std::mt19937 random(1);
  Bytes bytes(67);
  for (auto& b : bytes) b = static_cast<std::uint8_t>(random());
  for (std::size_t size = 0; size <= bytes.size(); ++size) {
    const ByteSpan part = ByteSpan(bytes).first(size);
    const std::uint32_t expected = slowCrc(part);
    EXPECT_EQ(crc32c(part), expected);
    for (std::size_t split = 0; split <= size; ++split) {
      EXPECT_EQ(crc32c(part.subspan(split), crc32c(part.first(split))), expected);
    }
  }
}

TEST(Varint, RoundTripsWhereTheLengthChanges) {
  for (int bits = 0; bits <= 64; ++bits) {
    const std::uint64_t top = bits == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits);
    for (const std::uint64_t value : {top - 1, top, top + 1}) {
      Bytes bytes;
      ByteWriter(bytes).varint(value);
      std::size_t length = 1;
      for (std::uint64_t v = value; v >= 128; v /= 128) ++length;
      EXPECT_EQ(bytes.size(), length);
      ByteReader in(bytes);
      EXPECT_EQ(in.varint(), value);
      EXPECT_FALSE(in.truncated() || in.malformed());
      EXPECT_EQ(in.left(), 0u);
      for (std::size_t cut = 0; cut < bytes.size(); ++cut) {
        ByteReader short_in(ByteSpan(bytes).first(cut));
        short_in.varint();
        EXPECT_TRUE(short_in.truncated());
      }
    }
  }
}

TEST(Varint, OnlyTheShortestFormIsRead) {
  const std::vector<Bytes> wrong = {
      {0x80, 0x00},
      {0xFF, 0x00},
      {0x80, 0x80, 0x00},
      {0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0x02},        // bit 64
      {0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0x81, 0x00},  // 11 bytes
      {0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x01},
  };
  for (const Bytes& bytes : wrong) {
    ByteReader in(bytes);
    in.varint();
    EXPECT_TRUE(in.malformed());
  }
  const Bytes zero = {0x00};
  ByteReader in(zero);
  EXPECT_EQ(in.varint(), 0u);
  EXPECT_FALSE(in.malformed());
}

TEST(Varint, EveryPairOfBytesIsReadAsItWouldBeWritten) {
  for (unsigned pair = 0; pair < 65536; ++pair) {
    const Bytes bytes = {static_cast<std::uint8_t>(pair), static_cast<std::uint8_t>(pair >> 8)};
    ByteReader in(bytes);
    const std::uint64_t value = in.varint();
    if (in.truncated() || in.malformed()) continue;
    Bytes again;
    ByteWriter(again).varint(value);
    EXPECT_EQ(again, Bytes(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(in.position())));
  }
}

TEST(ByteReader, NothingPastTheEnd) {
  const Bytes bytes = {1, 2, 3};
  ByteReader in(bytes);
  EXPECT_EQ(in.fixed<std::uint16_t>(), 0x0201u);
  EXPECT_EQ(in.fixed<std::uint32_t>(), 0u);
  EXPECT_TRUE(in.truncated());
  EXPECT_EQ(in.left(), 0u);
  ByteReader huge(bytes);
  EXPECT_TRUE(huge.bytes(~std::size_t{0}).empty());
  EXPECT_TRUE(huge.truncated());
}

TEST(ByteWriter, FixedValuesAreLittleEndian) {
  Bytes bytes;
  ByteWriter out(bytes);
  out.fixed(std::uint64_t{0x0807060504030201});
  out.fixed(std::uint8_t{9});
  EXPECT_EQ(bytes, (Bytes{1, 2, 3, 4, 5, 6, 7, 8, 9}));
  EXPECT_EQ(out.position(), 9u);
  ByteReader in(bytes);
  EXPECT_EQ(in.fixed<std::uint64_t>(), 0x0807060504030201u);
}

}  // namespace
}  // namespace isoreel
