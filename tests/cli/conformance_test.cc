// SPDX-License-Identifier: BSD-3-Clause
// Vectors that differ from their manifest are told one by one.
#include <map>

#include "support.h"

namespace isoreel::cli {
namespace {

class ConformanceTest : public CliTest {
 protected:
  /// v/ with all vectors, whose manifest has those that `changes` names, changed.
  using Changes = std::map<std::string, std::function<void(nlohmann::json&)>>;
  void vectors(const Changes& changes) const {
    ok("mkdir -p v && cp " ISOREEL_VECTORS "/* v");
    nlohmann::json manifest = nlohmann::json::parse(content("v/manifest.json"));
    for (auto& list : manifest) {
      nlohmann::json kept = nlohmann::json::array();
      for (auto& entry : list) {
        const auto change = changes.find(entry["name"]);
        if (change == changes.end()) continue;
        change->second(entry);
        kept.push_back(entry);
      }
      list = kept;
    }
    write("v/manifest.json", manifest.dump());
  }
};

TEST_F(ConformanceTest, WhatDiffersIsListed) {
  vectors({{"smallest", [](auto& entry) { entry["hash"] = "0000000000000000"; }},
           {"sphere_cut", [](auto& entry) { entry["prefixes"][0]["level"] = 3; }},
           {"wrong_hash", [](auto& entry) { entry["error"] = "another reason"; }},
           {"translated_sphere", [](auto& entry) { entry["packets"][1]["vertices"] = 1; }},
           {"file_hidden", [](auto& entry) { entry["tracks"][0]["frames"][0]["hidden"] = false; }},
           {"payload_crc", [](auto& entry) { entry["pipe"].erase("error"); }},
           {"version_2", [](auto& entry) { entry["file"] = "file_plain.isr"; }},
           {"torus", [](auto&) {}}});
  const Outcome outcome = sh("isoreel conformance v --json");
  EXPECT_EQ(outcome.code, 1);
  EXPECT_EQ(outcome.err, "isoreel conformance: v: 7 of 8 vectors differ\n");
  const auto found = nlohmann::json::parse(outcome.out);
  EXPECT_FALSE(found["ok"].get<bool>());
  std::map<std::string, std::string> what;
  for (const auto& each : found["differences"]) what[each["vector"]] += each["what"].get<std::string>();
  const std::map<std::string, std::string> expected{
      {"smallest", "surface"}, {"wrong_hash", "packet"},  {"translated_sphere", "translated_sphere.1.packet"},
      {"payload_crc", "pipe"}, {"file_hidden", "tracks"}, {"version_2", "file"}};
  EXPECT_TRUE(what["sphere_cut"].starts_with("its first ")) << what["sphere_cut"];
  what.erase("sphere_cut");
  EXPECT_EQ(what, expected);
  EXPECT_NE(sh("isoreel conformance v").out.find("smallest: surface: {"), std::string::npos);
  vectors({{"smallest", [](auto&) {}}});
  EXPECT_EQ(ok("isoreel conformance v"), "v: 1 vector, all decode as they should\n");
}

TEST_F(ConformanceTest, AFolderThatCannotBeRunIsNamed) {
  fails("isoreel conformance nowhere", 1, "nowhere: manifest.json: cannot be read");
  ok("mkdir v");
  for (const auto& [text, part] : std::vector<std::pair<std::string, std::string>>{
           {"{", "manifest.json"},
           {"{}", "it lists no vectors"},
           {R"({"wishes":[{"name":"a"}]})", "what are 'wishes'"},
           {R"({"accept":[{"name":"a","file":"a.packet"}]})", "a.packet: cannot be read"},
           {R"({"accept":[{"file":"a.packet"}]})", "key 'name' not found"}}) {
    write("v/manifest.json", text);
    fails("isoreel conformance v", 1, part);
  }
}

}  // namespace
}  // namespace isoreel::cli
