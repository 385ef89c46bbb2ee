// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/inspect/movie.h>

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libswscale/swscale.h>
}

#include <algorithm>
#include <cstring>
#include <limits>

namespace isoreel::inspect {
namespace {

constexpr std::uint32_t kLargestDenominator = 65535;  // MPEG-4 part 2 takes no finer ticks
constexpr AVRational kFineTicks{1, 60000};
// The first that the machine has and that takes the settings.
constexpr std::array<const char*, 3> kEncoders{"libx264", "libopenh264", "mpeg4"};

struct Release {
  void operator()(AVCodecContext* p) const { avcodec_free_context(&p); }
  void operator()(AVFrame* p) const { av_frame_free(&p); }
  void operator()(AVPacket* p) const { av_packet_free(&p); }
  void operator()(SwsContext* p) const { sws_freeContext(p); }
  void operator()(AVFormatContext* p) const {
    if (p->pb != nullptr) avio_closep(&p->pb);
    avformat_free_context(p);
  }
};
template <class T>
using Owner = std::unique_ptr<T, Release>;

std::string reason(int code) {
  char text[AV_ERROR_MAX_STRING_SIZE];
  return av_strerror(code, text, sizeof text) == 0 ? text : "unknown error";
}

Owner<AVFrame> newFrame(int width, int height, AVPixelFormat format) {
  Owner<AVFrame> frame(av_frame_alloc());
  if (!frame) throw std::bad_alloc();
  frame->width = width;
  frame->height = height;
  frame->format = format;
  if (av_frame_get_buffer(frame.get(), 0) < 0) throw std::bad_alloc();
  return frame;
}

/// Null when this machine has no such encoder, or it refuses.
Owner<AVCodecContext> openEncoder(const char* name, int width, int height, AVRational ticks) {
  const AVCodec* codec = avcodec_find_encoder_by_name(name);
  if (codec == nullptr) return nullptr;
  Owner<AVCodecContext> encoder(avcodec_alloc_context3(codec));
  if (!encoder) return nullptr;
  encoder->width = width;
  encoder->height = height;
  encoder->pix_fmt = AV_PIX_FMT_YUV420P;
  encoder->time_base = ticks;
  encoder->color_range = AVCOL_RANGE_MPEG;
  encoder->color_primaries = AVCOL_PRI_BT709;
  encoder->color_trc = AVCOL_TRC_BT709;
  encoder->colorspace = AVCOL_SPC_BT709;
  encoder->max_b_frames = 0;  // times then reach the file as they are, however uneven
  encoder->thread_count = 1;  // what is written depends on the number of threads
  encoder->gop_size = 25;     // players seek to these
  encoder->flags |= AV_CODEC_FLAG_GLOBAL_HEADER | AV_CODEC_FLAG_QSCALE | AV_CODEC_FLAG_BITEXACT;
  encoder->global_quality = 3 * FF_QP2LAMBDA;  // where there is no crf
  AVDictionary* options = nullptr;
  av_dict_set(&options, "crf", "18", 0);
  const int opened = avcodec_open2(encoder.get(), codec, &options);
  av_dict_free(&options);
  return opened < 0 ? nullptr : std::move(encoder);
}

}  // namespace

struct MovieWriter::State {
  std::filesystem::path path, part;
  int width = 0, height = 0;  // of the pictures
  AVRational base{}, ticks{};
  Owner<AVCodecContext> encoder;
  Owner<AVFormatContext> file;
  AVStream* stream = nullptr;
  Owner<SwsContext> convert;
  Owner<AVFrame> rgba, yuv;
  Owner<AVPacket> packet;
  std::vector<std::array<std::int64_t, 2>> durations;  // by time; those that no packet has had yet
  std::int64_t last = std::numeric_limits<std::int64_t>::min();
  bool begun = false;
  std::int64_t first = 0;

  ~State() {
    file.reset();
    std::error_code ignored;
    if (!part.empty()) std::filesystem::remove(part, ignored);
  }
  Status failure(ErrorCode code, const std::string& why) const {
    return {code, path.string() + ": the movie cannot be written: " + why};
  }
  Status check(int code) const { return code < 0 ? failure(ErrorCode::kIo, reason(code)) : Status(); }

  Status open();
  Status encode(const AVFrame* frame);
};

Status MovieWriter::State::open() {
  av_log_set_level(AV_LOG_QUIET);  // what goes wrong comes back as a Status
  const int even_width = width + width % 2, even_height = height + height % 2;
  for (const char* name : kEncoders) {
    encoder = openEncoder(name, even_width, even_height, ticks);
    if (encoder) break;
  }
  if (!encoder) {
    return failure(ErrorCode::kUnsupported, "no encoder of this machine takes pictures of " +
                                                std::to_string(width) + " x " + std::to_string(height) +
                                                " pixels");
  }
  AVFormatContext* context = nullptr;
  // "file:" keeps a colon in a name from being read as a protocol.
  ISOREEL_TRY(
      check(avformat_alloc_output_context2(&context, nullptr, "mp4", ("file:" + part.string()).c_str())));
  file.reset(context);
  file->flags |= AVFMT_FLAG_BITEXACT;
  stream = avformat_new_stream(file.get(), nullptr);
  packet.reset(av_packet_alloc());
  if (stream == nullptr || !packet) throw std::bad_alloc();
  stream->time_base = ticks;
  ISOREEL_TRY(check(avcodec_parameters_from_context(stream->codecpar, encoder.get())));
  ISOREEL_TRY(check(avio_open(&file->pb, file->url, AVIO_FLAG_WRITE)));
  AVDictionary* options = nullptr;
  av_dict_set(&options, "movflags", "+faststart", 0);
  const int begun_file = avformat_write_header(file.get(), &options);
  av_dict_free(&options);
  ISOREEL_TRY(check(begun_file));

  rgba = newFrame(even_width, even_height, AV_PIX_FMT_RGBA);
  yuv = newFrame(even_width, even_height, AV_PIX_FMT_YUV420P);
  convert.reset(sws_getContext(
      even_width, even_height, AV_PIX_FMT_RGBA, even_width, even_height, AV_PIX_FMT_YUV420P,
      SWS_BICUBIC | SWS_ACCURATE_RND | SWS_FULL_CHR_H_INP | SWS_BITEXACT, nullptr, nullptr, nullptr));
  if (!convert) throw std::bad_alloc();
  const int* bt709 = sws_getCoefficients(SWS_CS_ITU709);
  sws_setColorspaceDetails(convert.get(), bt709, 1, bt709, 0, 0, 1 << 16, 1 << 16);
  return {};
}

Status MovieWriter::State::encode(const AVFrame* frame) {
  ISOREEL_TRY(check(avcodec_send_frame(encoder.get(), frame)));
  for (;;) {
    const int received = avcodec_receive_packet(encoder.get(), packet.get());
    if (received == AVERROR(EAGAIN) || received == AVERROR_EOF) return {};
    ISOREEL_TRY(check(received));
    const auto shown = std::find_if(durations.begin(), durations.end(),
                                    [&](const auto& entry) { return entry[0] == packet->pts; });
    if (shown != durations.end()) {
      packet->duration = (*shown)[1];
      durations.erase(shown);
    }
    av_packet_rescale_ts(packet.get(), encoder->time_base, stream->time_base);
    packet->stream_index = stream->index;
    ISOREEL_TRY(check(av_write_frame(file.get(), packet.get())));
    av_packet_unref(packet.get());
  }
}

MovieWriter::MovieWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
MovieWriter::MovieWriter(MovieWriter&&) noexcept = default;
MovieWriter& MovieWriter::operator=(MovieWriter&&) noexcept = default;
MovieWriter::~MovieWriter() = default;

Result<MovieWriter> MovieWriter::create(const std::filesystem::path& path, int width, int height,
                                        TimeBase base) {
  auto state = std::make_unique<State>();
  state->path = path;
  state->width = width;
  state->height = height;
  if (width < 1 || height < 1 || base.numerator == 0 || base.denominator == 0)
    return state->failure(ErrorCode::kInvalidArgument, "its size or time base is nought");
  constexpr std::uint32_t kLargest = std::numeric_limits<int>::max();
  if (base.numerator > kLargest || base.denominator > kLargest)
    return state->failure(ErrorCode::kInvalidArgument, "its time base is above 2147483647");
  state->base = {static_cast<int>(base.numerator), static_cast<int>(base.denominator)};
  state->ticks = base.denominator <= kLargestDenominator ? state->base : kFineTicks;
  state->part = path;
  state->part += ".part";
  ISOREEL_TRY(state->open());
  return MovieWriter(std::move(state));
}

Status MovieWriter::add(const Image& image, std::int64_t time, std::uint64_t duration) {
  State& s = *state_;
  if (image.width != s.width || image.height != s.height)
    return s.failure(ErrorCode::kInvalidArgument, "its pictures differ in size");
  if (!s.begun) s.first = time;
  s.begun = true;
  const std::int64_t begin = av_rescale_q(time - s.first, s.base, s.ticks);
  const std::int64_t end =
      av_rescale_q(time - s.first + static_cast<std::int64_t>(duration), s.base, s.ticks);
  if (begin <= s.last)
    return s.failure(ErrorCode::kInvalidArgument, "times of pictures do not rise, or by less than 1/60000 s");
  s.last = begin;
  // The encoder may still refer to the last picture's memory.
  if (av_frame_make_writable(s.rgba.get()) < 0 || av_frame_make_writable(s.yuv.get()) < 0)
    throw std::bad_alloc();
  for (int y = 0; y < s.rgba->height; ++y) {
    const auto row =
        static_cast<std::size_t>(std::min(y, image.height - 1)) * static_cast<std::size_t>(image.width);
    std::uint8_t* out = s.rgba->data[0] + static_cast<std::ptrdiff_t>(y) * s.rgba->linesize[0];
    std::memcpy(out, &image.pixels[row * 4], static_cast<std::size_t>(image.width) * 4);
    if (s.rgba->width > image.width) std::memcpy(out + image.width * 4, out + (image.width - 1) * 4, 4);
  }
  sws_scale(s.convert.get(), s.rgba->data, s.rgba->linesize, 0, s.rgba->height, s.yuv->data, s.yuv->linesize);
  s.yuv->pts = begin;
  s.yuv->quality = s.encoder->global_quality;
  s.durations.push_back({begin, std::max<std::int64_t>(end - begin, 1)});
  return s.encode(s.yuv.get());
}

Status MovieWriter::finish() {
  State& s = *state_;
  ISOREEL_TRY(s.encode(nullptr));
  ISOREEL_TRY(s.check(av_write_trailer(s.file.get())));
  ISOREEL_TRY(s.check(avio_closep(&s.file->pb)));
  std::error_code error;
  std::filesystem::rename(s.part, s.path, error);
  if (error) return s.failure(ErrorCode::kIo, error.message());
  s.part.clear();
  return {};
}

}  // namespace isoreel::inspect
