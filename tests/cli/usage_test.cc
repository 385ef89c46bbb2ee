// SPDX-License-Identifier: BSD-3-Clause
// What the command says of itself, and to those who mistype.
#include "support.h"

namespace isoreel::cli {
namespace {

class UsageTest : public CliTest {};

constexpr std::array<const char*, 7> kVerbs{"encode",  "decode", "info", "verify",
                                            "compare", "render", "demo"};

TEST_F(UsageTest, HelpOfEveryVerb) {
  const std::string help = ok("isoreel --help");
  for (const char* verb : kVerbs) {
    EXPECT_NE(help.find(fmt::format("\n  {} ", verb)), std::string::npos) << verb;
    EXPECT_NE(ok(fmt::format("isoreel {} --help", verb)).find("Usage: isoreel " + std::string(verb)),
              std::string::npos);
  }
  EXPECT_TRUE(ok("isoreel --version").starts_with("isoreel "));
}

TEST_F(UsageTest, HelpTellsDefaults) {
  const auto tells = [&](const std::string& verb, const std::vector<std::string>& parts) {
    const std::string help = ok("isoreel " + verb + " --help");
    for (const std::string& part : parts)
      EXPECT_NE(help.find(part), std::string::npos) << part << "\n" << help;
  };
  tells("encode", {"=1/16", "=25", "=qef", "=error", "=main", "=auto", "=12", "=default", "=volume", "]=0",
                   "default: 0 for level sets", "default: below for level sets, else above", "default: all"});
  tells("decode", {"]=0", "default: all"});
  tells("compare", {"default: 200000", "=qef", "=error", "]=0"});
  tells("render", {"=35,25", "]=1\n", "]=12", "default: 1280x960"});
  tells("demo", {"=demo-output"});
  EXPECT_EQ(ok("isoreel encode --help").find("=[]"), std::string::npos);
}

TEST_F(UsageTest, MistakesAreNamed) {
  fails("isoreel", 2, "--help");
  fails("isoreel encodee in.json", 2, "'encodee' is no verb");
  fails("isoreel --wurst", 2, "--wurst");
  for (const char* verb : kVerbs) fails(fmt::format("isoreel {} --wurst", verb), 2, "--wurst");
  fails("isoreel info", 2, "input");
  fails("isoreel encode in.json --iso 0", 2, "--output");
  fails("isoreel encode in.json -o x.isr --iso", 2, "--iso");
  fails("isoreel encode in.json -o '' --iso 0", 2, "--output");
  fails("isoreel info a.isr b.isr", 2, "b.isr");
  for (const char* bad : {"-1", "257", "x"})
    fails(fmt::format("isoreel verify x.isr --jobs={}", bad), 2, "--jobs");
  fails("isoreel encode x -o y --iso 0 --frame-types both", 2, "--frame-types");
  fails("isoreel compare a.isr", 2, "input");
  fails("isoreel compare a.isr b.json --samples 5", 2, "--samples");
}

}  // namespace
}  // namespace isoreel::cli
