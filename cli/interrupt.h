// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <csignal>

namespace isoreel::cli {

/// Set by the first SIGINT, SIGTERM or SIGHUP: long work stops after the frame it is at. A second signal
/// kills.
inline std::atomic<bool> interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free, "set in a signal handler");

inline void stopOnSignals() {
  const auto handler = [](int number) {
    interrupted = true;
    std::signal(number, SIG_DFL);
  };
  std::signal(SIGINT, handler);
  std::signal(SIGTERM, handler);
  std::signal(SIGHUP, handler);
}

}  // namespace isoreel::cli
