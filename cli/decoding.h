// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/codec/decoder.h>
#include <unistd.h>

namespace isoreel::cli {

/// What every verb decodes with: half of the machine's memory at most, so that no packet brings it down.
inline DecodeOptions decodeOptions() {
  DecodeOptions options;
  const long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE);
  if (pages > 0 && page > 0)
    options.max_bytes = static_cast<std::uint64_t>(pages) * static_cast<std::uint64_t>(page) / 2;
  return options;
}

}  // namespace isoreel::cli
