// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/lavf/carrier.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>

#include "av.h"
#include "demuxers.h"

namespace isoreel::lavf {
namespace {

constexpr std::size_t kHeadBytes = 4096;

/// The source, with bytes that were read from it already in front.
class Replay final : public ByteSource {
 public:
  Replay(std::unique_ptr<ByteSource> source, Bytes head)
      : source_(std::move(source)), head_(std::move(head)) {}
  Result<std::size_t> read(std::uint64_t offset, std::span<std::uint8_t> out) override {
    if (offset >= head_.size()) return source_->read(offset, out);
    const auto rest = ByteSpan(head_).subspan(static_cast<std::size_t>(offset));
    const std::size_t count = std::min(rest.size(), out.size());
    std::copy_n(rest.begin(), count, out.begin());
    if (count == out.size()) return count;
    ISOREEL_ASSIGN(const std::size_t more, source_->read(head_.size(), out.subspan(count)));
    return count + more;
  }
  std::optional<std::uint64_t> size() const override { return source_->size(); }
  bool seekable() const override { return source_->seekable(); }
  std::string name() const override { return source_->name(); }

 private:
  std::unique_ptr<ByteSource> source_;
  Bytes head_;
};

struct Extension {
  const char* extension;
  Carrier carrier;
};
constexpr std::array<Extension, 7> kExtensions{{{".nut", Carrier::kNut},
                                                {".mov", Carrier::kMov},
                                                {".qt", Carrier::kMov},
                                                {".mp4", Carrier::kMp4},
                                                {".m4v", Carrier::kMp4},
                                                {".mkv", Carrier::kMatroska},
                                                {".avi", Carrier::kAvi}}};

struct Refusal {
  const char* extensions;
  const char* why;
};
constexpr const char* kMpegTs =
    "MPEG-TS has no place for a codec it does not list, and cuts packets anywhere";
constexpr const char* kFlv = "FLV lists its codecs, and ours is none of them";
constexpr const char* kOgg = "Ogg has no mapping for packets with times of their own";
constexpr const char* kWebm = "WebM allows VP8, VP9 and AV1 only; Matroska (.mkv) takes the packets";
constexpr std::array<Refusal, 4> kRefusals{
    {{".ts .m2ts .mts ", kMpegTs}, {".flv .f4v ", kFlv}, {".ogg .ogv .ogx ", kOgg}, {".webm ", kWebm}}};

}  // namespace

const char* carrierName(Carrier carrier) {
  static constexpr std::array<const char*, 5> kNames{"NUT", "MOV", "MP4", "Matroska", "AVI"};
  return kNames[static_cast<std::size_t>(carrier)];
}

Result<Carrier> carrierOf(const std::string& file_name) {
  std::string extension = std::filesystem::path(file_name).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const Extension& known : kExtensions) {
    if (extension == known.extension) return known.carrier;
  }
  for (const Refusal& refusal : kRefusals) {
    if (!extension.empty() && std::string(refusal.extensions).find(extension + " ") != std::string::npos)
      return {ErrorCode::kUnsupported, "a " + extension + " file would lose the surface: " + refusal.why};
  }
  return {ErrorCode::kInvalidArgument,
          "'" + file_name + "' ends in none of .nut .mov .qt .mp4 .m4v .mkv .avi"};
}

Result<Sniffed> sniff(std::unique_ptr<ByteSource> source) {
  Bytes head(kHeadBytes);
  ISOREEL_ASSIGN(const std::size_t got, source->read(0, head).at(source->name()));
  head.resize(got);
  Bytes padded = head;
  padded.resize(head.size() + AVPROBE_PADDING_SIZE);
  AVProbeData probe{};
  probe.filename = "";
  probe.buf = padded.data();
  probe.buf_size = static_cast<int>(head.size());
  const AVInputFormat* found = av_probe_input_format(&probe, 1);
  const bool carrier = found != nullptr && demuxerOf(found->name) != nullptr;
  return Sniffed{std::make_unique<Replay>(std::move(source), std::move(head)), carrier};
}

const Demuxer* demuxerOf(const std::string& name) {
  static constexpr std::array<Demuxer, 4> kDemuxers{{{"nut", Carrier::kNut},
                                                     {"mov,mp4,m4a,3gp,3g2,mj2", Carrier::kMov},
                                                     {"matroska,webm", Carrier::kMatroska},
                                                     {"avi", Carrier::kAvi}}};
  for (const Demuxer& demuxer : kDemuxers) {
    if (name == demuxer.name) return &demuxer;
  }
  return nullptr;
}

}  // namespace isoreel::lavf
