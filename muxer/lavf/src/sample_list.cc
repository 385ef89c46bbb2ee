// SPDX-License-Identifier: BSD-3-Clause
#include "sample_list.h"

namespace isoreel::lavf {
namespace {

constexpr std::size_t kMostLines = 100;  // of damage: who made a file of it does not get to fill the memory

}  // namespace

void SampleList::refuse(const Sample& sample, const std::string& why) {
  ++refused_;
  if (damage_.size() < kMostLines) {
    const std::string place =
        sample.place.position >= 0 ? " at byte " + std::to_string(sample.place.position) : "";
    damage_.push_back("packet " + std::to_string(packets_ - 1) + place + ": " + why);
  }
  if (configuration_.empty()) return;  // the sequence starts at its first key
  ++position_;
  if (!sample.hidden) ++number_;
}

void SampleList::dropHidden() {
  while (!headers_.empty() && headers_.back().hidden()) {
    const std::uint64_t position = headers_.back().position;
    headers_.pop_back();
    places_.pop_back();
    timings_.pop_back();
    own_numbers_.pop_back();
    position_ = position;
  }
}

bool SampleList::add(Sample sample, ByteSpan packet) {
  ++packets_;
  const Result<PacketHeader> own = readPacketHeader(packet);
  if (!own.ok()) {
    refuse(sample, own.error().message);
    return false;
  }
  FrameHeader header;
  header.type = own->type;
  if (own->type == PacketType::kIntra) {
    dropHidden();  // nothing behind needs them
    if (configuration_.empty()) {
      const Result<Configuration> configuration = readConfiguration(own->configuration);
      if (!configuration.ok()) {
        refuse(sample, configuration.error().message);
        return false;
      }
      configuration_ = own->configuration;
      base_ = configuration->time_base;
    }
  } else if (headers_.empty()) {
    refuse(sample, "no I frame stands before it");
    return false;
  } else {
    const FrameHeader& before = headers_.back();
    if (before.position + 1 == position_ && own_numbers_.back() + own->references.at(0) != own->number)
      refuse(sample, "what it is predicted from does not stand before it");
    header.back = before.back + (position_ - before.position);
  }
  header.position = position_++;
  header.number = number_;
  if (sample.hidden) {
    header.flags = FrameHeader::kHidden;
  } else {
    ++number_;
  }
  header.isovalue = own->isovalue;
  header.vertices = own->vertices;
  header.faces = own->faces;
  header.surface_hash = own->surface_hash;
  sample.timing.own = own->time;
  sample.timing.own_duration = own->duration;
  headers_.push_back(header);
  places_.push_back(sample.place);
  timings_.push_back(sample.timing);
  own_numbers_.push_back(own->number);
  return true;
}

void SampleList::finish(TimeBase unit, const FactList& facts) {
  dropHidden();
  if (refused_ > damage_.size())
    damage_.push_back("and " + std::to_string(refused_ - damage_.size()) + " packets more");
  TrackTimes times = reconcileTimes(timings_, base_, unit);
  base_ = times.base;
  for (std::size_t i = 0; i < headers_.size(); ++i) {
    headers_[i].time = times.times[i];
    headers_[i].duration = times.durations[i];
    facts.fill(own_numbers_[i], headers_[i]);
    if (!headers_[i].hidden()) shown_.push_back(i);
  }
}

}  // namespace isoreel::lavf
