// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>

namespace isoreel {

/// Calls `body(i)` once for each i in [0, count), in any order and on any threads, and returns when all are
/// done. What a body throws, one of those calls' exceptions, it throws on. Bodies may call it again. The
/// library owns no threads: callers hand one of these in (the command line passes oneTBB's). What the library
/// makes never depends on the order.
using ParallelFor = std::function<void(std::size_t count, const std::function<void(std::size_t)>& body)>;

/// One after the other on the calling thread: the default.
inline void serialFor(std::size_t count, const std::function<void(std::size_t)>& body) {
  for (std::size_t i = 0; i < count; ++i) body(i);
}

}  // namespace isoreel
