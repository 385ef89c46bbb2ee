// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/base/parallel.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <memory>

namespace isoreel::gst {

/// So many threads for what the library does side by side; 0: one a core.
inline ParallelFor threads(int jobs) {
  const auto arena = std::make_shared<tbb::task_arena>(jobs > 0 ? jobs : int{tbb::task_arena::automatic});
  return [arena](std::size_t count, const std::function<void(std::size_t)>& body) {
    arena->execute([&] { tbb::parallel_for(std::size_t{0}, count, body); });
  };
}

}  // namespace isoreel::gst
