// SPDX-License-Identifier: BSD-3-Clause
#include "support.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>

namespace isoreel::cli {
namespace {

std::string readAll(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

int shellCode(int status) { return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status); }

// In the child. `out` and `err` are files, so that nothing blocks however much is printed.
[[noreturn]] void runShell(const std::filesystem::path& folder, const std::string& line,
                           const std::filesystem::path& out, const std::filesystem::path& err) {
  const int in = open("/dev/null", O_RDONLY);
  const int out_file = open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
  const int err_file = open(err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
  if (in < 0 || out_file < 0 || err_file < 0 || chdir(folder.c_str()) != 0) _exit(126);
  dup2(in, 0);
  dup2(out_file, 1);
  dup2(err_file, 2);
  for (const int file : {in, out_file, err_file}) close(file);
  execl("/bin/sh", "sh", "-c", line.c_str(), nullptr);
  _exit(127);
}

}  // namespace

CliTest::CliTest() {
  std::string name = (std::filesystem::temp_directory_path() / "isoreel-cli-XXXXXX").string();
  folder_ = mkdtemp(name.data()) != nullptr ? name : "";
  const std::string programs = std::filesystem::path(ISOREEL_COMMAND).parent_path().string();
  const char* const before = std::getenv("PATH");
  setenv("PATH", (programs + ":" + (before != nullptr ? before : "/usr/bin:/bin")).c_str(), 1);
}

CliTest::~CliTest() {
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

std::string CliTest::content(const std::string& name) const { return readAll(folder_ / name); }

void CliTest::write(const std::string& name, const std::string& content) const {
  std::ofstream(folder_ / name, std::ios::binary) << content;
}

std::vector<std::string> CliTest::list(const std::string& name) const {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder_ / name))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

pid_t CliTest::start(const std::string& line) const {
  const pid_t child = fork();
  if (child == 0) runShell(folder_, "exec " + line, folder_ / ".out", folder_ / ".err");
  return child;
}

int CliTest::wait(pid_t process) const {
  int status = 0;
  if (waitpid(process, &status, 0) != process) return -1;
  return shellCode(status);
}

Outcome CliTest::sh(const std::string& line) const {
  const pid_t child = fork();
  if (child == 0) runShell(folder_, line, folder_ / ".out", folder_ / ".err");
  Outcome outcome;
  outcome.code = wait(child);
  outcome.out = readAll(folder_ / ".out");
  outcome.err = readAll(folder_ / ".err");
  return outcome;
}

std::string CliTest::ok(const std::string& line) const {
  const Outcome outcome = sh(line);
  EXPECT_EQ(outcome.code, 0) << line << "\n" << outcome.err;
  EXPECT_EQ(outcome.err, "") << line;
  return outcome.out;
}

nlohmann::json CliTest::json(const std::string& line) const {
  const std::string text = ok(line);
  nlohmann::json value = nlohmann::json::parse(text, nullptr, false);
  EXPECT_TRUE(value.is_object()) << line << "\n" << text;
  return value;
}

void CliTest::fails(const std::string& line, int code, const std::string& part) const {
  const Outcome outcome = sh(line);
  EXPECT_EQ(outcome.code, code) << line << "\n" << outcome.err;
  EXPECT_EQ(outcome.out, "") << line;
  EXPECT_NE(outcome.err.find(part), std::string::npos) << line << "\n" << outcome.err;
  // The message, and for wrong usage where to read on.
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), code == 2 ? 2 : 1) << line << "\n"
                                                                                         << outcome.err;
  EXPECT_TRUE(outcome.err.starts_with("isoreel")) << outcome.err;
}

void CliTest::describe(const std::string& name, std::size_t n, const std::vector<std::string>& files) const {
  write(name + ".json", nlohmann::json{{"dims", {n, n, n}}, {"dtype", "float32"}, {"files", files}}.dump());
}

void CliTest::volume(const std::string& name, std::size_t n,
                     const std::function<double(double, double, double)>& sample) const {
  std::vector<float> samples;
  samples.reserve(n * n * n);
  for (std::size_t z = 0; z < n; ++z) {
    for (std::size_t y = 0; y < n; ++y) {
      for (std::size_t x = 0; x < n; ++x) {
        samples.push_back(static_cast<float>(
            sample(static_cast<double>(x), static_cast<double>(y), static_cast<double>(z))));
      }
    }
  }
  write(name + ".raw",
        std::string(reinterpret_cast<const char*>(samples.data()), samples.size() * sizeof(float)));
  describe(name, n, {name + ".raw"});
}

void CliTest::balls(const std::string& name, std::size_t n, const std::vector<Ball>& balls) const {
  volume(name, n, [&](double x, double y, double z) {
    double value = -5;
    for (const Ball& b : balls) {
      const double distance = std::hypot(x - b.centre[0], y - b.centre[1], z - b.centre[2]);
      value = std::max(value, b.radius - distance);
    }
    return value;
  });
}

void CliTest::sequence() const {
  std::vector<std::string> files;
  for (int frame = 0; frame < 8; ++frame) {
    const double moved = 0.7 * frame;
    std::vector<Ball> now;
    if (frame < 7) now.push_back({{7.3 + moved, 12.1, 11.8}, 4.2});
    if (frame < 5) now.push_back({{18.2 - moved, 12.4, 12.2}, 3.4});
    const std::string name = fmt::format("step_{:02}", frame);
    balls(name, 25, now);
    files.push_back(name + ".raw");
  }
  describe("seq", 25, files);
}

void CliTest::longSequence(std::size_t frames) const {
  balls("one", 17, {{{8.2, 7.9, 8.1}, 5.3}});
  describe("long", 17, std::vector<std::string>(frames, "one.raw"));
}

Mesh parseObj(const std::string& text) {
  Mesh mesh;
  std::istringstream lines(text);
  std::string line;
  while (std::getline(lines, line)) {
    std::istringstream words(line);
    std::string what;
    words >> what;
    if (what == "v" || what == "vn") {
      std::array<double, 3> p{};
      words >> p[0] >> p[1] >> p[2];
      (what == "v" ? mesh.vertices : mesh.normals).push_back(p);
    } else if (what == "f") {
      std::array<std::size_t, 3> face{};
      for (std::size_t& corner : face) {
        std::string word;
        words >> word;
        corner = std::strtoul(word.c_str(), nullptr, 10) - 1;
      }
      std::string more;
      EXPECT_FALSE(words >> more) << "not a triangle: " << line;
      mesh.faces.push_back(face);
    }
  }
  return mesh;
}

bool closed(const Mesh& mesh) {
  std::map<std::pair<std::size_t, std::size_t>, int> balance;
  for (const auto& face : mesh.faces) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t a = face[i], b = face[(i + 1) % 3];
      if (a >= mesh.vertices.size() || b >= mesh.vertices.size()) return false;
      balance[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
    }
  }
  return std::all_of(balance.begin(), balance.end(), [](const auto& edge) { return edge.second == 0; });
}

}  // namespace isoreel::cli
