// SPDX-License-Identifier: BSD-3-Clause
#include "measure.h"

#include <malloc.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <fstream>
#include <string>

namespace isoreel::bench {
namespace {

double threadSeconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// A figure of /proc/self/status, in bytes.
double statusBytes(const std::string& key) {
  std::ifstream status("/proc/self/status");
  std::string word;
  while (status >> word) {
    if (word != key + ":") continue;
    double kibibytes = 0;
    status >> kibibytes;
    return 1024 * kibibytes;
  }
  return 0;
}

}  // namespace

Result<Cost> measure(int runs, const std::function<Status()>& call) {
  Cost cost;
  malloc_trim(0);  // so that memory which earlier calls gave back is not taken for free
  std::ofstream("/proc/self/clear_refs") << 5 << std::flush;  // the high-water mark starts from here
  const double before = statusBytes("VmRSS");
  ISOREEL_TRY(call());
  cost.peak_bytes = std::max(0.0, statusBytes("VmHWM") - before);

  std::vector<double> seconds;
  for (int i = 0; i < runs; ++i) {
    const double start = threadSeconds();
    ISOREEL_TRY(call());
    seconds.push_back(threadSeconds() - start);
  }
  cost.seconds = median(std::move(seconds));
  return cost;
}

Result<double> wallSeconds(const std::function<Status()>& call) {
  const auto start = std::chrono::steady_clock::now();
  ISOREEL_TRY(call());
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

}  // namespace isoreel::bench
