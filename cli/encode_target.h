// SPDX-License-Identifier: BSD-3-Clause
// Where encode writes to: a new file, standard output, or the end of a file that is there.
#pragma once

#include <isoreel/codec/configuration.h>
#include <isoreel/container/writer.h>

#include <memory>
#include <string>
#include <vector>

#include "options.h"

namespace isoreel::cli {

struct TargetOptions {
  std::string output;
  bool append = false;
  bool force = false;
  std::string sync = "none";  // or gop
  unsigned parity = 0;        // percent
};

/// A track, and where it goes on: numbers of its packets start at `number`.
struct TargetTrack {
  std::string name;
  std::uint64_t id = 0;
  std::uint64_t number = 0;
};

class EncodeTarget {
 public:
  explicit EncodeTarget(TargetOptions options) : options_(std::move(options)) {}

  /// Before volumes are looked at: whether the output may be written, as far as can be told. The writer
  /// checks again.
  static Status mayStart(const TargetOptions& options);

  /// Opens a file to be continued and finds its tracks; `times` of the frames from `first` on are brought to
  /// its time base, and moved behind its last frame if they do not lie behind it already. Else nothing
  /// happens yet.
  Status open(std::vector<TargetTrack>& tracks, FrameTimes& times, std::size_t first);
  /// Creates a new file, or checks that the one that is there has this grid. `record` is `configuration` in
  /// bytes. `instead`: takes the bytes of a new file.
  Status begin(const Configuration& configuration, const Bytes& record,
               const std::vector<TargetTrack>& tracks, const std::string& tags, bool tags_given,
               std::unique_ptr<ByteSink> instead = nullptr);

  Writer& writer() { return *writer_; }
  Status finish() { return writer_->finish(); }
  /// What this encode added.
  std::uint64_t bytesAdded() const { return writer_->bytesWritten() - start_; }
  /// After an error: what is left of `frames` that were written, in words; nothing of them if there are none.
  std::string giveUp(std::uint64_t frames);

 private:
  WriterOptions writerOptions() const;

  TargetOptions options_;
  std::unique_ptr<Writer> writer_;
  std::uint64_t start_ = 0;  // bytes that were there
};

}  // namespace isoreel::cli
