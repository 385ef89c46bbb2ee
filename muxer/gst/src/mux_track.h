// SPDX-License-Identifier: BSD-3-Clause
// What isoreelmux knows of one of its sink pads.
#pragma once

#include <isoreel/codec/packet_header.h>
#include <isoreel/container/writer.h>

#include <optional>
#include <string>
#include <vector>

#include "common.h"

namespace isoreel::gst {

/// Which clock the times in the file come from.
enum class MuxTimes {
  kStream,   // stream time: what a file says stays what it is
  kRunning,  // running time: sequences that come one after the other continue each other
};

/// What a track that comes behind `others` is called: its part of `names` (NAME,NAME,...), or else `title`;
/// changed where another has that name.
std::string trackName(const std::vector<TrackInfo>& others, const std::string& names,
                      const std::string& title);

/// Turns the buffers of a pad into the packets of a track, numbered and timed anew.
class MuxTrack {
 public:
  std::optional<TimeBase> caps_base;  // what caps say of the unit of times
  Bytes caps_record;                  // codec_data
  std::string name;
  std::optional<std::uint64_t> id;  // in the file

  void takeCaps(const GstCaps* caps);
  bool known() const { return configuration_.has_value(); }
  /// Once it is known.
  TrackSettings settings() const { return {base_, name, *configuration_}; }
  /// Learns it from the pad's first packet, if that is an I packet. Errors: what is no packet.
  Status know(GstBuffer* first);
  /// For a pad that ends without a packet: what its caps say, if they do.
  void knowByCaps();

  /// Once it is known: a pad whose first packets are P packets gives them to this, too. The packets that this
  /// buffer adds to the track. Those that cannot be decoded there (a P packet at the start, or behind a gap)
  /// are left out, with one warning for each gap in `warning`; a hidden packet waits for the shown one that
  /// needs it. Errors: what is no packet, or has no time.
  Result<std::vector<Packet>> take(GstBuffer* buffer, const GstSegment& segment, MuxTimes times,
                                   Status& warning);

 private:
  struct Moment;
  Result<Moment> moment(GstBuffer* buffer, const GstSegment& segment, MuxTimes times,
                        const PacketHeader& own) const;

  std::optional<Bytes> configuration_;
  TimeBase base_;
  std::uint64_t number_ = 0;               // of the next shown frame
  std::uint64_t back_ = 0;                 // packets since the key, of the next one
  std::optional<std::uint64_t> last_own_;  // the number that the last packet was coded with
  bool gap_told_ = false;
  std::vector<Packet> hidden_;  // not written yet
};

}  // namespace isoreel::gst
