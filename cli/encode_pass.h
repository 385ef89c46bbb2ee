// SPDX-License-Identifier: BSD-3-Clause
// A job on its way to a file, and what a file of a wanted length or distance is to be made with.
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>

#include "encode_job.h"
#include "encode_target.h"

namespace isoreel::cli {

/// What was written.
struct EncodeTotals {
  std::uint64_t frames = 0, predicted = 0, vertices = 0;
  PacketSizes sizes;
  ErrorKind error_kind = ErrorKind::kNone;  // of what was measured
  double error_squares = 0, error_max = 0;  // squares: a vertex
  nlohmann::ordered_json list;              // of frames

  void add(const CodedFrame& frame, const std::string& track);
  double errorRms() const {
    return vertices == 0 ? 0.0 : std::sqrt(error_squares / static_cast<double>(vertices));
  }
};

/// What both the passes that look for a length and the last one do.
struct EncodePass {
  const TargetOptions& target;
  const EncodeJob& job;
  std::string tags;
  bool tags_given = false;

  /// `to` is open. `instead`: takes the bytes of a new file.
  Status run(EncodeTarget& to, std::uint32_t step, const std::string& name, EncodeTotals& totals,
             std::unique_ptr<ByteSink> instead = nullptr) const;
};

/// The step with which the file has `size` bytes, nearly, and not more.
Result<std::uint32_t> stepForSize(const EncodePass& pass, std::uint64_t size);

/// The side of coded cells with which the first GOP takes the fewest bytes at the job's limit of the error.
/// `job`: the pass's; its settings get others on the way.
Result<double> cellForError(const EncodePass& pass, EncodeJob& job);

}  // namespace isoreel::cli
