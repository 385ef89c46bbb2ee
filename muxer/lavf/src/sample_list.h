// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/codec/packet_header.h>

#include <compare>
#include <string>
#include <vector>

#include "facts.h"
#include "times.h"

namespace isoreel::lavf {

/// By what a packet is found again in its carrier.
struct Place {
  std::int64_t position = 0;  // byte, or what the demuxer has for it
  std::int64_t time = 0;      // units of the carrier
  std::int64_t bytes = 0;
  auto operator<=>(const Place&) const = default;
};

/// What a carrier tells of a packet.
struct Sample {
  Place place;
  Timing timing;        // `own` is filled in here
  bool hidden = false;  // in front of where an edit list starts
};

/// Frame headers of a sequence whose packets stand in a foreign file, in coded order (spec mappings 4).
class SampleList {
 public:
  /// The next packet of the track. Whether it is listed: not when it is damaged, or has no key before it.
  bool add(Sample sample, ByteSpan packet);
  /// After the last one: drops what is hidden in vain, and fills in times and facts.
  void finish(TimeBase unit, const FactList& facts);

  const std::vector<FrameHeader>& headers() const { return headers_; }
  const std::vector<Place>& places() const { return places_; }
  const std::vector<std::uint64_t>& shown() const { return shown_; }
  TimeBase timeBase() const { return base_; }
  const Bytes& configuration() const { return configuration_; }
  const std::vector<std::string>& damage() const { return damage_; }

 private:
  /// Something is missing here: those behind it keep the places that they would have.
  void refuse(const Sample& sample, const std::string& why);
  void dropHidden();

  std::vector<FrameHeader> headers_;
  std::vector<Place> places_;
  std::vector<Timing> timings_;
  std::vector<std::uint64_t> own_numbers_, shown_;
  TimeBase base_;
  Bytes configuration_;
  std::vector<std::string> damage_;
  std::uint64_t refused_ = 0;
  std::uint64_t packets_ = 0;   // of the track that came
  std::uint64_t position_ = 0;  // of the next one in the sequence; counts what is damaged, too
  std::uint64_t number_ = 0;
};

}  // namespace isoreel::lavf
