// SPDX-License-Identifier: BSD-3-Clause
// application/x-volume as caps: what the buffers of a pad hold.
#pragma once

#include <isoreel/codec/volume.h>
#include <isoreel/io/scalar.h>

#include <bit>
#include <optional>

#include "common.h"

namespace isoreel::gst {

/// The format of volumes on a pad (the fields of kVolumeCaps).
struct VolumeFormat {
  Grid grid;
  io::ScalarType type = io::ScalarType::kFloat32;
  std::endian order = std::endian::little;
  bool level_set = false;
  std::optional<TimeBase> frame;      // seconds a frame, where the rate is constant
  std::optional<TimeBase> time_base;  // seconds a tick, where the times are multiples of one
};

GstCaps* volumeCaps(const VolumeFormat& format);

/// kInvalidArgument for caps that are not of volumes, or of a grid that cannot be.
Result<VolumeFormat> volumeFormat(const GstCaps* caps);

/// The volume in a buffer: floats of this machine's byte order stay where they are (the volume holds on to
/// the buffer), other samples are converted. kTruncated when there are fewer than the grid's nodes.
Result<Volume> volumeOf(GstBuffer* buffer, const VolumeFormat& format);

/// A buffer that holds on to the volume's samples.
GstBuffer* bufferOf(const Volume& volume);

}  // namespace isoreel::gst
