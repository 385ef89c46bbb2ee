// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <bit>
#include <limits>

#include "made.h"
#include "packets.h"

namespace isoreel {
namespace {

Bytes written(const Configuration& configuration) {
  auto record = writeConfiguration(configuration);
  EXPECT_TRUE(record.ok()) << record.status().message();
  return record.ok() ? *std::move(record) : Bytes{};
}

Configuration placed() {
  Configuration c;
  c.profile = Profile::kClassic;
  c.inside = Inside::kBelow;
  c.grid = made::gridOf(513, 2, 65536);
  c.grid.origin = {1.5, -2e300, 3};
  c.grid.spacing = {0.1, 0.2, 0.3};
  c.grid.direction = {0, -1, 0, 1, 0, 0, 0, 0, 1};
  c.step = 77;
  c.time_base = {1001, 30000};
  return c;
}

TEST(ConfigurationRecord, RoundTripsWithAnEvenLength) {
  std::vector<Configuration> list{Configuration{}, placed()};
  list.push_back(placed());
  list.back().grid.spacing = {0.25, 0.25, 0.25};
  for (int without = 0; without < 3; ++without) {
    list.push_back(placed());
    const Grid plain;
    if (without == 0) list.back().grid.origin = plain.origin;
    if (without == 1) list.back().grid.spacing = plain.spacing;
    if (without == 2) list.back().grid.direction = plain.direction;
  }
  list.push_back(placed());
  list.back().tools = kToolPrediction;
  for (std::uint32_t step = 1; step <= 16384; step *= 2) {
    list.push_back(Configuration{});
    list.back().step = step;
    list.back().grid.nodes = {step + 1, 2, 3};
  }
  for (const Configuration& configuration : list) {
    const Bytes record = written(configuration);
    EXPECT_EQ(record.size() % 2, 0u);
    const auto back = readConfiguration(record);
    ASSERT_TRUE(back.ok()) << back.error().message;
    EXPECT_EQ(*back, configuration);
  }
}

TEST(ConfigurationRecord, WriterRefusesWhatAReaderWould) {
  const auto refuses = [](const auto& change) {
    Configuration configuration = placed();
    change(configuration);
    return !writeConfiguration(configuration).ok();
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(refuses([](Configuration&) {}));
  EXPECT_TRUE(refuses([](Configuration& c) { c.profile = static_cast<Profile>(2); }));
  EXPECT_TRUE(refuses([](Configuration& c) { c.inside = static_cast<Inside>(2); }));
  EXPECT_TRUE(refuses([](Configuration& c) { c.tools = 2; }));
  EXPECT_TRUE(refuses([](Configuration& c) {
    c.profile = Profile::kMain;
    c.tools = 16;
  }));
  EXPECT_TRUE(refuses([](Configuration& c) { c.grid.nodes[0] = 1; }));
  EXPECT_TRUE(refuses([](Configuration& c) { c.grid.nodes[2] = 65537; }));
  EXPECT_TRUE(refuses([](Configuration& c) { c.step = 0; }));
  EXPECT_TRUE(refuses([](Configuration& c) { c.step = 16385; }));
  EXPECT_TRUE(refuses([](Configuration& c) { c.time_base.numerator = 0; }));
  EXPECT_TRUE(refuses([](Configuration& c) { c.time_base.denominator = 0; }));
  EXPECT_TRUE(refuses([&](Configuration& c) { c.grid.origin[1] = nan; }));
  EXPECT_TRUE(refuses([](Configuration& c) { c.grid.spacing = {0, 0, 0}; }));
  EXPECT_TRUE(refuses([](Configuration& c) { c.grid.spacing[2] = -1; }));
  EXPECT_TRUE(refuses([&](Configuration& c) { c.grid.direction[8] = nan; }));
}

/// The message about a record whose fields start with profile, inside, tools, nodes (2, 2, 2) …, with one
/// byte changed.
std::string changed(std::size_t at, std::uint8_t value) {
  Configuration classic;
  classic.profile = Profile::kClassic;
  Bytes record = written(classic);
  made::changeRecord(record, at, value);
  const auto result = readConfiguration(record);
  return result.ok() ? "fine" : result.error().message;
}

TEST(ConfigurationRecord, ReaderRefusesEachValueOutOfItsRange) {
  // Head of 8 bytes; profile 8, inside 9, tools 10, nodes 11 to 13, step (1024: two bytes) 14, time base 16
  // and 17, has origin 18, spacing kind 19, has direction 20.
  const auto has = [](const std::string& text, const char* part) {
    return text.find(part) != std::string::npos;
  };
  EXPECT_EQ(changed(9, 0), "fine");
  EXPECT_TRUE(has(changed(0, 'X'), "does not start with ISRL"));
  EXPECT_TRUE(has(changed(4, 2), "version 2, where this build reads version 1"));
  EXPECT_EQ(changed(5, 200), "fine") << "minor versions are for readers to skip";
  EXPECT_TRUE(has(changed(6, 12), "length"));
  EXPECT_TRUE(has(changed(8, 2), "profile 2 is above 1 (spec codec 2.2)"));
  EXPECT_TRUE(has(changed(9, 2), "inside 2 is above 1"));
  EXPECT_EQ(changed(10, 1), "fine") << "prediction";
  EXPECT_TRUE(has(changed(10, 2), "tools 2 is above 1"));
  for (std::size_t axis = 0; axis < 3; ++axis) EXPECT_TRUE(has(changed(11 + axis, 1), "nodes 1 is below 2"));
  EXPECT_TRUE(has(changed(15, 0), "step is not a canonical varint"));
  EXPECT_TRUE(has(changed(16, 0), "time base numerator 0 is below 1"));
  EXPECT_TRUE(has(changed(17, 0), "time base denominator 0 is below 1"));
  EXPECT_TRUE(has(changed(18, 2), "has origin 2 is above 1"));
  EXPECT_TRUE(has(changed(18, 1), "ends inside origin"));
  EXPECT_TRUE(has(changed(19, 3), "spacing kind 3 is above 2"));
  EXPECT_TRUE(has(changed(20, 2), "has direction 2 is above 1"));
}

TEST(ConfigurationRecord, RefusesSpacingThatIsNotAboveZeroAndNumbersThatAreNotFinite) {
  // Origin stands at 19 behind its flag, in placed() whose nodes take 6 bytes and whose step takes 1.
  const Bytes good = written(placed());
  ASSERT_TRUE(readConfiguration(good).ok());
  std::size_t origin = 0;
  for (std::size_t at = 8; at + 8 <= good.size() && origin == 0; ++at) {
    ByteReader in(ByteSpan(good).subspan(at));
    if (std::bit_cast<double>(in.fixed<std::uint64_t>()) == 1.5) origin = at;
  }
  ASSERT_NE(origin, 0u);
  const auto with = [&](std::size_t at, double value) {
    Bytes record = good;
    const std::uint64_t bits = std::bit_cast<std::uint64_t>(value);
    for (std::size_t i = 0; i < 8; ++i)
      made::changeRecord(record, at + i, static_cast<std::uint8_t>(bits >> (8 * i)));
    const auto result = readConfiguration(record);
    return result.ok() ? std::string("fine") : result.error().message;
  };
  const std::size_t spacing = origin + 24 + 1, direction = spacing + 24 + 1;
  EXPECT_EQ(with(spacing, 7.0), "fine");
  EXPECT_NE(with(spacing + 8, 0.0).find("spacing is not above 0"), std::string::npos);
  EXPECT_NE(with(spacing, -0.5).find("spacing is not above 0"), std::string::npos);
  for (const std::size_t at : {origin, spacing + 16, direction, direction + 64}) {
    EXPECT_NE(with(at, std::numeric_limits<double>::infinity()).find("is not finite"), std::string::npos);
    EXPECT_NE(with(at, std::numeric_limits<double>::quiet_NaN()).find("is not finite"), std::string::npos);
  }
}

TEST(ConfigurationRecord, VersionAboveOursIsUnsupported) {
  Configuration classic;
  classic.profile = Profile::kClassic;
  Bytes record = written(classic);
  made::changeRecord(record, 4, 2);
  const auto result = readConfiguration(record);
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code, ErrorCode::kUnsupported);
}

TEST(ConfigurationRecord, FindsEveryFlippedBitAndEveryCut) {
  Bytes record = written(placed());
  for (std::size_t bit = 0; bit < record.size() * 8; ++bit) {
    record[bit / 8] = static_cast<std::uint8_t>(record[bit / 8] ^ 1u << (bit % 8));
    // The minor version is not guarded less than the rest: the CRC covers it.
    ASSERT_FALSE(readConfiguration(record).ok()) << bit;
    record[bit / 8] = static_cast<std::uint8_t>(record[bit / 8] ^ 1u << (bit % 8));
  }
  for (std::size_t size = 0; size < record.size(); ++size) {
    EXPECT_FALSE(readConfiguration(ByteSpan(record).first(size)).ok());
  }
  record.push_back(0);
  EXPECT_FALSE(readConfiguration(record).ok());
}

TEST(ConfigurationRecord, BytesBehindItsFieldsAreSkipped) {
  const Bytes record = written(placed());
  Bytes longer(record.begin(), record.end() - 4);
  longer.insert(longer.end(), 30, 0xEE);
  longer.resize(longer.size() + 4);
  longer[6] = static_cast<std::uint8_t>(longer.size());
  longer[7] = static_cast<std::uint8_t>(longer.size() >> 8);
  made::changeRecord(longer, 5, 1);
  const auto back = readConfiguration(longer);
  ASSERT_TRUE(back.ok()) << back.error().message;
  EXPECT_EQ(*back, placed());
}

TEST(PacketHeaderSyntax, RoundTripsEveryField) {
  made::Parts parts;
  PacketHeader& h = parts.header;
  h.number = ~std::uint64_t{0};
  h.time = std::numeric_limits<std::int64_t>::min();
  h.duration = std::uint64_t{1} << 63;
  h.isovalue = -1e-300;
  h.step = 1;
  h.tangential_step = 16384;
  h.vertices = 0xFFFFFFFF;
  h.faces = 3;
  h.surface_hash = 0x0123456789ABCDEFull;
  h.configuration = written(placed());
  h.sections = {{1, 0, 0}, {0xFFFFFFFF, 255, 0}};
  parts.sections = {Bytes(5, 1), Bytes(300, 2)};
  const made::Parts back = made::taken(made::joined(parts));
  EXPECT_EQ(back.header.number, h.number);
  EXPECT_EQ(back.header.time, h.time);
  EXPECT_EQ(back.header.duration, h.duration);
  EXPECT_EQ(back.header.isovalue, h.isovalue);
  EXPECT_EQ(back.header.step, h.step);
  EXPECT_EQ(back.header.tangential_step, h.tangential_step);
  EXPECT_EQ(back.header.vertices, h.vertices);
  EXPECT_EQ(back.header.faces, h.faces);
  EXPECT_EQ(back.header.surface_hash, h.surface_hash);
  EXPECT_EQ(back.header.configuration, h.configuration);
  EXPECT_EQ(back.sections, parts.sections);
  EXPECT_EQ(back.header.sections[1].kind, 0xFFFFFFFFu);

  h.type = PacketType::kPredicted;
  h.configuration.clear();
  h.references = {1000};
  EXPECT_EQ(made::taken(made::joined(parts)).header.references, h.references);
}

TEST(PacketHeaderSyntax, WriterRefusesWhatBreaksItsRules) {
  const auto refuses = [](const auto& change) {
    PacketHeader header;
    header.configuration = written(Configuration{});
    change(header);
    return !writePacket(header, {}).ok();
  };
  EXPECT_FALSE(refuses([](PacketHeader&) {}));
  EXPECT_TRUE(refuses([](PacketHeader& h) { h.configuration.clear(); }));
  EXPECT_TRUE(refuses([](PacketHeader& h) { h.configuration.resize(4097); }));
  EXPECT_TRUE(refuses([](PacketHeader& h) { h.type = PacketType::kPredicted; }));
  EXPECT_TRUE(refuses([](PacketHeader& h) { h.type = static_cast<PacketType>(2); }));
  EXPECT_TRUE(refuses([](PacketHeader& h) { h.references = {1}; }));
  const auto refuses_predicted = [&](std::vector<std::uint64_t> references, std::uint64_t number) {
    return refuses([&](PacketHeader& h) {
      h.type = PacketType::kPredicted;
      h.configuration.clear();
      h.references = std::move(references);
      h.number = number;
    });
  };
  EXPECT_FALSE(refuses_predicted({1}, 1));
  EXPECT_FALSE(refuses_predicted({7}, 7));
  EXPECT_TRUE(refuses_predicted({}, 7)) << "a P packet has one reference";
  EXPECT_TRUE(refuses_predicted({1, 2}, 7));
  EXPECT_TRUE(refuses_predicted({0}, 7));
  EXPECT_TRUE(refuses_predicted({8}, 7)) << "there is no frame before the first";
  EXPECT_TRUE(refuses_predicted({1}, 0));
  EXPECT_TRUE(refuses([](PacketHeader& h) { h.step = 0; }));
  EXPECT_TRUE(refuses([](PacketHeader& h) { h.tangential_step = 16385; }));
  EXPECT_TRUE(refuses([](PacketHeader& h) { h.isovalue = std::numeric_limits<double>::infinity(); }));
  EXPECT_TRUE(refuses([](PacketHeader& h) { h.sections.resize(257); }));
  EXPECT_TRUE(refuses([](PacketHeader& h) { h.sections = {{1, 256, 0}}; }));
}

}  // namespace
}  // namespace isoreel
