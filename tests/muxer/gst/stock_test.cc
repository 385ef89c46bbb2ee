// SPDX-License-Identifier: BSD-3-Clause
// Our packets out of the containers of others, by the demuxers of others.
#include <gtest/gtest.h>
#include <isoreel/lavf/carrier_writer.h>

#include "pictures.h"

namespace isoreel::gst {
namespace {

class Stock : public testing::TestWithParam<const char*> {
 protected:
  Stock() {
    write(folder_ / "ball.isr", ballFile(kFrames));
    const auto reader = Reader::open(folder_ / "ball.isr");
    const FileInfo& info = (*reader)->info();
    const lavf::CarrierTrack track{reader->get(), info.time_base, "", info.configuration};
    const auto written = lavf::writeCarrier(path_, *lavf::carrierOf(path_), {track});
    EXPECT_TRUE(written.ok()) << written.status().message();
  }

  const Folder folder_;
  const std::string path_ = folder_ / (std::string("ball.") + GetParam());
};

TEST_P(Stock, playsFromFrontToBack) {
  const std::string demuxer = std::string(GetParam()) == "mkv" ? "matroskademux" : "qtdemux";
  Pipeline pipeline("filesrc location=" + path_ + " ! " + demuxer +
                    " ! isoreelvideodec samples=1 ambient=false ! " + kSmallSink);
  EXPECT_EQ(playToTheEnd(pipeline), numbersFrom(0));
}

TEST_P(Stock, seeksShowTheRightFrames) {
  Pipeline pipeline(playerOf(path_));
  ASSERT_TRUE(pipeline.reach(GST_STATE_PAUSED)) << pipeline.error;
  seekAtRandom(pipeline, 40, kFrameTime);  // in between, qtdemux rounds up
}

INSTANTIATE_TEST_SUITE_P(Of, Stock, testing::Values("mov", "mkv"),
                         [](const auto& about) { return std::string(about.param); });

}  // namespace
}  // namespace isoreel::gst
