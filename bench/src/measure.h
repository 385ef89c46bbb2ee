// SPDX-License-Identifier: BSD-3-Clause
// Time and memory of a call, measured inside the process.
#pragma once

#include <isoreel/base/status.h>

#include <functional>
#include <vector>

namespace isoreel::bench {

struct Cost {
  double seconds = 0;  // processor time of the calling thread, median of the runs
  double peak_bytes =
      0;  // memory at its highest, above what was held before; nought when the system won't say
};

/// Runs `call` once to watch its memory (and to warm up), then `runs` times against the clock. Processor time
/// is what a quiet machine's clock on the wall would show, since the calls keep to their thread; it stays
/// good when the machine is busy. Stops at the first error.
Result<Cost> measure(int runs, const std::function<Status()>& call);

/// Wall-clock seconds of one call.
Result<double> wallSeconds(const std::function<Status()>& call);

/// The middle value, or the mean of the two in the middle; `values` must not be empty.
double median(std::vector<double> values);

}  // namespace isoreel::bench
