// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/base/packet.h>
#include <isoreel/inspect/render.h>

#include <memory>

namespace isoreel::inspect {

/// Writes an MP4: H.264 where the machine has an encoder for it, else MPEG-4 part 2; 8-bit 4:2:0, BT.709, the
/// index in front. The file grows under a temporary name (".part" added) and gets its own in finish(); a
/// writer that goes away before leaves nothing. The same bytes for the same pictures on one machine. Not
/// thread-safe.
class MovieWriter {
 public:
  /// All pictures have the first one's size; an odd width or height is made even by repeating the last column
  /// or row. Times are in `base`; they are kept exactly if its denominator is below 65536, else to 1/60000 s.
  /// Errors: kUnsupported (built without libav, no encoder, a size it refuses), kIo.
  static Result<MovieWriter> create(const std::filesystem::path& path, int width, int height, TimeBase base);
  MovieWriter(MovieWriter&&) noexcept;
  MovieWriter& operator=(MovieWriter&&) noexcept;
  ~MovieWriter();

  /// Adds a picture that is shown from `time` for `duration` ticks. Times rise; kInvalidArgument when they
  /// don't, or not by as much as the movie can tell, or when the picture has another size.
  Status add(const Image& image, std::int64_t time, std::uint64_t duration);
  /// Completes the file and renames it over `path`. Nothing may be added afterwards.
  Status finish();

 private:
  struct State;
  explicit MovieWriter(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace isoreel::inspect
