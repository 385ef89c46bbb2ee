// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <isoreel/inspect/movie.h>

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
}

#include <unistd.h>

namespace isoreel::inspect {
namespace {

namespace fs = std::filesystem;

Image plain(int width, int height, std::uint8_t grey) {
  Image image{width, height, {}};
  image.pixels.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 4, grey);
  return image;
}

class Movie : public testing::Test {
 protected:
  Movie() : folder_(fs::temp_directory_path() / ("isoreel_movie_test_" + std::to_string(::getpid()))) {
    fs::create_directories(folder_);
  }
  ~Movie() override { fs::remove_all(folder_); }
  fs::path folder_;
};

TEST_F(Movie, HoldsPicturesAndUnevenTimes) {
  const fs::path path = folder_ / "a:b.mp4";
  const std::vector<std::int64_t> times{100, 101, 105, 106};
  const std::vector<std::uint64_t> durations{1, 4, 1, 7};
  const std::vector<std::uint8_t> greys{20, 90, 160, 230};
  auto movie = MovieWriter::create(path, 33, 25, {1, 30});
  ASSERT_TRUE(movie.ok()) << movie.status().message();
  for (std::size_t i = 0; i < 4; ++i)
    ASSERT_TRUE(movie->add(plain(33, 25, greys[i]), times[i], durations[i]).ok());
  EXPECT_EQ(movie->add(plain(33, 25, 0), 106, 1).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(movie->add(plain(32, 25, 0), 107, 1).error().code, ErrorCode::kInvalidArgument);
  EXPECT_FALSE(fs::exists(path));
  const Status finished = movie->finish();
  ASSERT_TRUE(finished.ok()) << finished.message();

  AVFormatContext* file = nullptr;
  ASSERT_EQ(avformat_open_input(&file, ("file:" + path.string()).c_str(), nullptr, nullptr), 0);
  ASSERT_GE(avformat_find_stream_info(file, nullptr), 0);
  const AVStream* stream = file->streams[0];
  EXPECT_EQ(stream->codecpar->width, 34);
  EXPECT_EQ(stream->codecpar->height, 26);
  EXPECT_NEAR(static_cast<double>(stream->duration) * av_q2d(stream->time_base), 13.0 / 30, 1e-3);
  AVCodecContext* decoder = avcodec_alloc_context3(avcodec_find_decoder(stream->codecpar->codec_id));
  avcodec_parameters_to_context(decoder, stream->codecpar);
  decoder->thread_count = 1;
  ASSERT_EQ(avcodec_open2(decoder, nullptr, nullptr), 0);
  AVPacket* packet = av_packet_alloc();
  AVFrame* frame = av_frame_alloc();
  std::size_t count = 0;
  for (bool more = true; more;) {
    more = av_read_frame(file, packet) >= 0;
    avcodec_send_packet(decoder, more ? packet : nullptr);
    while (avcodec_receive_frame(decoder, frame) >= 0) {
      ASSERT_LT(count, 4u);
      EXPECT_NEAR(static_cast<double>(frame->pts) * av_q2d(stream->time_base),
                  static_cast<double>(times[count] - 100) / 30, 1e-6);
      EXPECT_NEAR(frame->data[0][0], 16 + greys[count] * 219 / 255.0, 4);
      ++count;
    }
    av_packet_unref(packet);
  }
  EXPECT_EQ(count, 4u);
  av_frame_free(&frame);
  av_packet_free(&packet);
  avcodec_free_context(&decoder);
  avformat_close_input(&file);
}

TEST_F(Movie, LeavesNothingUnfinished) {
  {
    auto movie = MovieWriter::create(folder_ / "m.mp4", 32, 32, {1, 1000000});
    ASSERT_TRUE(movie.ok()) << movie.status().message();
    ASSERT_TRUE(movie->add(plain(32, 32, 9), 0, 1).ok());
    EXPECT_FALSE(movie->add(plain(32, 32, 9), 1, 1).ok());  // a millionth of a second
    EXPECT_TRUE(fs::exists(folder_ / "m.mp4.part"));
  }
  EXPECT_TRUE(fs::is_empty(folder_));
  EXPECT_EQ(MovieWriter::create(folder_ / "no" / "m.mp4", 32, 32, {1, 25}).error().code, ErrorCode::kIo);
}

}  // namespace
}  // namespace isoreel::inspect
