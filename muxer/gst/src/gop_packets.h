// SPDX-License-Identifier: BSD-3-Clause
// Packets as buffers bring them, and a group of them as the library's player takes it.
#pragma once

#include <isoreel/base/packet.h>
#include <isoreel/codec/configuration.h>

#include <vector>

#include "common.h"

namespace isoreel::gst {

/// A packet, and whether and when it is shown.
struct TimedPacket {
  Packet packet;
  GstClockTime time = GST_CLOCK_TIME_NONE;
  GstClockTime duration = GST_CLOCK_TIME_NONE;
  bool shown = true;
};

/// What a buffer holds. The facts are those of its frame header where it has one (frame_meta.h), else those
/// of the packet's own head; where that is damaged, the number is 0 and the buffer's flags tell the type.
/// `configuration` is that of the last key, and becomes this one's if it is a key.
TimedPacket packetOf(GstBuffer* buffer, Configuration& configuration);

/// "frame 17", as the command line names a packet.
std::string placeOf(const FrameHeader& header);

/// Packets in the order of decoding, from a key on.
class GopPackets final : public PacketSource {
 public:
  void add(TimedPacket timed);
  void clear();
  bool empty() const { return entries_.empty(); }
  const TimedPacket& timed(std::uint64_t frame) const { return entries_[frames_[frame]]; }
  const TimedPacket& last() const { return entries_.back(); }

  std::uint64_t frameCount() const override { return frames_.size(); }
  const FrameHeader& header(std::uint64_t frame) const override { return entryHeader(frames_[frame]); }
  Result<Bytes> packet(std::uint64_t frame) override { return entryPacket(frames_[frame]); }
  std::uint64_t entryCount() const override { return entries_.size(); }
  std::uint64_t entryOf(std::uint64_t frame) const override { return frames_[frame]; }
  const FrameHeader& entryHeader(std::uint64_t entry) const override { return entries_[entry].packet.header; }
  Result<Bytes> entryPacket(std::uint64_t entry) override { return entries_[entry].packet.data; }

 private:
  std::vector<TimedPacket> entries_;
  std::vector<std::size_t> frames_;  // the entries that are shown
};

}  // namespace isoreel::gst
