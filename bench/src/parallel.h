// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <tbb/parallel_for.h>

#include <cstddef>
#include <functional>

namespace isoreel::bench {

/// oneTBB's parallel_for, as the library takes it.
inline void parallelFor(std::size_t count, const std::function<void(std::size_t)>& body) {
  tbb::parallel_for(std::size_t{0}, count, body);
}

}  // namespace isoreel::bench
