// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/lavf/carrier_writer.h>

#include <isoreel/codec/packet_header.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <optional>

#include "av.h"
#include "facts.h"
#include "metadata.h"
#include "output_file.h"

namespace isoreel::lavf {
namespace {

constexpr std::int64_t kMost32 = std::numeric_limits<std::int32_t>::max();
constexpr std::int64_t kMostTicks = std::int64_t{1} << 61;
constexpr std::uint32_t kMostSide = 65535;                       // MOV and AVI have 16 bits for it
constexpr std::uint64_t kMostAttached = std::uint64_t{1} << 28;  // what libavformat reads of one

/// A track as it will stand in the carrier.
struct Lane {
  const CarrierTrack* track = nullptr;
  AVStream* stream = nullptr;
  std::vector<std::int64_t> times;  // of the entries, in `unit`
  AVRational unit{};
  std::int64_t shift = 0;  // ticks that were added to the times of the headers
  std::uint64_t next = 0;  // entry
};

const char* muxerOf(Carrier carrier) {
  static constexpr std::array<const char*, 5> kMuxers{"nut", "mov", "mov", "matroska", "avi"};
  return kMuxers[static_cast<std::size_t>(carrier)];
}

bool isMov(Carrier carrier) { return carrier == Carrier::kMov || carrier == Carrier::kMp4; }

Status refuse(Carrier carrier, const std::string& why) {
  return {ErrorCode::kUnsupported, std::string(carrierName(carrier)) + " would lose something: " + why};
}

/// The first entry that does not come where a constant rate would have it; none when all do.
std::optional<std::uint64_t> breakOfRate(const Lane& lane) {
  const PacketSource& packets = *lane.track->packets;
  const std::uint64_t gap = packets.entryHeader(0).duration;
  for (std::size_t i = 0; i < lane.times.size(); ++i) {
    const bool comes = i == 0 || static_cast<std::uint64_t>(lane.times[i] - lane.times[i - 1]) == gap;
    if (!comes || packets.entryHeader(i).duration != gap) return i;
  }
  return std::nullopt;
}

/// A rate that AVI can keep: frame i at i units.
Status makeConstant(Lane& lane) {
  const PacketSource& packets = *lane.track->packets;
  if (const auto entry = breakOfRate(lane)) {
    return refuse(Carrier::kAvi, "it knows a constant rate only, and frame " +
                                     std::to_string(packets.entryHeader(*entry).number) +
                                     " breaks it; .nut, .mov and .mkv keep any times");
  }
  const auto gap = static_cast<std::int64_t>(packets.entryHeader(0).duration);
  if (gap < 1 || gap > kMost32 / lane.unit.num) return refuse(Carrier::kAvi, "its unit of time has 31 bits");
  lane.unit.num *= static_cast<int>(gap);
  for (std::size_t i = 0; i < lane.times.size(); ++i) lane.times[i] = static_cast<std::int64_t>(i);
  return {};
}

/// Times as the carrier can have them: not below 0, but for what is hidden in front of a MOV's first frame.
Result<Lane> layOut(const CarrierTrack& track, Carrier carrier) {
  const PacketSource& packets = *track.packets;
  Lane lane;
  lane.track = &track;
  if (packets.frameCount() == 0) return {ErrorCode::kInvalidArgument, "there is no frame to write"};
  if (track.time_base.numerator > kMost32 || track.time_base.denominator > kMost32)
    return refuse(carrier, "its unit of time has 31 bits, and these times need more");
  lane.unit = {static_cast<int>(track.time_base.numerator), static_cast<int>(track.time_base.denominator)};
  const std::uint64_t first_shown = packets.entryOf(0);
  for (std::uint64_t i = 0; i < packets.entryCount(); ++i) {
    const FrameHeader& header = packets.entryHeader(i);
    if (header.hidden() && !(isMov(carrier) && i < first_shown)) {
      return refuse(carrier, "frame " + std::to_string(header.number) +
                                 " has hidden packets in front of it, which are decoded and not shown; a MOV "
                                 "keeps them at its start, no carrier within ('isoreel trim --recode' codes "
                                 "frames that need none)");
    }
    if (header.time > kMostTicks || header.time < -kMostTicks || header.duration > std::uint64_t{kMostTicks})
      return refuse(carrier, "times beyond 2^61 ticks");
    lane.times.push_back(header.time);
  }
  const std::int64_t first = packets.entryHeader(first_shown).time;
  if (first < 0 || first_shown > 0 || carrier == Carrier::kAvi) lane.shift = -first;
  for (std::int64_t& time : lane.times) time += lane.shift;
  for (std::uint64_t i = first_shown; i-- > 0;)
    lane.times[i] = std::min(lane.times[i], lane.times[i + 1] - 1);
  if (carrier == Carrier::kAvi) ISOREEL_TRY(makeConstant(lane));
  for (std::uint64_t i = 1; i < lane.times.size() && isMov(carrier); ++i) {
    if (lane.times[i] - lane.times[i - 1] > kMost32 / lane.unit.num) {
      return refuse(carrier, "frame " + std::to_string(packets.entryHeader(i).number) +
                                 " comes more than 2^31 units of 1/" + std::to_string(lane.unit.den) +
                                 " s behind the one before it");
    }
  }
  return lane;
}

void setExtradata(AVCodecParameters& codec, const Bytes& bytes) {
  codec.extradata = static_cast<std::uint8_t*>(av_mallocz(bytes.size() + AV_INPUT_BUFFER_PADDING_SIZE));
  if (codec.extradata == nullptr) throw std::bad_alloc();
  std::copy(bytes.begin(), bytes.end(), codec.extradata);
  codec.extradata_size = static_cast<int>(bytes.size());
}

Status addStream(AVFormatContext& file, Lane& lane) {
  const CarrierTrack& track = *lane.track;
  ISOREEL_ASSIGN(const Configuration configuration, readConfiguration(track.configuration));
  lane.stream = avformat_new_stream(&file, nullptr);
  if (lane.stream == nullptr) throw std::bad_alloc();
  lane.stream->time_base = lane.unit;
  const FrameHeader& first = track.packets->entryHeader(0);
  if (!breakOfRate(lane)) {
    // Matroska has no other place for how long the last frame lasts, which those who append want to know.
    av_reduce(&lane.stream->avg_frame_rate.num, &lane.stream->avg_frame_rate.den, track.time_base.denominator,
              static_cast<std::int64_t>(first.duration) * track.time_base.numerator, kMost32);
    lane.stream->r_frame_rate = lane.stream->avg_frame_rate;
  }
  AVCodecParameters& codec = *lane.stream->codecpar;
  codec.codec_type = AVMEDIA_TYPE_VIDEO;
  codec.codec_id = AV_CODEC_ID_NONE;
  codec.codec_tag = kFourCc;
  codec.width = static_cast<int>(std::min(configuration.grid.nodes[0], kMostSide));
  codec.height = static_cast<int>(std::min(configuration.grid.nodes[1], kMostSide));
  setExtradata(codec, track.configuration);
  for (const char* key : {"title", "handler_name"}) {  // the second is MOV's
    if (!track.name.empty()) av_dict_set(&lane.stream->metadata, key, track.name.c_str(), 0);
  }
  return {};
}

/// In parts, so that a length that is not true takes no memory.
Result<Bytes> contentOf(const Attachment& facts, ByteSource& source) {
  constexpr std::uint64_t kPart = std::uint64_t{1} << 20;
  Bytes bytes;
  while (bytes.size() < facts.bytes) {
    const std::size_t done = bytes.size();
    bytes.resize(done + static_cast<std::size_t>(std::min(facts.bytes - done, kPart)));
    ISOREEL_ASSIGN(const std::size_t got, source.read(done, std::span(bytes).subspan(done)));
    if (done + got < bytes.size())
      return {ErrorCode::kBadData, "attachment '" + facts.name + "' is shorter than its length says"};
  }
  return bytes;
}

/// The content of those that it has a place for; a line for others.
Status addAttachments(AVFormatContext& file, Carrier carrier, const CarrierSettings& settings,
                      std::vector<std::string>& losses) {
  std::uint64_t room = kMostAttached;
  for (const auto& [facts, content] : settings.attachments) {
    const bool fits = carrier == Carrier::kMatroska && facts.bytes > 0 && facts.bytes <= room;
    if (!fits) {
      losses.push_back("attachment '" + facts.name + "' stays behind ('isoreel extract' has it): " +
                       (carrier == Carrier::kMatroska
                            ? "Matroska takes 256 MiB of them, and none that is empty"
                            : std::string(carrierName(carrier)) + " has no place for it"));
      continue;
    }
    room -= facts.bytes;
    ISOREEL_ASSIGN(const Bytes bytes, contentOf(facts, *content));
    AVStream* stream = avformat_new_stream(&file, nullptr);
    if (stream == nullptr) throw std::bad_alloc();
    stream->codecpar->codec_type = AVMEDIA_TYPE_ATTACHMENT;
    setExtradata(*stream->codecpar, bytes);
    const std::string type = facts.media_type.empty() ? kAnyMediaType : facts.media_type;
    av_dict_set(&stream->metadata, "filename", facts.name.c_str(), 0);
    av_dict_set(&stream->metadata, "mimetype", type.c_str(), 0);
  }
  return {};
}

/// The facts of all frames are in the tags, which come first: so each packet's head is read once before.
Result<std::string> factsOf(const std::vector<Lane>& lanes) {
  FactList facts;
  for (const Lane& lane : lanes) {
    PacketSource& packets = *lane.track->packets;
    for (std::uint64_t i = 0; i < packets.entryCount(); ++i) {
      ISOREEL_ASSIGN(const Bytes packet, packets.entryPacket(i));
      ISOREEL_ASSIGN(const PacketHeader own, readPacketHeader(packet));
      facts.add(own.number, packets.entryHeader(i));
    }
  }
  return facts.text();
}

std::vector<std::string> lossesOf(Carrier carrier, const std::vector<Lane>& lanes,
                                  const CarrierSettings& settings) {
  std::vector<std::string> losses;
  const std::string name = carrierName(carrier);
  const auto isMarker = [](const Chapter& c) { return c.kind == Chapter::Kind::kMarker; };
  const auto markers = std::count_if(settings.chapters.begin(), settings.chapters.end(), isMarker);
  const bool avi = carrier == Carrier::kAvi;
  if (avi)
    losses.emplace_back("AVI has no place for tags and for facts of frames (area, volume, box and so on)");
  if (avi && !settings.chapters.empty()) losses.emplace_back("AVI has no chapters");
  if (isMov(carrier) && markers > 0) losses.push_back(name + " has chapters, but no markers");
  for (const Lane& lane : lanes) {
    if (lane.shift != 0)
      losses.push_back("times start at 0, where they started at " +
                       std::to_string(lane.track->time_base.seconds(-lane.shift)) + " s");
  }
  return losses;
}

Status begin(OutputFile& output, Carrier carrier, const std::vector<Lane>& lanes,
             const CarrierSettings& settings) {
  AVFormatContext& file = output.context();
  if (carrier != Carrier::kAvi) {
    // NUT's readers take 1023 bytes of a value.
    const std::size_t most = carrier == Carrier::kNut ? 1000 : std::size_t{1} << 20;
    putTags(&file.metadata, settings.tags, most);
    ISOREEL_ASSIGN(const std::string facts, factsOf(lanes));
    putText(&file.metadata, kFactsKey, facts, most);
    std::vector<Chapter> chapters = settings.chapters;
    if (isMov(carrier))
      std::erase_if(chapters, [](const Chapter& c) { return c.kind == Chapter::Kind::kMarker; });
    const Lane& lane = lanes.front();
    const PacketSource& packets = *lane.track->packets;
    const FrameHeader& last = packets.entryHeader(packets.entryCount() - 1);
    const std::int64_t end = last.time + static_cast<std::int64_t>(last.duration);
    putChapters(file, chapters, settings.chapter_base, lane.shift, end);
  }
  Options options;
  if (isMov(carrier)) {
    const std::string scale = std::to_string(lanes.front().unit.den);
    if (lanes.size() == 1) options.set("video_track_timescale", scale);
    options.set("movie_timescale", scale);
    options.set("movflags", "+faststart+use_metadata_tags");
    if (carrier == Carrier::kMp4) options.set("brand", "isom");
  }
  return output.check(avformat_write_header(&file, options.get()));
}

Status writePacket(OutputFile& output, Lane& lane, AVPacket& packet) {
  const std::uint64_t entry = lane.next++;
  const FrameHeader& header = lane.track->packets->entryHeader(entry);
  ISOREEL_ASSIGN(const Bytes data, lane.track->packets->entryPacket(entry));
  if (av_new_packet(&packet, static_cast<int>(data.size())) < 0) throw std::bad_alloc();
  std::memcpy(packet.data, data.data(), data.size());
  packet.stream_index = lane.stream->index;
  packet.pts = packet.dts = lane.times[entry];
  packet.duration = av_cmp_q(lane.unit, {static_cast<int>(lane.track->time_base.numerator),
                                         static_cast<int>(lane.track->time_base.denominator)}) == 0
                        ? static_cast<std::int64_t>(header.duration)
                        : 1;
  if (header.type == PacketType::kIntra) packet.flags |= AV_PKT_FLAG_KEY;
  av_packet_rescale_ts(&packet, lane.unit, lane.stream->time_base);
  return output.check(av_interleaved_write_frame(&output.context(), &packet));
}

/// The lane whose next packet is the earliest; null when all are written.
Lane* earliest(std::vector<Lane>& lanes) {
  Lane* result = nullptr;
  for (Lane& lane : lanes) {
    if (lane.next >= lane.times.size()) continue;
    if (result == nullptr ||
        av_compare_ts(lane.times[lane.next], lane.unit, result->times[result->next], result->unit) < 0) {
      result = &lane;
    }
  }
  return result;
}

}  // namespace

Result<std::vector<std::string>> writeCarrier(const std::filesystem::path& path, Carrier carrier,
                                              const std::vector<CarrierTrack>& tracks,
                                              const CarrierSettings& settings) {
  if (tracks.empty()) return {ErrorCode::kInvalidArgument, "there is no track to write"};
  std::vector<Lane> lanes;
  for (const CarrierTrack& track : tracks) {
    ISOREEL_ASSIGN(Lane lane, layOut(track, carrier).at(path.string()));
    lanes.push_back(std::move(lane));
  }
  OutputFile output;
  ISOREEL_TRY(output.open(path, muxerOf(carrier), settings.overwrite));
  for (Lane& lane : lanes) ISOREEL_TRY(addStream(output.context(), lane));
  std::vector<std::string> losses = lossesOf(carrier, lanes, settings);
  ISOREEL_TRY(addAttachments(output.context(), carrier, settings, losses).at(path.string()));
  ISOREEL_TRY(begin(output, carrier, lanes, settings));
  const Owner<AVPacket> packet(av_packet_alloc());
  if (!packet) throw std::bad_alloc();
  while (Lane* lane = earliest(lanes)) {
    ISOREEL_TRY(writePacket(output, *lane, *packet));
    if (settings.onPacket && !settings.onPacket()) return {ErrorCode::kIo, path.string() + ": was stopped"};
  }
  ISOREEL_TRY(output.check(av_write_trailer(&output.context())));
  ISOREEL_TRY(output.commit());
  return losses;
}

}  // namespace isoreel::lavf
