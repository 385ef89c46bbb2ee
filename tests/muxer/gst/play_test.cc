// SPDX-License-Identifier: BSD-3-Clause
// Whole pipelines, from a file to pictures.
#include <gst/pbutils/gstdiscoverer.h>
#include <gtest/gtest.h>

#include "pictures.h"

namespace isoreel::gst {
namespace {

/// A file of balls, played.
class Play : public testing::Test {
 protected:
  Play() { write(path_, ballFile(kFrames, {.tags = R"({"title":"A ball"})"})); }
  std::string fileToSink() const {
    return "filesrc location=" + path_ + " ! isoreeldemux ! isoreelvideodec samples=1 ambient=false ! " +
           kSmallSink;
  }

  const Folder folder_;
  const std::string path_ = folder_ / "ball.isr";
};

TEST_F(Play, showsEveryFrameInOrder) {
  Pipeline pipeline(fileToSink());
  EXPECT_EQ(playToTheEnd(pipeline), numbersFrom(0));
}

TEST_F(Play, pausesAndGoesOnWithinAGop) {
  Pipeline pipeline(fileToSink());
  ASSERT_TRUE(pipeline.reach(GST_STATE_PAUSED));
  ASSERT_TRUE(seekTo(pipeline, 9 * kFrameTime));
  EXPECT_EQ(shown(pipeline).first, 9u);
  for (guint64 i = 10; i < 15; ++i) {
    gst_element_send_event(pipeline.get(), gst_event_new_step(GST_FORMAT_BUFFERS, 1, 1, TRUE, FALSE));
    ASSERT_TRUE(settled(pipeline));
    EXPECT_EQ(shown(pipeline).first, i);
  }
  EXPECT_EQ(playToTheEnd(pipeline), numbersFrom(15));
}

TEST_F(Play, goesUpAndDownAHundredTimes) {
  Pipeline pipeline(playerOf(path_));
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(pipeline.reach(GST_STATE_PAUSED)) << i << ": " << pipeline.error;
    EXPECT_EQ(shown(pipeline).first, 0u) << i;
    if (i % 3 == 0) {
      ASSERT_TRUE(pipeline.reach(GST_STATE_PLAYING)) << i << ": " << pipeline.error;
    }
    ASSERT_TRUE(pipeline.reach(i % 2 == 0 ? GST_STATE_READY : GST_STATE_NULL)) << i << ": " << pipeline.error;
  }
}

TEST_F(Play, twoHundredSeeksShowTheRightFrames) {
  Pipeline pipeline(playerOf(path_));
  ASSERT_TRUE(pipeline.reach(GST_STATE_PAUSED)) << pipeline.error;
  seekAtRandom(pipeline, 200);
  gint64 duration = 0;
  EXPECT_TRUE(gst_element_query_duration(pipeline.get(), GST_FORMAT_TIME, &duration));
  EXPECT_EQ(duration, static_cast<gint64>(kFrames * kFrameTime));
}

TEST_F(Play, backwardShowsEveryFrame) {
  Pipeline pipeline(fileToSink());
  ASSERT_TRUE(pipeline.reach(GST_STATE_PAUSED));
  ASSERT_TRUE(
      pipeline.seek(-1, GST_FORMAT_TIME, GST_SEEK_FLAG_FLUSH, 0, static_cast<gint64>(kFrames * kFrameTime)));
  ASSERT_TRUE(settled(pipeline));
  EXPECT_EQ(shown(pipeline).first, kFrames - 1);
  std::vector<guint64> expected = numbersFrom(0);
  expected.pop_back();
  EXPECT_EQ(playToTheEnd(pipeline), std::vector<guint64>(expected.rbegin(), expected.rend()));
}

TEST_F(Play, aDamagedFilePlaysOn) {
  Bytes bytes = ballFile(kFrames);
  bytes[bytes.size() / 2] ^= 1;
  write(path_, bytes);
  Pipeline pipeline(fileToSink());
  const std::vector<guint64> numbers = playToTheEnd(pipeline);
  EXPECT_EQ(pipeline.warnings.size(), 1u);
  EXPECT_LT(numbers.size(), kFrames);
  EXPECT_GE(numbers.size(), kFrames - 4);
  EXPECT_EQ(numbers.back(), kFrames - 1);
}

TEST_F(Play, isDiscovered) {
  GstDiscoverer* discoverer = gst_discoverer_new(60 * GST_SECOND, nullptr);
  gchar* uri = gst_filename_to_uri(path_.c_str(), nullptr);
  GError* error = nullptr;
  GstDiscovererInfo* info = gst_discoverer_discover_uri(discoverer, uri, &error);
  g_free(uri);
  ASSERT_EQ(error, nullptr) << error->message;
  EXPECT_EQ(gst_discoverer_info_get_duration(info), kFrames * kFrameTime);
  EXPECT_TRUE(gst_discoverer_info_get_seekable(info));
  GList* streams = gst_discoverer_info_get_video_streams(info);
  EXPECT_EQ(g_list_length(streams), 1u);
  const GstTagList* tags = gst_discoverer_info_get_tags(info);
  gchar* title = nullptr;
  ASSERT_NE(tags, nullptr);
  EXPECT_TRUE(gst_tag_list_get_string(tags, GST_TAG_TITLE, &title));
  EXPECT_STREQ(title, "A ball");
  g_free(title);
  gst_discoverer_stream_info_list_free(streams);
  gst_discoverer_info_unref(info);
  g_object_unref(discoverer);
}

}  // namespace
}  // namespace isoreel::gst
