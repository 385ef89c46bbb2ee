// SPDX-License-Identifier: BSD-3-Clause
// video/x-isoreel: caps and buffers of packets.
#pragma once

#include <isoreel/codec/configuration.h>

#include <optional>

#include "common.h"

namespace isoreel::gst {

/// `frame`: seconds a frame, where the rate is constant. An empty `record` gives no codec_data.
GstCaps* packetCaps(const Configuration& configuration, const Bytes& record, const TimeBase& base,
                    std::optional<TimeBase> frame);

/// A buffer of the packet, with times, flags and its header (frame_meta.h). `shift` ticks are added to its
/// time; what is before 0 then has no time. Offsets are the frame's number and the next.
GstBuffer* packetBuffer(Packet packet, const TimeBase& base, std::int64_t shift);

}  // namespace isoreel::gst
