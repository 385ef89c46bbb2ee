// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/codec/decoder.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>

namespace isoreel::cli {

/// What every verb decodes with: half of the machine's memory at most, or of what the process may have
/// (ulimit -v), so that no packet brings it down.
inline DecodeOptions decodeOptions() {
  DecodeOptions options;
  const long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE);
  if (pages > 0 && page > 0)
    options.max_bytes = static_cast<std::uint64_t>(pages) * static_cast<std::uint64_t>(page) / 2;
  rlimit space{};
  if (getrlimit(RLIMIT_AS, &space) == 0 && space.rlim_cur != RLIM_INFINITY)
    options.max_bytes = std::min<std::uint64_t>(options.max_bytes, space.rlim_cur / 2);
  return options;
}

}  // namespace isoreel::cli
