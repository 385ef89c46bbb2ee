// SPDX-License-Identifier: BSD-3-Clause
// A short sequence for elements to work on, as packets and as buffers of packets.
#pragma once

#include <gst/gst.h>
#include <isoreel/codec/decoder.h>

#include <vector>

namespace isoreel::gst {

inline constexpr std::uint64_t kFrames = 24;
inline constexpr std::uint64_t kGop = 6;
inline constexpr GstClockTime kFrameTime = GST_SECOND / 25;

/// A ball that moves and swells on 20 × 18 × 16 cells: I and P packets, made once.
const std::vector<Packet>& ballPackets();
/// Its configuration record.
const Bytes& ballRecord();
/// What packet i decodes to, in full.
Surface ballSurface(std::size_t i);

/// A buffer of a packet as any demuxer would make it.
GstBuffer* bufferFor(const Packet& packet);

}  // namespace isoreel::gst
