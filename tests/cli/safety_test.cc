// SPDX-License-Identifier: BSD-3-Clause
// Nothing is lost or half-written: existing files, interruptions, full disks, closed pipes.
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <thread>

#include "support.h"

namespace isoreel::cli {
namespace {

class SafetyTest : public CliTest {
 protected:
  /// Waits until the part has some frames.
  bool growing(const std::string& part) const {
    for (int i = 0; i < 2000; ++i) {
      std::error_code ignored;
      const auto size = std::filesystem::file_size(folder_ / part, ignored);
      if (!ignored && size > 20'000) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
  }
  /// The frames of a part are whole and decode; at most the one that was being written is missing.
  std::uint64_t framesOfPart(const std::string& part) const {
    const auto info = json("isoreel info " + part + " --json");
    EXPECT_EQ(info["indexed"], false);
    EXPECT_LE(info["damage"].size(), 1u);
    const Outcome decoded = sh("isoreel decode " + part + " --discard --json");
    EXPECT_EQ(decoded.code, 0) << decoded.err;
    EXPECT_EQ(nlohmann::json::parse(decoded.out)["frames"], info["frames"]);
    return info["frames"];
  }
};

TEST_F(SafetyTest, NothingIsReplacedWithoutForce) {
  balls("ball", 9, {{{4, 4, 4}, 3}});
  write("out.isr", "mine");
  fails("isoreel encode ball.json -o out.isr --iso 0", 1, "out.isr: is there already (--force replaces it)");
  EXPECT_EQ(content("out.isr"), "mine");
  EXPECT_FALSE(there("out.isr.part"));
  ok("isoreel encode ball.json -o out.isr --iso 0 --force && isoreel verify out.isr");
  write("new.isr.part", "a part");
  fails("isoreel encode ball.json -o new.isr --iso 0", 1, "new.isr.part: is there already");
  EXPECT_EQ(content("new.isr.part"), "a part");
  ok("isoreel encode ball.json -o new.isr --iso 0 --force");
  EXPECT_FALSE(there("new.isr.part"));
  // A failed encode leaves what was there, --force or not.
  const std::string before = content("out.isr");
  write("ball.raw", content("ball.raw").substr(1));
  EXPECT_EQ(sh("isoreel encode ball.json -o out.isr --iso 0 --force").code, 1);
  EXPECT_EQ(content("out.isr"), before);
}

TEST_F(SafetyTest, OutputsThatAreNoFiles) {
  balls("ball", 9, {{{4, 4, 4}, 3}});
  ok("isoreel encode ball.json -o ball.isr --iso 0 && mkfifo pipe.isr pipe.png pipe.ply && mkdir dir.isr");
  for (const char* name : {"pipe.isr", "dir.isr"})
    fails(fmt::format("isoreel encode ball.json -o {} --iso 0 --force", name), 1,
          std::string(name) + ": is there already, and is not a file");
  fails("isoreel render ball.isr -o pipe.png --force", 1, "not a file");
  fails("isoreel decode ball.isr -o pipe.ply --force", 1, "not a file");
  ok("test -p pipe.isr && test -p pipe.png && test -p pipe.ply && test -d dir.isr");
}

TEST_F(SafetyTest, FoldersThatAreMissing) {
  balls("ball", 9, {{{4, 4, 4}, 3}});
  fails("isoreel encode ball.json -o nowhere/out.isr --iso 0", 1,
        "nowhere/out.isr.part: cannot create: No such file");
  ok("isoreel encode ball.json -o ball.isr --iso 0");
  ok("isoreel decode ball.isr -o made/for/me/%d.ply && isoreel render ball.isr -o made/too/x.png --size "
     "16x16");
  write("file", "");
  fails("isoreel decode ball.isr -o file/%d.ply", 1, "file/0.ply");
  fails("isoreel render ball.isr -o file/x.png --size 16x16", 1, "file/x.png");
}

TEST_F(SafetyTest, FoldersThatMayNotBeWritten) {
  if (geteuid() == 0) GTEST_SKIP() << "root may write anywhere";
  balls("ball", 9, {{{4, 4, 4}, 3}});
  ok("isoreel encode ball.json -o ball.isr --iso 0");
  ok("mkdir closed && chmod a-w closed");
  fails("isoreel encode ball.json -o closed/out.isr --iso 0", 1, "closed/out.isr.part");
  fails("isoreel decode ball.isr -o closed/x.ply", 1, "closed/x.ply");
}

TEST_F(SafetyTest, InterruptedEncodeKeepsWhatIsDone) {
  longSequence(60'000);
  for (const int signal : {SIGINT, SIGTERM}) {
    std::filesystem::remove(path("out.isr.part"));
    const pid_t encode = start("isoreel encode long.json -o out.isr --iso 0");
    ASSERT_TRUE(growing("out.isr.part"));
    kill(encode, signal);
    EXPECT_EQ(wait(encode), 1);
    const std::string message = content(".err");
    EXPECT_TRUE(message.starts_with("isoreel encode: interrupted (what was done before, ")) << message;
    EXPECT_NE(message.find("is in out.isr.part"), std::string::npos) << message;
    EXPECT_FALSE(there("out.isr"));
    const std::uint64_t frames = framesOfPart("out.isr.part");
    EXPECT_NE(message.find(fmt::format(" {} frames,", frames)), std::string::npos) << message;
    EXPECT_EQ(json("isoreel info out.isr.part --json")["damage"].size(), 0u);
  }
  fails("isoreel info out.isr", 1, "out.isr.part is there");
}

TEST_F(SafetyTest, KilledEncodeKeepsWholeFrames) {
  longSequence(60'000);
  const pid_t encode = start("isoreel encode long.json -o out.isr --iso 0");
  ASSERT_TRUE(growing("out.isr.part"));
  const auto least = bytes("out.isr.part");  // all this was written before
  kill(encode, SIGKILL);
  EXPECT_EQ(wait(encode), 128 + SIGKILL);
  EXPECT_FALSE(there("out.isr"));
  const std::uint64_t frames = framesOfPart("out.isr.part");
  EXPECT_GT(frames, 10u);
  // Frames are alike, so their bytes tell how many there are; the first chunks take a few hundred.
  EXPECT_GE(frames, (least - 1000) / (bytes("out.isr.part") / frames));
  ok("isoreel render out.isr.part -o part.png --size 32x32 --frames 5 2>.warnings");
  EXPECT_EQ(sh("isoreel verify out.isr.part").code, 1);
}

TEST_F(SafetyTest, ASecondEncodeDoesNotDisturbTheFirst) {
  longSequence(60'000);
  const pid_t encode = start("isoreel encode long.json -o out.isr --iso 0");
  ASSERT_TRUE(growing("out.isr.part"));
  EXPECT_EQ(sh("isoreel encode one.json -o out.isr --iso 0 --force 2>second").code, 1);
  EXPECT_NE(content("second").find("another writer"), std::string::npos) << content("second");
  EXPECT_GE(json("isoreel info out.isr.part --json 2>second")["frames"], 10);  // it may be read meanwhile
  kill(encode, SIGINT);
  EXPECT_EQ(wait(encode), 1);
  framesOfPart("out.isr.part");
}

TEST_F(SafetyTest, AFullDiskIsTold) {
  const std::string alone = geteuid() == 0 ? "unshare -m" : "unshare -rm";
  std::filesystem::create_directory(path("small"));
  const std::string inside = alone + " sh -c 'mount -t tmpfs -o size=64k none small && cd small && ";
  if (sh(inside + "true'").code != 0) GTEST_SKIP() << "no small file system can be mounted here";
  longSequence(2000);
  const Outcome outcome = sh(
      inside +
      "{ isoreel encode ../long.json -o out.isr --iso 0; echo $?; ls; isoreel info out.isr.part --json; }'");
  EXPECT_TRUE(outcome.out.starts_with("1\nout.isr.part\n{")) << outcome.out;
  EXPECT_NE(outcome.err.find("out.isr.part: cannot write at byte"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("No space left on device"), std::string::npos) << outcome.err;
  const auto info = nlohmann::json::parse(outcome.out.substr(outcome.out.find('{')));
  EXPECT_GT(info["frames"], 20);
  EXPECT_NE(outcome.err.find(fmt::format("{} frames, is in", info["frames"].get<int>())), std::string::npos)
      << outcome.err;
  // Meshes: those that are whole stay, nothing of the others.
  ok("isoreel encode one.json one.json one.json one.json one.json one.json -o few.isr --iso 0");
  const Outcome meshes = sh(inside + "{ isoreel decode ../few.isr -o %d.ply --jobs 1; echo $?; ls -a; }'");
  EXPECT_TRUE(meshes.out.starts_with("1\n.\n..\n0.ply\n")) << meshes.out;
  EXPECT_EQ(meshes.out.find("part"), std::string::npos) << meshes.out;
  EXPECT_NE(meshes.err.find("No space left on device"), std::string::npos) << meshes.err;
}

TEST_F(SafetyTest, OutputThatCannotBePrintedIsAFailure) {
  sequence();
  ok("isoreel encode seq.json -o seq.isr --iso 0");
  for (const char* verb :
       {"info seq.isr --json", "info seq.isr", "verify seq.isr", "decode seq.isr --discard --json",
        "compare seq.isr seq.json --samples 1000 --frames 0",
        "encode seq.json -o x.isr --iso 0 --json --force", "--help"}) {
    const Outcome full = sh(fmt::format("isoreel {} > /dev/full", verb));
    EXPECT_EQ(full.code, 1) << verb;
    EXPECT_NE(full.err.find("No space left on device"), std::string::npos) << full.err;
    EXPECT_EQ(sh(fmt::format("isoreel {} >&-", verb)).code, 1) << verb;
  }
}

TEST_F(SafetyTest, ClosedStreamsDoNotEndInFiles) {
  sequence();
  ok("isoreel encode seq.json -o good.isr --iso 0");
  for (const char* closing : {">&-", "2>&-", ">&- 2>&-", "<&- >&- 2>&-"}) {
    const Outcome outcome = sh(fmt::format("isoreel encode seq.json -o out.isr --iso 0 --force {}", closing));
    EXPECT_LE(outcome.code, 1) << closing;
    EXPECT_EQ(content("out.isr"), content("good.isr")) << closing;
    EXPECT_EQ(sh(fmt::format("isoreel info nope.isr {}", closing)).code, 1) << closing;
  }
  EXPECT_EQ(sh("isoreel info nope.isr 2>/dev/full").code, 1);
}

#ifndef ISOREEL_ADDRESS_SANITIZED  // it wants all addresses there are
TEST_F(SafetyTest, WhatTakesTooMuchMemoryIsRefused) {
  EXPECT_LT(std::filesystem::file_size(ISOREEL_CRUMBS), 20'000u);  // and takes 250 MB to decode
  const Outcome outcome = sh("ulimit -v 700000; isoreel decode " ISOREEL_CRUMBS " --discard");
  EXPECT_EQ(outcome.code, 1);
  const std::string expected =
      "crumbs.isr: frame 1: packet: the distance field of the surface before it takes more memory than the "
      "limit of ";
  EXPECT_NE(outcome.err.find(expected), std::string::npos) << outcome.err;
}
#endif

TEST_F(SafetyTest, OtherContainersTakeNoMoreThanTheirSizeAllows) {
  // 1,895 bytes that claim 60 million samples: an index of 1.4 GB for libavformat, as much again for us.
  const std::string peak =
      "python3 -c 'import resource, subprocess; print(subprocess.run([\"isoreel\", \"info\", "
      "\"-\"]).returncode, "
      "resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)'";
  for (const std::string& line :
       {peak + " <" ISOREEL_MANY_SAMPLES, "cat " ISOREEL_MANY_SAMPLES " | " + peak}) {
    const Outcome outcome = sh(line);
    int code = 0;
    long kibibytes = 0;
    EXPECT_EQ(std::sscanf(outcome.out.c_str(), "%d %ld", &code, &kibibytes), 2) << outcome.err;
    EXPECT_EQ(code, 1) << outcome.err;
    EXPECT_LT(kibibytes, 700'000) << line;
  }
}

TEST_F(SafetyTest, AReaderThatGoesAwayIsNoDrama) {
  sequence();
  ok("isoreel encode seq.json -o seq.isr --iso 0");
  for (const char* line : {"isoreel info seq.isr --json --frames --packets | head -c 10",
                           "isoreel encode --help | true", "isoreel verify seq.isr | true"}) {
    const Outcome outcome = sh(line);
    EXPECT_EQ(outcome.err, "") << line;
  }
  // The other way round: enough frames were read, and the rest of the pipe is left alone.
  ok("{ cat seq.isr; sleep 0.05; cat seq.isr 2>/dev/null; } | isoreel decode - -o first.ply --frames 0");
}

}  // namespace
}  // namespace isoreel::cli
