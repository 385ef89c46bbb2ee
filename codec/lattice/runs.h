// SPDX-License-Identifier: BSD-3-Clause
// Work over a list, cut into runs for as many threads as there may be.
#pragma once

#include <isoreel/base/parallel.h>

#include <algorithm>

namespace isoreel {

/// Into how many runs of about `least` elements or more a list of `count` is cut: one at least, and no more
/// than there is something to gain from.
constexpr std::size_t runCount(std::size_t count, std::size_t least) {
  return std::clamp<std::size_t>(count / least, 1, 64);
}
/// Where the n-th of them begins; the last ends where one more would begin.
constexpr std::size_t runStart(std::size_t n, std::size_t runs, std::size_t count) {
  return n * count / runs;
}

/// body(first, end) for runs of about `least` elements or more, on any threads.
template <class Body>
void forRuns(const ParallelFor& parallel, std::size_t count, std::size_t least, const Body& body) {
  const std::size_t runs = runCount(count, least);
  parallel(runs, [&](std::size_t n) { body(runStart(n, runs, count), runStart(n + 1, runs, count)); });
}

}  // namespace isoreel
