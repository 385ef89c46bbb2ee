// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "entropy/range_coder.h"
#include "entropy/residual.h"
#include "made.h"

namespace isoreel {
namespace {

/// What a test codes: bits through numbered models, and raw runs.
struct Symbol {
  int model;  // -1: raw
  int count;
  std::uint32_t value;
};

Bytes put(const std::vector<Symbol>& symbols, Bytes before = {}) {
  Bytes bytes = std::move(before);
  RangePut coder(bytes);
  std::vector<BitModel> models(16);
  for (const Symbol& s : symbols) {
    if (s.model < 0) {
      coder.raw(s.count, s.value);
    } else {
      coder.code(models[static_cast<std::size_t>(s.model)], s.value != 0);
    }
  }
  coder.finish();
  return bytes;
}

void expectGets(ByteSpan bytes, const std::vector<Symbol>& symbols) {
  RangeGet coder(bytes);
  std::vector<BitModel> models(16);
  for (std::size_t i = 0; i < symbols.size(); ++i) {
    const Symbol& s = symbols[i];
    const std::uint32_t value =
        s.model < 0 ? coder.raw(s.count, 0)
                    : std::uint32_t{coder.code(models[static_cast<std::size_t>(s.model)], false)};
    ASSERT_EQ(value, s.value) << "symbol " << i << " of " << symbols.size();
  }
  EXPECT_FALSE(coder.overrun());
  EXPECT_TRUE(coder.finished());
}

TEST(BitModel, LearnsTheSameWithoutBranches) {
  for (std::uint32_t one = BitModel::kFloor; one <= 65536 - BitModel::kFloor; one += 61) {
    for (std::uint16_t seen = 0; seen <= BitModel::kLimit; seen = static_cast<std::uint16_t>(seen + 7)) {
      for (const bool bit : {false, true}) {
        BitModel a{static_cast<std::uint16_t>(one), seen}, b = a;
        a.update(bit);
        b.updateEither(bit);
        ASSERT_EQ(a.one, b.one);
        ASSERT_EQ(a.seen, b.seen);
      }
    }
  }
}

TEST(BitModel, StaysWithinItsFloorAndReachesIt) {
  BitModel ones, zeros;
  for (int i = 0; i < 100000; ++i) {
    ones.update(true);
    zeros.update(false);
    ASSERT_LE(ones.one, 65536 - BitModel::kFloor);
    ASSERT_GE(zeros.one, BitModel::kFloor);
  }
  EXPECT_EQ(ones.one, 65536 - BitModel::kFloor);
  EXPECT_EQ(zeros.one, BitModel::kFloor);
}

TEST(BitModel, FollowsTheFormulaOfTheSpecification) {
  made::Random random(1);
  BitModel model;
  std::int64_t one = 32768, seen = 0;
  for (int i = 0; i < 5000; ++i) {
    const bool bit = random() % 5 == 0;
    model.update(bit);
    const std::int64_t rate = 65534 / (2 * seen + 3);
    one += bit ? ((65280 - one) * rate + 65535) / 65536 : -(((one - 256) * rate + 65535) / 65536);
    seen = std::min<std::int64_t>(seen + 1, 160);
    ASSERT_EQ(model.one, one) << "update " << i;
  }
}

TEST(RangeCoder, RoundTripsRandomSymbols) {
  for (std::uint32_t seed = 0; seed < 300; ++seed) {
    made::Random random(seed);
    const std::size_t count = random() % 3000;
    // Skews from even to one in 65536, another in each model.
    std::vector<Symbol> symbols;
    for (std::size_t i = 0; i < count; ++i) {
      const int model = static_cast<int>(random() % 17) - 1;
      if (model < 0) {
        const int bits = static_cast<int>(random() % 13);
        symbols.push_back({-1, bits, static_cast<std::uint32_t>(random() & ((1u << bits) - 1))});
      } else {
        const bool rare = random() % (1u << model) == 0;
        symbols.push_back({model, 1, std::uint32_t{rare != (model % 2 == 0)}});
      }
    }
    const Bytes bytes = put(symbols);
    expectGets(bytes, symbols);
    if (testing::Test::HasFailure()) FAIL() << "seed " << seed;
  }
}

TEST(RangeCoder, KeepsCarriesWithinItsStream) {
  // Zeros move the interval up: long runs of them behind ones make carries through many 0xFF bytes. What
  // stands before the stream must not change.
  for (std::uint32_t ones = 0; ones < 200; ++ones) {
    std::vector<Symbol> symbols(ones, Symbol{0, 1, 1});
    symbols.insert(symbols.end(), 300, Symbol{-1, 1, 0});
    symbols.push_back({0, 1, 0});
    symbols.insert(symbols.end(), ones, Symbol{0, 1, 0});
    const Bytes before{0xFF, 0xFF};
    const Bytes bytes = put(symbols, before);
    ASSERT_EQ(bytes[0], 0xFF);
    ASSERT_EQ(bytes[1], 0xFF);
    expectGets(ByteSpan(bytes).subspan(2), symbols);
  }
}

TEST(RangeCoder, RoundTripsSkewedRunsWithSurprises) {
  for (const std::uint32_t common : {0u, 1u}) {
    std::vector<Symbol> symbols;
    for (std::uint32_t i = 0; i < 20000; ++i) {
      symbols.push_back({0, 1, i % 997 == 996 ? 1 - common : common});
      if (i % 1500 == 0) symbols.push_back({-1, 12, 0xFFF});
    }
    expectGets(put(symbols), symbols);
  }
}

TEST(RangeCoder, CostsAboutTheEntropy) {
  made::Random random(3);
  std::vector<Symbol> symbols;
  for (int i = 0; i < 100000; ++i) symbols.push_back({0, 1, random() % 10 == 0});
  const double entropy = -100000 * (0.1 * std::log2(0.1) + 0.9 * std::log2(0.9)) / 8;
  const double size = static_cast<double>(put(symbols).size());
  EXPECT_GT(size, entropy * 0.97);
  EXPECT_LT(size, entropy * 1.02);
}

TEST(RangeCoder, LongRunsStayAboveTheBoundOfTheSpecification) {
  // 512 vertices a byte of three decisions each must not be reachable (spec codec 6.1).
  const std::size_t count = 1000000;
  const Bytes bytes = put(std::vector<Symbol>(count, Symbol{0, 1, 1}));
  EXPECT_LT(count, bytes.size() * 3 * 512);
}

TEST(RangeCoder, EndsInAtMostFourBytes) {
  EXPECT_TRUE(put({}).empty());
  for (std::uint32_t value = 0; value < 256; ++value) {
    const Bytes bytes = put({{-1, 8, value}});
    EXPECT_LE(bytes.size(), 1u);  // all ones is the lowest value; eight raw bits fit a byte
    expectGets(bytes, {{-1, 8, value}});
  }
  made::Random random(4);
  for (std::size_t count = 1; count < 400; ++count) {
    std::vector<Symbol> symbols;
    for (std::size_t i = 0; i < count; ++i) symbols.push_back({-1, 1, random() & 1});
    const Bytes bytes = put(symbols);
    EXPECT_LE(bytes.size(), count / 8 + 5);
    expectGets(bytes, symbols);
  }
}

TEST(RangeCoder, TellsOverrunAndLeftOver) {
  made::Random random(5);
  std::vector<Symbol> symbols;
  for (int i = 0; i < 1000; ++i) symbols.push_back({-1, 8, random() & 255});
  Bytes bytes = put(symbols);

  const auto read = [&](ByteSpan from, std::size_t count) {
    RangeGet coder(from);
    for (std::size_t i = 0; i < count; ++i) coder.raw(8, 0);
    return std::pair(coder.finished(), coder.overrun());
  };
  EXPECT_EQ(read(bytes, 1000), std::pair(true, false));
  EXPECT_EQ(read(bytes, 900), std::pair(false, false));  // bytes are left over
  EXPECT_EQ(read(bytes, 1100), std::pair(false, true));  // more than there is
  bytes.resize(bytes.size() + 12);
  EXPECT_EQ(read(bytes, 1000), std::pair(false, false));
  bytes.resize(500);
  EXPECT_EQ(read(bytes, 1000), std::pair(false, true));
}

TEST(RangeCoder, DrawsTheLineWhereTheSpecificationDoes) {
  // Eight bytes are taken at the start, four more at each renormalisation; 32 raw bits make the first.
  RangeGet nothing{ByteSpan{}};
  nothing.raw(31, 0);
  EXPECT_TRUE(nothing.finished());
  nothing.raw(1, 0);
  EXPECT_TRUE(nothing.overrun());
  for (const std::size_t size : {3u, 4u, 8u, 9u}) {
    const Bytes zeros(size, 0);
    RangeGet coder(zeros);
    EXPECT_EQ(coder.finished(), size <= 8) << size;
    coder.raw(32, 0);
    EXPECT_EQ(coder.overrun(), size < 4) << size;
    EXPECT_EQ(coder.finished(), size >= 4) << size;
  }
}

TEST(Residual, RoundTripsEveryMagnitude) {
  Bytes bytes;
  RangePut put_coder(bytes);
  ResidualModels put_models;
  for (std::int32_t value = -65535; value <= 65535; ++value) codeResidual(put_coder, put_models, value);
  put_coder.finish();
  RangeGet get_coder(bytes);
  ResidualModels get_models;
  for (std::int32_t value = -65535; value <= 65535; ++value)
    ASSERT_EQ(codeResidual(get_coder, get_models, 0), value);
  EXPECT_TRUE(get_coder.finished());
}

TEST(Residual, DecodesAnyBytesWithinItsRange) {
  made::Random random(6);
  for (int trial = 0; trial < 200; ++trial) {
    Bytes bytes(random() % 200);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(trial % 2 == 0 ? random() : 0xFF);
    RangeGet coder(bytes);
    ResidualModels models;
    while (!coder.overrun()) {
      const std::int32_t value = codeResidual(coder, models, 0);
      ASSERT_LE(std::abs(value), 65535);
    }
  }
}

}  // namespace
}  // namespace isoreel
