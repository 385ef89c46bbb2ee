// SPDX-License-Identifier: BSD-3-Clause
// What encode does with volumes once it knows which: frames through an encoder, GOP by GOP.
#pragma once

#include <isoreel/codec/encoder.h>
#include <isoreel/io/volume_reader.h>

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "encode_target.h"
#include "frame_range.h"

namespace isoreel::cli {

/// How far frames may be from the volume's isosurface.
struct ErrorLimit {
  bool measure = false;         // each frame, and tell of it in its header
  std::optional<double> limit;  // of a frame's RMS distance, in cells of the volume: each GOP gets the
                                // largest step that keeps to it, and settings.configuration.step says nothing
};

struct EncodeJob {
  std::unique_ptr<io::VolumeSequence> volumes;
  std::vector<TargetTrack> tracks;
  std::vector<std::vector<double>> isovalues;  // of each track's frames
  FrameTimes times;
  FrameRange range;
  bool shard = false;  // packets then have the numbers that a whole encode gives them
  EncoderSettings settings;
  ErrorLimit error;
  int jobs = 0;

  /// Of all tracks.
  std::uint64_t frameCount() const { return range.size() * tracks.size(); }
};

struct CodedFrame {
  Packet packet;
  PacketSizes sizes;
};

/// Reads and encodes a job's frames; may be run again, with another step.
class EncodeRun {
 public:
  explicit EncodeRun(const EncodeJob& job) : job_(job) {}

  /// Calls write(frame, number of its track) for all frames in the order of the file, and end() behind each
  /// GOP. Stops at the first error, and when interrupted; what is written then is whole GOPs and the frames
  /// of one that were done before.
  Status run(std::uint32_t step, const std::function<Status(const CodedFrame&, std::size_t)>& write,
             const std::function<Status()>& end);

 private:
  struct Gop;
  struct Worst;

  Result<std::shared_ptr<const Volume>> volumeAt(std::size_t index);
  Status encode(Gop& gop, std::uint32_t step);
  Result<Worst> measureAll(Gop& gop);
  Status encodeWithin(Gop& gop, double limit);

  const EncodeJob& job_;
  std::mutex reading_;
  std::shared_ptr<const Volume> only_;  // the single volume of a sequence over isovalues
};

}  // namespace isoreel::cli
