// SPDX-License-Identifier: BSD-3-Clause
#include "progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include "output.h"

namespace isoreel::cli {

Progress::Progress(std::string what, std::optional<std::uint64_t> total)
    : what_(std::move(what)), total_(total), shown_(isatty(STDERR_FILENO) != 0) {}

Progress::~Progress() { clear(); }

void Progress::clear() {
  if (on_screen_) complain("\r\x1b[K");
  on_screen_ = false;
}

void Progress::advance() {
  ++done_;
  if (!shown_) return;
  const auto now = Clock::now();
  if (now - drawn_ < std::chrono::milliseconds(100)) return;
  drawn_ = now;
  draw();
}

void Progress::draw() {
  const double seconds = std::chrono::duration<double>(drawn_ - start_).count();
  const double rate = static_cast<double>(done_) / seconds;
  std::string line = fmt::format("\r\x1b[K{}  {}", what_, done_);
  if (total_) line += fmt::format("/{}", *total_);
  line += fmt::format(" frames  {:.1f} a second", rate);
  if (total_ && *total_ >= done_)
    line += fmt::format("  {:.0f} s left", static_cast<double>(*total_ - done_) / rate);
  complain("{}", line);
  on_screen_ = true;
}

}  // namespace isoreel::cli
