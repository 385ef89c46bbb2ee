// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/lavf/carrier_reader.h>

#include <algorithm>
#include <map>

#include "av.h"
#include "demuxers.h"
#include "metadata.h"
#include "sample_list.h"
#include "source_io.h"

namespace isoreel::lavf {
namespace {

constexpr std::uint64_t kFewPackets = 64;  // sooner read and dropped than looked for

/// Files that a file names are never opened.
int openNothing(AVFormatContext*, AVIOContext**, const char*, int, AVDictionary**) { return AVERROR(EPERM); }

TimeBase unitOf(AVRational base) {
  return {static_cast<std::uint32_t>(std::max(base.num, 1)),
          static_cast<std::uint32_t>(std::max(base.den, 1))};
}

std::string tagOf(const AVStream& stream, const char* key) {
  const AVDictionaryEntry* entry = av_dict_get(stream.metadata, key, nullptr, 0);
  return entry == nullptr ? "" : entry->value;
}

/// Where a MOV has a track's name. libavformat reads it with its length in front when the brand is MP4's.
std::string handlerName(const AVStream& stream) {
  std::string name = tagOf(stream, "handler_name");
  if (!name.empty() && static_cast<unsigned char>(name[0]) == name.size() - 1) name.erase(0, 1);
  return name == "VideoHandler" ? "" : name;  // what muxers write when there is none
}

ByteSpan bytesOf(const AVPacket& packet) {
  return {packet.data, static_cast<std::size_t>(std::max(packet.size, 0))};
}

}  // namespace

struct CarrierReader::State {
  std::unique_ptr<ByteSource> source;
  std::unique_ptr<SourceIo> io;
  AVFormatContext* file = nullptr;
  Owner<AVPacket> packet{av_packet_alloc()};
  int stream = -1;
  std::vector<int> streams;  // of our tracks
  Carrier carrier = Carrier::kNut;
  FileInfo info;
  SampleList samples;
  bool listed = false;  // all packets were seen
  std::map<Place, std::size_t> entries;
  std::optional<std::size_t> last;  // entry that was read last, when the demuxer stands behind it
  std::vector<Bytes> kept;          // of a source that cannot go back: the packets

  ~State() { close(); }
  void close() {
    avformat_close_input(&file);
    io.reset();
  }
  Status openFile();
  void listenTo(const std::vector<int>& wanted);
  Status chooseStream(const std::string& track);
  Status readAll();
  Result<bool> nextPacket();
  Place placeOfPacket() const;
  Result<Bytes> fetch(std::size_t entry);
  Result<bool> readUpTo(std::size_t entry);
  /// libavformat's code, or the source's own error behind it.
  Status failure(ErrorCode code, const std::string& what, int number) const {
    return io && !io->status().ok() ? io->status() : Status(code, what + ": " + reason(number));
  }
};

Status CarrierReader::State::openFile() {
  close();
  last.reset();
  io = std::make_unique<SourceIo>(*source);
  file = avformat_alloc_context();
  if (file == nullptr || !packet) throw std::bad_alloc();
  file->pb = io->context();
  file->flags |= AVFMT_FLAG_CUSTOM_IO | AVFMT_FLAG_NOFILLIN | AVFMT_FLAG_NOPARSE;
  file->io_open = openNothing;
  file->format_whitelist = av_strdup(kDemuxerNames);
  const int opened = avformat_open_input(&file, "", nullptr, nullptr);
  if (opened < 0) return failure(ErrorCode::kBadData, "its head is damaged, or not there", opened);
  if (stream >= static_cast<int>(file->nb_streams))
    return {ErrorCode::kBadData, "is not what it was when it was opened"};
  listenTo({stream});
  return {};
}

/// Packets of other streams are passed over, unread where that can be done.
void CarrierReader::State::listenTo(const std::vector<int>& wanted) {
  for (unsigned i = 0; i < file->nb_streams; ++i) {
    const bool heard = std::find(wanted.begin(), wanted.end(), static_cast<int>(i)) != wanted.end();
    file->streams[i]->discard = heard ? AVDISCARD_DEFAULT : AVDISCARD_ALL;
  }
}

Status CarrierReader::State::chooseStream(const std::string& track) {
  const Demuxer* demuxer = demuxerOf(file->iformat->name);
  if (demuxer != nullptr) carrier = demuxer->carrier;
  const AVDictionaryEntry* brand = av_dict_get(file->metadata, "major_brand", nullptr, 0);
  if (carrier == Carrier::kMov && brand != nullptr && std::string(brand->value) != "qt  ")
    carrier = Carrier::kMp4;
  for (unsigned i = 0; i < file->nb_streams; ++i) {
    const AVStream& each = *file->streams[i];
    if (each.codecpar->codec_tag != kFourCc) continue;
    TrackInfo found;
    found.id = streams.size();
    found.name = tagOf(each, "title");
    if (found.name.empty()) found.name = handlerName(each);
    found.time_base = unitOf(each.time_base);
    info.tracks.push_back(found);
    streams.push_back(static_cast<int>(i));
  }
  if (streams.empty()) {
    return {ErrorCode::kBadData,
            std::string("carries no ISRL track, where a ") + carrierName(carrier) + " file of ours does"};
  }
  std::size_t chosen = 0;
  for (; chosen < streams.size() && !track.empty(); ++chosen) {
    if (info.tracks[chosen].name == track || std::to_string(chosen) == track) break;
  }
  if (chosen == streams.size()) {
    return {ErrorCode::kNotFound,
            "there is no track '" + track + "'; the file has " + std::to_string(streams.size()) + " of ours"};
  }
  stream = streams[chosen];
  info.track_id = chosen;
  info.track_name = info.tracks[chosen].name;
  listenTo(streams);
  return {};
}

Place CarrierReader::State::placeOfPacket() const {
  return {packet->pos, packet->pts != AV_NOPTS_VALUE ? packet->pts : packet->dts, packet->size};
}

/// False at the end.
Result<bool> CarrierReader::State::nextPacket() {
  for (;;) {
    av_packet_unref(packet.get());
    const int code = av_read_frame(file, packet.get());
    if (code == AVERROR_EOF && io->status().ok()) return false;
    if (code < 0) return failure(ErrorCode::kBadData, "cannot be read on", code);
    if (packet->stream_index == stream) return true;
    const auto other = std::find(streams.begin(), streams.end(), packet->stream_index);
    if (!listed && other != streams.end() && (packet->flags & AV_PKT_FLAG_DISCARD) == 0)
      ++info.tracks[static_cast<std::size_t>(other - streams.begin())].frames;
  }
}

Status CarrierReader::State::readAll() {
  for (;;) {
    const Result<bool> more = nextPacket();
    if (!more.ok()) {
      if (more.error().code == ErrorCode::kIo) return more.status();
      info.damage.push_back(more.error().message);
      break;
    }
    if (!*more) break;
    Sample sample;
    sample.place = placeOfPacket();
    if (sample.place.time != AV_NOPTS_VALUE) sample.timing.carrier = sample.place.time;
    sample.timing.carrier_duration = packet->duration;
    sample.hidden = (packet->flags & AV_PKT_FLAG_DISCARD) != 0;
    const std::size_t entry = samples.headers().size();
    if (!samples.add(sample, bytesOf(*packet))) continue;
    if (!source->seekable()) {
      kept.resize(std::min(entry, samples.headers().size() - 1));  // less what is hidden in vain
      kept.emplace_back(bytesOf(*packet).begin(), bytesOf(*packet).end());
    }
  }
  listed = true;
  listenTo({stream});
  samples.finish(unitOf(file->streams[stream]->time_base),
                 FactList::parse(takeText(file->metadata, kFactsKey)));
  kept.resize(std::min(kept.size(), samples.headers().size()));
  if (samples.shown().empty()) {
    const std::string why = samples.damage().empty() ? "" : ": " + samples.damage().front();
    return {ErrorCode::kBadData, "its ISRL track holds no frame" + why};
  }
  for (std::size_t i = 0; i < samples.places().size(); ++i) entries.emplace(samples.places()[i], i);
  info.configuration = samples.configuration();
  info.version = info.configuration[4];
  info.minor = info.configuration[5];
  info.time_base = samples.timeBase();
  info.tags = takeTags(file->metadata);
  const FrameHeader& end = samples.headers().back();
  info.chapters = takeChapters(*file, info.time_base, end.time + static_cast<std::int64_t>(end.duration));
  info.attachments = takeAttachments(*file);
  info.bytes = source->size().value_or(0);
  info.damage.insert(info.damage.begin(), samples.damage().begin(), samples.damage().end());
  TrackInfo& track = info.tracks[info.track_id];
  track.time_base = info.time_base;
  track.configuration = info.configuration;
  track.frames = samples.shown().size();
  return {};
}

/// Whether the entry was met; it is in `packet` then.
Result<bool> CarrierReader::State::readUpTo(std::size_t entry) {
  for (;;) {
    ISOREEL_ASSIGN(const bool more, nextPacket());
    if (!more) return false;
    const auto found = entries.find(placeOfPacket());
    if (found == entries.end()) continue;
    last = found->second;
    if (found->second >= entry) return found->second == entry;
  }
}

Result<Bytes> CarrierReader::State::fetch(std::size_t entry) {
  if (!kept.empty()) return kept[entry];
  enum class From { kHere, kSeek, kStart };
  const bool near = file != nullptr && last && *last < entry && entry - *last <= kFewPackets;
  for (const From from : {From::kHere, From::kSeek, From::kStart}) {
    if (from == From::kHere && !near) continue;
    if (from == From::kSeek && file == nullptr) continue;  // could not be opened anew the last time
    if (from == From::kSeek) {
      last.reset();
      const std::uint64_t back = std::min<std::uint64_t>(samples.headers()[entry].back, entry);
      const Place& key = samples.places()[entry - back];
      if (av_seek_frame(file, stream, key.time, AVSEEK_FLAG_BACKWARD) < 0) continue;
    }
    if (from == From::kStart) ISOREEL_TRY(openFile());
    ISOREEL_ASSIGN(const bool met, readUpTo(entry));
    if (met) return Bytes(bytesOf(*packet).begin(), bytesOf(*packet).end());
  }
  return {ErrorCode::kBadData, "is not where it was when the file was opened"};
}

CarrierReader::CarrierReader(std::unique_ptr<State> state) : state_(std::move(state)) {}
CarrierReader::~CarrierReader() = default;

Result<std::unique_ptr<CarrierReader>> CarrierReader::open(std::unique_ptr<ByteSource> source,
                                                           const std::string& track) {
  av_log_set_level(AV_LOG_QUIET);  // what goes wrong comes back as a Status
  const std::string name = source->name();
  ISOREEL_ASSIGN(Sniffed sniffed, sniff(std::move(source)));
  if (!sniffed.carrier)
    return {ErrorCode::kUnsupported, name + ": is no NUT, MOV, MP4, Matroska or AVI file"};
  auto state = std::make_unique<State>();
  state->source = std::move(sniffed.source);
  ISOREEL_TRY(state->openFile().at(name));
  ISOREEL_TRY(state->chooseStream(track).at(name));
  ISOREEL_TRY(state->readAll().at(name));
  return std::unique_ptr<CarrierReader>(new CarrierReader(std::move(state)));
}

const FileInfo& CarrierReader::info() const { return state_->info; }
Carrier CarrierReader::carrier() const { return state_->carrier; }
std::uint64_t CarrierReader::frameCount() const { return state_->samples.shown().size(); }
std::uint64_t CarrierReader::entryCount() const { return state_->samples.headers().size(); }
std::uint64_t CarrierReader::entryOf(std::uint64_t frame) const {
  return state_->samples.shown()[static_cast<std::size_t>(frame)];
}
const FrameHeader& CarrierReader::header(std::uint64_t frame) const { return entryHeader(entryOf(frame)); }
const FrameHeader& CarrierReader::entryHeader(std::uint64_t entry) const {
  return state_->samples.headers()[static_cast<std::size_t>(entry)];
}
std::uint64_t CarrierReader::entryBytes(std::uint64_t entry) const {
  return static_cast<std::uint64_t>(state_->samples.places()[static_cast<std::size_t>(entry)].bytes);
}

Result<Bytes> CarrierReader::packet(std::uint64_t frame) {
  if (frame < frameCount()) return entryPacket(entryOf(frame));
  return {ErrorCode::kNotFound, state_->source->name() + ": there is no frame at position " +
                                    std::to_string(frame) + "; the file has " + std::to_string(frameCount())};
}

Result<Bytes> CarrierReader::entryPacket(std::uint64_t entry) {
  if (entry >= entryCount()) {
    return {ErrorCode::kNotFound,
            state_->source->name() + ": there is no packet at position " + std::to_string(entry)};
  }
  return state_->fetch(static_cast<std::size_t>(entry))
      .at(state_->source->name() + ": frame " + std::to_string(entryHeader(entry).number));
}

Result<std::unique_ptr<ByteSource>> CarrierReader::openAttachment(const std::string& name) {
  const std::vector<Attachment>& list = state_->info.attachments;
  const auto listed =
      std::find_if(list.begin(), list.end(), [&](const Attachment& a) { return a.name == name; });
  const std::string& where = state_->source->name();
  if (listed == list.end()) return {ErrorCode::kNotFound, where + ": there is no attachment '" + name + "'"};
  if (state_->file == nullptr) ISOREEL_TRY(state_->openFile().at(where));
  const ByteSpan content = attachmentContent(*state_->file, name);
  if (content.size() != listed->bytes)
    return {ErrorCode::kBadData,
            where + ": attachment '" + name + "' is not as it was when the file was opened"};
  return openMemory(Bytes(content.begin(), content.end()), name);
}

}  // namespace isoreel::lavf
