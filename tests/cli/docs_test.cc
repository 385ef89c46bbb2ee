// SPDX-License-Identifier: BSD-3-Clause
// Man pages and completion tell what --help tells.
#include <regex>
#include <set>

#include "support.h"

namespace isoreel::cli {
namespace {

class DocsTest : public CliTest {
 protected:
  DocsTest() { ok("mkdir docs && isoreel docs docs"); }
  /// Words that match in a text, once each.
  static std::set<std::string> found(std::string text, const char* pattern) {
    std::set<std::string> words;
    const std::regex regex(pattern);
    for (std::sregex_iterator i(text.begin(), text.end(), regex), end; i != end; ++i) words.insert((*i)[1]);
    return words;
  }
  /// What bash would offer behind `line`, whose last word is being typed.
  std::string offered(const std::string& line) const {
    return ok("bash -c 'source docs/isoreel.bash; COMP_WORDS=(" + line +
              "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _isoreel; echo \"${COMPREPLY[*]}\"'");
  }
};

TEST_F(DocsTest, PagesHaveEveryVerbAndOption) {
  const std::set<std::string> verbs = found(content("docs/isoreel.1"), R"(\\fBisoreel\\-(\w+)\\fR)");
  EXPECT_EQ(verbs, found(ok("isoreel --help"), R"(\n  (\w+) {2,})"));
  EXPECT_GE(verbs.size(), 16u);
  EXPECT_EQ(list("docs").size(), verbs.size() + 2);
  for (const std::string& verb : verbs) {
    const std::string page =
        std::regex_replace(content("docs/isoreel-" + verb + ".1"), std::regex(R"(\\-)"), "-");
    for (const std::string& option : found(ok("isoreel " + verb + " --help"), R"(\n  (?:-\w,)?(--[\w-]+))"))
      EXPECT_NE(page.find(option), std::string::npos) << verb << " " << option;
  }
  EXPECT_EQ(ok("isoreel --help").find("docs"), std::string::npos);
  fails("isoreel docs docs", 1, "is there already");
  ok("isoreel docs docs --force");
}

TEST_F(DocsTest, BashOffersVerbsOptionsAndValues) {
  EXPECT_EQ(offered("isoreel enc"), "encode\n");
  EXPECT_EQ(offered("isoreel encode --prof"), "--profile\n");
  EXPECT_EQ(offered("isoreel encode --profile ma"), "main\n");
  EXPECT_EQ(offered("isoreel encode --sync \"\""), "none gop\n");
  EXPECT_EQ(offered("isoreel encode some-fi"), "\n");  // file names, by bash
}

}  // namespace
}  // namespace isoreel::cli
