// SPDX-License-Identifier: BSD-3-Clause
// oneTBB as the library's parallel-for, and the pipeline that frames go through.
#pragma once

#include <isoreel/base/status.h>
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include <functional>
#include <memory>

#include "interrupt.h"

namespace isoreel::cli {

/// How many threads `--jobs` stands for: 0 means all that the machine has.
inline std::size_t threadCount(int jobs) {
  return static_cast<std::size_t>(jobs > 0 ? jobs : tbb::info::default_concurrency());
}

/// Keeps everything to `jobs` threads while it lives.
class ThreadLimit {
 public:
  explicit ThreadLimit(int jobs)
      : control_(tbb::global_control::max_allowed_parallelism, threadCount(jobs)) {}

 private:
  tbb::global_control control_;
};

/// oneTBB's parallel_for, as the library takes it.
inline void parallelFor(std::size_t count, const std::function<void(std::size_t)>& body) {
  tbb::parallel_for(std::size_t{0}, count, body);
}

/// The same for what is done within a frame while others are under way: a thread that waits takes up none of
/// those.
inline void parallelWithin(std::size_t count, const std::function<void(std::size_t)>& body) {
  tbb::this_task_arena::isolate([&] { parallelFor(count, body); });
}

/// Runs each frame through read (in order, one at a time), work (any thread, any order) and write (in order,
/// one at a time), with at most `jobs` frames under way. `read` returns false when there are no more. Stops
/// at the first error, which it returns, and when interrupted; frames before are written.
template <class Item>
Status forEachFrame(int jobs, const std::function<Result<bool>(Item&)>& read,
                    const std::function<Status(Item&)>& work, const std::function<Status(Item&)>& write) {
  struct Frame {
    Item item;
    Status status;
  };
  using Pointer = std::shared_ptr<Frame>;
  Status first_error;  // touched by the last stage only, while the pipeline runs
  std::atomic<bool> stop{false};
  const auto source = [&](tbb::flow_control& control) {
    auto frame = std::make_shared<Frame>();
    if (stop || interrupted) {
      control.stop();
      return frame;
    }
    const Result<bool> more = read(frame->item);
    if (!more.ok()) {
      frame->status = more.status();
      stop = true;
    } else if (!*more) {
      control.stop();
    }
    return frame;
  };
  const auto middle = [&](Pointer frame) {
    if (frame->status.ok()) frame->status = work(frame->item);
    if (!frame->status.ok()) stop = true;
    return frame;
  };
  const auto sink = [&](const Pointer& frame) {
    if (!first_error.ok()) return;
    first_error = frame->status.ok() ? write(frame->item) : frame->status;
    if (!first_error.ok()) stop = true;
  };
  tbb::parallel_pipeline(threadCount(jobs),
                         tbb::make_filter<void, Pointer>(tbb::filter_mode::serial_in_order, source) &
                             tbb::make_filter<Pointer, Pointer>(tbb::filter_mode::parallel, middle) &
                             tbb::make_filter<Pointer, void>(tbb::filter_mode::serial_in_order, sink));
  return first_error;
}

}  // namespace isoreel::cli
