// SPDX-License-Identifier: BSD-3-Clause
// Volumes whose samples lie one after the other in files, raw or deflated: what most formats come to once
// their header is read.
#pragma once

#include <isoreel/io/scalar.h>

#include "src/byte_stream.h"
#include "src/sequence.h"

namespace isoreel::io {

/// What a header says of its volumes.
struct StoredVolumes {
  /// A file that holds a share of the samples, which starts `offset` bytes into it.
  struct Part {
    std::string path;
    std::uint64_t offset = 0;
  };

  std::string header;       // the file that says all this
  Grid grid;                // of each volume
  std::size_t volumes = 1;  // 1 at least
  ScalarType type = ScalarType::kFloat32;
  std::endian order = std::endian::little;
  Rescale rescale;
  std::vector<Part> parts;  // 1 at least, of equal shares, in order
  Coding coding = Coding::kPlain;
  std::uint64_t skip = 0;  // bytes before the samples of a part, after inflating
  bool levelSet = false;
  std::optional<double> firstTime;  // of volume 0, in seconds; nothing when the header gives no times
  double timeStep = 0;              // seconds from a volume to the next

  // As VolumeSequence has them.
  std::optional<double> time(std::size_t i) const;
  std::string name(std::size_t i) const;
};

/// A sequence of `stored`, whose samples are read when they are asked for. The size of every part is checked
/// now and before each read: plain ones must have the bytes that the header says, deflated ones must be able
/// to hold them. Errors: kLimit (sizes whose product is out of range), kTruncated, kBadData, kNotFound, kIo.
SequenceResult openStored(StoredVolumes stored);

}  // namespace isoreel::io
