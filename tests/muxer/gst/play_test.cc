// SPDX-License-Identifier: BSD-3-Clause
// Whole pipelines, from a file to pictures.
#include <gst/pbutils/gstdiscoverer.h>
#include <gtest/gtest.h>

#include "pipeline.h"
#include "sequence.h"

namespace isoreel::gst {
namespace {

std::string fileToSink() {
  return "filesrc location=" + ballFile() +
         " ! isoreeldemux ! isoreelvideodec samples=1 ambient=false ! video/x-raw,width=16,height=12 ! "
         "fakesink name=shown sync=false enable-last-sample=true";
}

TEST(Play, showsEveryFrameInOrder) {
  Pipeline pipeline(fileToSink());
  EXPECT_EQ(pipeline.playToTheEnd(), numbersFrom(0));
}

TEST(Play, pausesAndGoesOnWithinAGop) {
  Pipeline pipeline(fileToSink());
  ASSERT_TRUE(pipeline.to(GST_STATE_PAUSED));
  ASSERT_TRUE(pipeline.seek(9 * kFrameTime));
  EXPECT_EQ(pipeline.shown().first, 9u);
  for (int i = 0; i < 5; ++i) {
    gst_element_send_event(pipeline.get(), gst_event_new_step(GST_FORMAT_BUFFERS, 1, 1, TRUE, FALSE));
    ASSERT_TRUE(pipeline.settled());
    EXPECT_EQ(pipeline.shown().first, 10u + static_cast<guint>(i));
  }
  EXPECT_EQ(pipeline.playToTheEnd(), numbersFrom(15));
}

TEST(Play, goesUpAndDownAHundredTimes) {
  Pipeline pipeline = player(ballFile());
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(pipeline.to(GST_STATE_PAUSED)) << i;
    EXPECT_EQ(pipeline.shown().first, 0u) << i;
    if (i % 3 == 0) {
      ASSERT_TRUE(pipeline.to(GST_STATE_PLAYING)) << i;
    }
    ASSERT_TRUE(pipeline.to(i % 2 == 0 ? GST_STATE_READY : GST_STATE_NULL)) << i;
  }
}

TEST(Play, twoHundredSeeksShowTheRightFrames) {
  Pipeline pipeline = player(ballFile());
  ASSERT_TRUE(pipeline.to(GST_STATE_PAUSED));
  seekAtRandom(pipeline, 200);
  gint64 duration = 0;
  EXPECT_TRUE(gst_element_query_duration(pipeline.get(), GST_FORMAT_TIME, &duration));
  EXPECT_EQ(duration, static_cast<gint64>(kFrames * kFrameTime));
}

TEST(Play, backwardShowsEveryFrame) {
  Pipeline pipeline(fileToSink());
  ASSERT_TRUE(pipeline.to(GST_STATE_PAUSED));
  ASSERT_TRUE(gst_element_seek(pipeline.get(), -1, GST_FORMAT_TIME, GST_SEEK_FLAG_FLUSH, GST_SEEK_TYPE_SET, 0,
                               GST_SEEK_TYPE_SET, static_cast<gint64>(kFrames * kFrameTime)));
  std::vector<guint64> expected = numbersFrom(0);
  std::reverse(expected.begin(), expected.end());
  ASSERT_TRUE(pipeline.settled());
  EXPECT_EQ(pipeline.shown().first, kFrames - 1);
  expected.erase(expected.begin());
  EXPECT_EQ(pipeline.playToTheEnd(), expected);
}

TEST(Play, isDiscovered) {
  GstDiscoverer* discoverer = gst_discoverer_new(kPatience, nullptr);
  gchar* uri = gst_filename_to_uri(ballFile().c_str(), nullptr);
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
