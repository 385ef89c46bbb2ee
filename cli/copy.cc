// SPDX-License-Identifier: BSD-3-Clause
#include "copy.h"

#include <fmt/format.h>
#include <isoreel/codec/packet_header.h>
#include <isoreel/container/parity.h>

#include <algorithm>
#include <limits>
#include <numeric>

#include "interrupt.h"
#include "output.h"
#include "progress.h"

namespace isoreel::cli {

Result<SourceFile> openSource(const std::string& path, const std::string& track) {
  SourceFile source{path, {}};
  const auto open = [&](const std::string& which) -> Status {
    ISOREEL_ASSIGN(Input input, openInput(path, which));
    source.tracks.push_back(std::move(input));
    return {};
  };
  ISOREEL_TRY(open(track));
  warnOfDamage(source.info(), path);
  if (!track.empty()) return source;
  const std::vector<TrackInfo> tracks = source.info().tracks;
  if (tracks.size() > 1 && source.info().bytes == 0) {
    return {ErrorCode::kInvalidArgument, fmt::format("{}: has {}, and from a pipe one can be had (--track)",
                                                     path, counted(tracks.size(), "track"))};
  }
  for (std::size_t i = 1; i < tracks.size(); ++i) ISOREEL_TRY(open(fmt::format("{}", tracks[i].id)));
  return source;
}

Cut wholeTrack(const PacketSource& packets) { return {0, 0, packets.entryCount()}; }

Result<Cut> cutOf(const PacketSource& packets, std::uint64_t begin, std::uint64_t end) {
  if (begin >= end) return Cut{};
  ISOREEL_ASSIGN(const std::uint64_t key, keyEntry(packets, begin));
  return Cut{key, packets.entryOf(begin), packets.entryOf(end - 1) + 1};
}

Result<Bytes> configurationOf(const Input& input, const Cut& cut) {
  if (cut.begin == cut.end || cut.begin == 0) return input.info.configuration;
  ISOREEL_ASSIGN(const Bytes packet, input.packets->entryPacket(cut.begin));
  ISOREEL_ASSIGN(PacketHeader header, readPacketHeader(packet));
  return std::move(header.configuration);
}

WriterOptions writerOptions(unsigned parity) {
  WriterOptions options;
  if (parity > 0) options.parity = reedSolomonParity(parity);
  return options;
}

Result<std::vector<lavf::CarrierAttachment>> openAttachments(const Input& input,
                                                             std::vector<std::string>& notes) {
  std::vector<lavf::CarrierAttachment> list;
  for (const Attachment& facts : input.info.attachments) {
    if (!input.openAttachment) {
      notes.push_back(fmt::format("attachment '{}' stays behind: the input is a pipe", facts.name));
      continue;
    }
    ISOREEL_ASSIGN(auto content, input.openAttachment(facts.name));
    list.push_back({facts, std::move(content)});
  }
  return list;
}

Status copyAttachments(const SourceFile& source, Writer& writer) {
  std::vector<std::string> notes;
  ISOREEL_ASSIGN(const auto attachments, openAttachments(source.tracks.front(), notes));
  for (const std::string& note : notes) complain("isoreel: warning: {}: {}\n", source.path, note);
  for (const lavf::CarrierAttachment& attachment : attachments) {
    const Attachment& facts = attachment.facts;
    const std::vector<Attachment>& there = writer.info().attachments;
    const bool taken =
        std::any_of(there.begin(), there.end(), [&](const Attachment& a) { return a.name == facts.name; });
    if (!taken) ISOREEL_TRY(writer.attach(facts.name, facts.media_type, *attachment.content));
  }
  return {};
}

Status TimeMap::apply(FrameHeader& header) const {
  if (__builtin_mul_overflow(header.time, factor, &header.time) ||
      __builtin_add_overflow(header.time, shift, &header.time) ||
      __builtin_mul_overflow(header.duration, static_cast<std::uint64_t>(factor), &header.duration)) {
    return {ErrorCode::kLimit, "its time in the new file is beyond 63 bits"};
  }
  return {};
}

std::optional<TimeBase> commonBase(TimeBase a, TimeBase b) {
  if (a == b) return a;
  const std::uint64_t parts = std::lcm(std::uint64_t{a.denominator}, std::uint64_t{b.denominator});
  const auto in = [&](TimeBase base) -> std::optional<std::uint64_t> {
    std::uint64_t result = 0;
    if (__builtin_mul_overflow(parts / base.denominator, std::uint64_t{base.numerator}, &result)) return {};
    return result;
  };
  const auto first = in(a), second = in(b);
  if (!first || !second) return std::nullopt;
  std::uint64_t numerator = std::gcd(*first, *second);
  const std::uint64_t common = std::gcd(numerator, parts), most = std::numeric_limits<std::uint32_t>::max();
  numerator /= common;
  if (numerator > most || parts / common > most) return std::nullopt;
  return TimeBase{static_cast<std::uint32_t>(numerator), static_cast<std::uint32_t>(parts / common)};
}

std::int64_t ticksOf(TimeBase fine, TimeBase coarse) {
  return fine.tickAt(coarse.numerator, coarse.denominator);
}

PacketCopier::Mark PacketCopier::markOf(const Packet& packet) {
  return {packet.data.size(), packet.header.surface_hash, crc32c(packet.data)};
}

// Whether what stands in front of the first shown packet is what the track ends with: its last GOP, as far.
Result<bool> PacketCopier::continues(PacketSource& packets, const Cut& cut, const Track& track) const {
  std::uint64_t shown = cut.shown;
  while (shown < cut.end && packets.entryHeader(shown).hidden()) ++shown;
  if (shown == cut.begin || shown - cut.begin != track.gop.size()) return false;
  for (std::uint64_t entry = cut.begin; entry < shown; ++entry) {
    Packet packet{packets.entryHeader(entry), {}};
    const Mark& mark = track.gop[static_cast<std::size_t>(entry - cut.begin)];
    if (packet.header.surface_hash != mark.surface_hash) return false;
    ISOREEL_ASSIGN(packet.data, packets.entryPacket(entry));
    if (markOf(packet) != mark) return false;
  }
  return true;
}

Status PacketCopier::copy(SourceFile& source, const std::vector<Cut>& cuts,
                          const std::vector<std::uint64_t>& tracks, const std::vector<TimeMap>& times,
                          const std::vector<Replacements>& instead) {
  struct Place {
    double order;  // the byte it stands at in an .isr file, the second it is shown at in others
    std::uint64_t entry;
    std::size_t track;
    bool operator<(const Place& other) const { return order < other.order; }
  };
  std::vector<Place> places;
  for (std::size_t t = 0; t < cuts.size(); ++t) {
    const Input& input = source.tracks[t];
    PacketSource& packets = *input.packets;
    Cut cut = cuts[t];
    if (tracks[t] < tracks_.size()) {
      ISOREEL_ASSIGN(const bool goes_on,
                     continues(packets, cut, tracks_[static_cast<std::size_t>(tracks[t])]));
      while (goes_on && (cut.begin < cut.shown || packets.entryHeader(cut.begin).hidden())) ++cut.begin;
    }
    packets.willRead(cut.begin, cut.end);
    for (std::uint64_t entry = cut.begin; entry < cut.end; ++entry)
      places.push_back({input.offsetOf ? static_cast<double>(input.offsetOf(entry))
                                       : input.info.time_base.seconds(packets.entryHeader(entry).time),
                        entry, t});
  }
  std::stable_sort(places.begin(), places.end());
  for (const Place& place : places) {
    if (interrupted) return {ErrorCode::kIo, "interrupted"};
    PacketSource& packets = *source.tracks[place.track].packets;
    Packet packet{packets.entryHeader(place.entry), {}};
    const Replacements* others = instead.empty() ? nullptr : &instead[place.track];
    const bool replaced = others != nullptr && others->contains(place.entry);
    if (replaced) packet = others->at(place.entry);
    if (place.entry < cuts[place.track].shown) packet.header.flags |= FrameHeader::kHidden;
    const std::string where = fmt::format("{}: frame {}", source.path, packet.header.number);
    ISOREEL_TRY(times[place.track].apply(packet.header).at(where));
    if (!replaced) {
      Result<Bytes> data = packets.entryPacket(place.entry);
      if (!data) return named(data.status(), source.path);
      packet.data = *std::move(data);
    }
    ISOREEL_TRY(write(std::move(packet), tracks[place.track]).at(where));
  }
  return {};
}

Status PacketCopier::write(Packet packet, std::uint64_t track) {
  if (track >= tracks_.size()) tracks_.resize(static_cast<std::size_t>(track) + 1);
  Track& state = tracks_[static_cast<std::size_t>(track)];
  packet.header.number = state.frames;
  ISOREEL_TRY(writer_.write(packet, track));
  if (packet.header.back == 0) state.gop.clear();
  state.gop.push_back(markOf(packet));
  state.frames += !packet.header.hidden();
  ++(packet.header.hidden() ? counts_.hidden : counts_.frames);
  return {};
}

}  // namespace isoreel::cli
