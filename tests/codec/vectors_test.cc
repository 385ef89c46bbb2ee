// SPDX-License-Identifier: BSD-3-Clause
// The golden packets of spec/vectors: what they decode to may never change.
#include <isoreel/codec/decoder.h>

#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

namespace isoreel {
namespace {

const std::string kFolder = std::string(ISOREEL_SPEC) + "/vectors/";

Bytes fileNamed(const std::string& name) {
  std::ifstream in(kFolder + name, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

Bytes fileOf(const nlohmann::json& entry) { return fileNamed(entry.at("file").get<std::string>()); }

nlohmann::json manifest() {
  std::ifstream in(kFolder + "manifest.json");
  return nlohmann::json::parse(in);
}

void expectSummary(const Result<Surface>& surface, const nlohmann::json& expected) {
  ASSERT_TRUE(surface.ok()) << surface.error().message;
  char hash[17];
  std::snprintf(hash, sizeof hash, "%016llx", static_cast<unsigned long long>(surfaceHash(*surface)));
  EXPECT_EQ(surface->vertices.size(), expected.at("vertices").get<std::size_t>());
  EXPECT_EQ(surface->quads.size(), expected.at("faces").get<std::size_t>());
  EXPECT_EQ(hash, expected.at("hash").get<std::string>());
}

TEST(Vectors, DecodeToWhatTheManifestSays) {
  const nlohmann::json list = manifest();
  ASSERT_GE(list.at("accept").size(), 12u);
  Decoder decoder;
  for (const auto& entry : list.at("accept")) {
    SCOPED_TRACE(entry.at("name").get<std::string>());
    const Bytes packet = fileOf(entry);
    ASSERT_LT(packet.size(), 20000u);
    expectSummary(decoder.decode(packet), entry);
    const auto& levels = entry.at("levels");
    for (std::uint32_t level = 0; level < levels.size(); ++level) {
      DecodeOptions options;
      options.level = level;
      expectSummary(decoder.decode(packet, options), levels[level]);
    }
    DecodeOptions options;
    options.allow_prefix = true;
    for (const auto& prefix : entry.at("prefixes")) {
      const ByteSpan cut = ByteSpan(packet).first(prefix.at("bytes").get<std::size_t>());
      EXPECT_FALSE(decoder.decode(cut).ok());
      expectSummary(decoder.decode(cut, options), levels.at(prefix.at("level").get<std::size_t>()));
    }
  }
}

TEST(Vectors, SequencesDecodeToWhatTheManifestSays) {
  const nlohmann::json list = manifest();
  ASSERT_GE(list.at("sequences").size(), 10u);
  int prefixes = 0;
  for (const auto& entry : list.at("sequences")) {
    SCOPED_TRACE(entry.at("name").get<std::string>());
    std::vector<Bytes> packets;
    Decoder decoder;
    for (const auto& packet : entry.at("packets")) {
      SCOPED_TRACE(packet.at("file").get<std::string>());
      packets.push_back(fileOf(packet));
      expectSummary(decoder.decode(packets.back()), packet);
    }
    ASSERT_GE(packets.size(), 3u);
    const auto last = [&](std::size_t bytes, const DecodeOptions& options) {
      Decoder anew;
      for (std::size_t i = 0; i + 1 < packets.size(); ++i) EXPECT_TRUE(anew.decode(packets[i]).ok());
      return anew.decode(ByteSpan(packets.back()).first(bytes), options);
    };
    DecodeOptions options;
    for (std::uint32_t level = 0; level < entry.at("levels").size(); ++level) {
      options.level = level;
      expectSummary(last(packets.back().size(), options), entry.at("levels")[level]);
    }
    options = {};
    options.allow_prefix = true;
    const auto& prefix = entry.at("prefix");
    expectSummary(last(prefix.at("bytes").get<std::size_t>(), options), prefix);
    for (const auto& cut : entry.at("prefixes")) {
      const std::size_t level = cut.at("level").get<std::size_t>();
      SCOPED_TRACE("cut behind level " + std::to_string(level));
      expectSummary(last(cut.at("bytes").get<std::size_t>(), options), entry.at("levels").at(level));
      ++prefixes;
    }
  }
  EXPECT_GT(prefixes, 20);
}

void expectRefused(const Result<Surface>& surface, const nlohmann::json& entry) {
  ASSERT_FALSE(surface.ok());
  EXPECT_NE(surface.error().message.find(entry.at("error").get<std::string>()), std::string::npos)
      << surface.error().message;
}

TEST(Vectors, AreRefusedForTheReasonTheManifestGives) {
  const nlohmann::json list = manifest();
  ASSERT_GE(list.at("reject").size(), 10u);
  for (const auto& entry : list.at("reject")) {
    SCOPED_TRACE(entry.at("name").get<std::string>());
    const Bytes packet = fileOf(entry);
    ASSERT_FALSE(packet.empty());
    expectRefused(Decoder().decode(packet), entry);
  }
  ASSERT_GE(list.at("reject_after").size(), 10u);
  for (const auto& entry : list.at("reject_after")) {
    SCOPED_TRACE(entry.at("name").get<std::string>());
    Decoder decoder;
    for (const auto& before : entry.at("after"))
      ASSERT_TRUE(decoder.decode(fileNamed(before.get<std::string>())).ok());
    expectRefused(decoder.decode(fileOf(entry)), entry);
  }
}

}  // namespace
}  // namespace isoreel
