// SPDX-License-Identifier: BSD-3-Clause
// usage: fuzz_regression FUZZER FOLDER... : runs one fuzzer's code over every file in the folders, without
// libFuzzer. What goes wrong aborts; the file at work stands on stderr before it.
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#define ISOREEL_FUZZER(name) extern "C" int fuzz_##name(const std::uint8_t* data, std::size_t size);
ISOREEL_FUZZERS
#undef ISOREEL_FUZZER

namespace {

struct Fuzzer {
  const char* name;
  int (*run)(const std::uint8_t*, std::size_t);
};
#define ISOREEL_FUZZER(name) {#name, fuzz_##name},
constexpr Fuzzer kFuzzers[] = {ISOREEL_FUZZERS};
#undef ISOREEL_FUZZER

int runAll(const Fuzzer& fuzzer, const char* folder) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    std::ifstream in(entry.path(), std::ios::binary);
    const std::vector<char> bytes{std::istreambuf_iterator<char>(in), {}};
    std::fprintf(stderr, "%s\n", entry.path().c_str());
    fuzzer.run(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
    ++count;
  }
  return count;
}

}  // namespace

int main(int argc, char** argv) {
  for (const Fuzzer& fuzzer : kFuzzers) {
    if (argc < 3 || std::strcmp(argv[1], fuzzer.name) != 0) continue;
    int count = 0;
    for (int i = 2; i < argc; ++i) count += runAll(fuzzer, argv[i]);
    std::printf("%s: %d inputs\n", fuzzer.name, count);
    return count > 0 ? 0 : 1;
  }
  return std::fprintf(stderr, "usage: fuzz_regression FUZZER FOLDER...\n"), 2;
}
