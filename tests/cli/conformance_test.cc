// SPDX-License-Identifier: BSD-3-Clause
// Vectors that differ from their manifest are told one by one.
#include "support.h"

namespace isoreel::cli {
namespace {

class ConformanceTest : public CliTest {
 protected:
  /// A folder v/ with the vectors of that name, whose manifest went through `change`.
  void vectors(const std::string& list, const std::string& name,
               const std::function<void(nlohmann::json&)>& change) const {
    ok("mkdir -p v && cp " ISOREEL_VECTORS "/* v");
    nlohmann::json manifest = nlohmann::json::parse(content("v/manifest.json"));
    for (auto& [kind, entries] : manifest.items()) {
      nlohmann::json kept = nlohmann::json::array();
      for (auto& entry : entries) {
        if (kind != list || entry["name"] != name) continue;
        change(entry);
        kept.push_back(entry);
      }
      entries = kept;
    }
    write("v/manifest.json", manifest.dump());
  }
  void expectDifference(const std::string& what) const {
    const Outcome outcome = sh("isoreel conformance v --json");
    EXPECT_EQ(outcome.code, 1);
    EXPECT_EQ(outcome.err, "isoreel conformance: v: 1 of 1 vector differ\n");
    const auto found = nlohmann::json::parse(outcome.out);
    EXPECT_FALSE(found["ok"].get<bool>());
    ASSERT_EQ(found["differences"].size(), 1u) << outcome.out;
    EXPECT_EQ(found["differences"][0]["what"], what);
  }
};

TEST_F(ConformanceTest, WhatDiffersIsListed) {
  vectors("accept", "smallest", [](auto&) {});
  EXPECT_EQ(ok("isoreel conformance v"), "v: 1 vector, all decode as they should\n");
  vectors("accept", "smallest", [](auto& entry) { entry["hash"] = "0000000000000000"; });
  expectDifference("surface");
  EXPECT_NE(sh("isoreel conformance v").out.find("smallest: surface: {"), std::string::npos);
  vectors("accept", "sphere_cut", [](auto& entry) { entry["levels"][2]["faces"] = 1; });
  const Outcome outcome = sh("isoreel conformance v");
  EXPECT_NE(outcome.out.find("sphere_cut: level 2"), std::string::npos) << outcome.out;
  vectors("reject", "wrong_hash", [](auto& entry) { entry["error"] = "another reason"; });
  expectDifference("packet");
  vectors("sequences", "translated_sphere", [](auto& entry) { entry["packets"][1]["vertices"] = 1; });
  expectDifference("translated_sphere.1.packet");
  vectors("files", "file_hidden", [](auto& entry) { entry["tracks"][0]["frames"][0]["hidden"] = false; });
  expectDifference("tracks");
  vectors("files", "payload_crc", [](auto& entry) { entry["pipe"].erase("error"); });
  expectDifference("pipe");
  vectors("reject_files", "version_2", [](auto& entry) { entry["file"] = "file_plain.isr"; });
  expectDifference("file");
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
