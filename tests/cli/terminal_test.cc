// SPDX-License-Identifier: BSD-3-Clause
// Progress is for people: on a terminal, and nowhere else.
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include "support.h"

namespace isoreel::cli {
namespace {

class TerminalTest : public CliTest {
 protected:
  /// What a person sees of `line`, which must succeed.
  std::string onTerminal(const std::string& line) const {
    int terminal = -1;
    const pid_t child = forkpty(&terminal, nullptr, nullptr, nullptr);
    if (child == 0) {
      if (chdir(folder_.c_str()) == 0) execl("/bin/sh", "sh", "-c", line.c_str(), nullptr);
      _exit(127);
    }
    std::string seen;
    std::array<char, 4096> buffer{};
    for (ssize_t got = 0; (got = read(terminal, buffer.data(), buffer.size())) > 0;)
      seen.append(buffer.data(), static_cast<std::size_t>(got));
    close(terminal);
    EXPECT_EQ(wait(child), 0) << seen;
    return seen;
  }
};

TEST_F(TerminalTest, LongWorkShowsRateAndTimeLeft) {
  int terminal = -1, other = -1;
  if (openpty(&terminal, &other, nullptr, nullptr, nullptr) != 0) GTEST_SKIP() << "no pseudo-terminals here";
  close(terminal);
  close(other);
  longSequence(1200);
  const std::string seen = onTerminal("isoreel encode long.json -o long.isr --iso 0");
  EXPECT_NE(seen.find("/1200 frames"), std::string::npos) << seen;
  EXPECT_NE(seen.find(" a second"), std::string::npos) << seen;
  EXPECT_NE(seen.find(" s left"), std::string::npos) << seen;
  // The line is wiped before the summary.
  const std::size_t summary = seen.find("long.isr: 1200 frames");
  ASSERT_NE(summary, std::string::npos) << seen;
  EXPECT_EQ(seen.substr(summary - 4, 4), "\r\x1b[K") << seen;
  EXPECT_EQ(seen.find("/1200 frames", summary), std::string::npos);
  // With stderr elsewhere nothing of it, terminal or not.
  const std::string quiet = onTerminal("isoreel encode long.json -o long.isr --iso 0 --force 2>err");
  EXPECT_EQ(quiet.find('\x1b'), std::string::npos) << quiet;
  EXPECT_EQ(content("err"), "");
}

TEST_F(TerminalTest, EveryVerbIsSilentOnStderrWithoutATerminal) {
  longSequence(300);  // ok() expects an empty stderr
  ok("isoreel encode long.json -o long.isr --iso 0 --jobs 1");
  ok("isoreel verify long.isr");
  ok("isoreel decode long.isr --discard");
  ok("isoreel info long.isr");
  ok("isoreel compare long.isr long.json --frames :20 --samples 1000");
  ok("isoreel render long.isr -o r/%d.png --frames :20 --size 16x16");
}

}  // namespace
}  // namespace isoreel::cli
