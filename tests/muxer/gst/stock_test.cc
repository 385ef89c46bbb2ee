// SPDX-License-Identifier: BSD-3-Clause
// Our packets out of the containers of others, by the demuxers of others.
#include <gtest/gtest.h>
#include <isoreel/container/reader.h>
#include <isoreel/lavf/carrier_writer.h>

#include <filesystem>

#include "pipeline.h"
#include "sequence.h"

namespace isoreel::gst {
namespace {

class Stock : public testing::TestWithParam<const char*> {
 protected:
  Stock() {
    const auto reader = Reader::open(ballFile());
    const lavf::CarrierTrack track{reader->get(), (*reader)->info().time_base, "", ballRecord()};
    const auto carrier = lavf::carrierOf(path_);
    EXPECT_TRUE(lavf::writeCarrier(path_, *carrier, {track}, {.overwrite = true}).ok());
  }
  ~Stock() override { std::filesystem::remove(path_); }

  const std::string path_ = ballFile() + GetParam();
};

TEST_P(Stock, playsFromFrontToBack) {
  const std::string demuxer = std::string(GetParam()) == ".mkv" ? "matroskademux" : "qtdemux";
  Pipeline pipeline("filesrc location=" + path_ + " ! " + demuxer +
                    " ! isoreelvideodec samples=1 ambient=false ! video/x-raw,width=16,height=12 ! "
                    "fakesink name=shown sync=false enable-last-sample=true");
  EXPECT_EQ(pipeline.playToTheEnd(), numbersFrom(0));
}

TEST_P(Stock, seeksShowTheRightFrames) {
  Pipeline pipeline = player(path_);
  ASSERT_TRUE(pipeline.to(GST_STATE_PAUSED));
  seekAtRandom(pipeline, 40);
}

INSTANTIATE_TEST_SUITE_P(Of, Stock, testing::Values(".mov", ".mkv"),
                         [](const auto& about) { return std::string(about.param + 1); });

}  // namespace
}  // namespace isoreel::gst
