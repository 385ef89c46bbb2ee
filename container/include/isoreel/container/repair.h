// SPDX-License-Identifier: BSD-3-Clause
// Brings back what can be had of a damaged, cut or unfinished file, and says what cannot. Library
// isoreel::repair.
#pragma once

#include <isoreel/container/parity.h>

#include <filesystem>

namespace isoreel {

/// Shown frames `first` to `last`, numbered as in the damaged file.
struct FrameRun {
  std::uint64_t track = 0;
  std::uint64_t first = 0, last = 0;
};

struct RepairReport {
  bool exact = false;                 // the new file has the bytes that the old one had before it was damaged
  std::vector<std::string> damage;    // what is wrong with the old file, a line each
  std::uint64_t restored_blocks = 0;  // by parity
  std::vector<std::string> parity;    // of each run of bytes with damage: whether it was restored
  std::uint64_t frames = 0;           // in the new file, of all tracks
  std::vector<FrameRun> lost;         // damaged or gone
  std::vector<FrameRun> dependent;    // whole, but of no use without those
  std::vector<FrameRun> renumbered;   // kept under other numbers: `first` became `number`
  std::vector<std::uint64_t> numbers;     // of `renumbered`
  std::vector<std::string> attachments;   // names of those that are lost
  std::vector<std::uint64_t> open_ended;  // tracks whose length is not known: frames may be gone at the end

  /// Whether anything that is known to have been there is missing from the new file.
  bool lossy() const { return !lost.empty() || !dependent.empty() || !attachments.empty(); }
};

struct RepairOptions {
  bool overwrite = false;  // replace `to` if it is there
  bool compact = false;    // write a new file even when nothing is wrong, without what is not in use any more
  WriterOptions writer{};
};

/// Writes `to` from `from`: the same bytes where nothing is wrong or parity restores all; else a new file of
/// all GOPs as far as they are whole, packets bit for bit, tracks, tags, chapters and attachments. Frames are
/// numbered anew where some are lost, and keep their times. Parity is made anew if `options.writer` asks for
/// it. Fails, and leaves no file, when `from` is no `.isr` file or nothing of it is left, or when `to` cannot
/// be written.
Result<RepairReport> repairFile(const std::filesystem::path& from, const std::filesystem::path& to,
                                RepairOptions options = {});

}  // namespace isoreel
