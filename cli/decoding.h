// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/codec/decoder.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

namespace isoreel::cli {

/// Addresses that the process had in use when it was first asked: libraries, stacks, what was opened. 0 when
/// that is not known.
inline std::uint64_t addressesAtFirst() {
  static const std::uint64_t bytes = [] {
    std::uint64_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    return pages * static_cast<std::uint64_t>(std::max(0L, sysconf(_SC_PAGESIZE)));
  }();
  return bytes;
}

/// What every verb decodes with: half of the machine's memory at most, or of what ulimit -v leaves the
/// process, so that no packet brings it down.
inline DecodeOptions decodeOptions() {
  DecodeOptions options;
  const long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE);
  if (pages > 0 && page > 0)
    options.max_bytes = static_cast<std::uint64_t>(pages) * static_cast<std::uint64_t>(page) / 2;
  rlimit space{};
  if (getrlimit(RLIMIT_AS, &space) == 0 && space.rlim_cur != RLIM_INFINITY)
    options.max_bytes = std::min<std::uint64_t>(
        options.max_bytes,
        (space.rlim_cur - std::min<std::uint64_t>(space.rlim_cur, addressesAtFirst())) / 2);
  return options;
}

}  // namespace isoreel::cli
