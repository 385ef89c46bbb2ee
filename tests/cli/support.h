// SPDX-License-Identifier: BSD-3-Clause
// A folder, volumes in it, and a shell in which `isoreel` is the command under test.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/types.h>

#include <array>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace isoreel::cli {

struct Outcome {
  int code = -1;  // as a shell has it: 128 and the signal's number for a process that was killed
  std::string out;
  std::string err;
};

struct Ball {
  std::array<double, 3> centre;
  double radius;
};

class CliTest : public testing::Test {
 protected:
  CliTest();
  ~CliTest() override;

  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  bool there(const std::string& name) const { return std::filesystem::exists(folder_ / name); }
  std::uintmax_t bytes(const std::string& name) const { return std::filesystem::file_size(folder_ / name); }
  std::string content(const std::string& name) const;
  void write(const std::string& name, const std::string& content) const;
  /// Names in a folder below the test's own, sorted.
  std::vector<std::string> list(const std::string& name) const;

  /// Runs a line of shell in the folder.
  Outcome sh(const std::string& line) const;
  /// The same for a line that must succeed and leave stderr empty; gives what it printed.
  std::string ok(const std::string& line) const;
  nlohmann::json json(const std::string& line) const;
  /// A line that must end with `code`, say nothing on stdout and one or two lines on stderr, holding `part`.
  void fails(const std::string& line, int code, const std::string& part) const;
  /// Starts `line`, whose process is the command itself, in the background.
  pid_t start(const std::string& line) const;
  int wait(pid_t process) const;

  /// NAME.raw of n³ samples and NAME.json that describes it.
  void volume(const std::string& name, std::size_t n,
              const std::function<double(double, double, double)>& sample) const;
  /// Distance to the nearest of balls, above 0 inside; -5 far away.
  void balls(const std::string& name, std::size_t n, const std::vector<Ball>& balls) const;
  /// NAME.json for raw files of n³ samples.
  void describe(const std::string& name, std::size_t n, const std::vector<std::string>& files) const;
  /// seq.json: eight frames of 25³ of two balls that come together and merge; one vanishes; the last frame is
  /// empty.
  void sequence() const;
  /// long.json: `frames` times the same ball of 17³, for what takes a while.
  void longSequence(std::size_t frames) const;

  std::filesystem::path folder_;
};

/// What a Wavefront file holds; faces from 0.
struct Mesh {
  std::vector<std::array<double, 3>> vertices, normals;
  std::vector<std::array<std::size_t, 3>> faces;
};
Mesh parseObj(const std::string& text);
/// Every edge is there in both directions, equally often.
bool closed(const Mesh& mesh);

}  // namespace isoreel::cli
