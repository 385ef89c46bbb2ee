// SPDX-License-Identifier: BSD-3-Clause
// Whole pipelines, from a file to pictures.
#include <gst/pbutils/gstdiscoverer.h>
#include <gtest/gtest.h>
#include <isoreel/container/writer.h>
#include <unistd.h>

#include <filesystem>
#include <random>

#include "sequence.h"

namespace isoreel::gst {
namespace {

constexpr GstClockTime kPatience = 20 * GST_SECOND;

/// The sequence in a file of its own, while the tests run.
const std::string& ballFile() {
  static const struct File {
    std::string path =
        std::filesystem::temp_directory_path() / ("isoreel_play_test_" + std::to_string(getpid()) + ".isr");
    File() {
      WriterSettings settings;
      settings.configuration = ballRecord();
      settings.tags = R"({"title":"A ball"})";
      auto writer = Writer::create(path, settings);
      for (const Packet& packet : ballPackets()) static_cast<void>((*writer)->write(packet));
      static_cast<void>((*writer)->finish());
    }
    ~File() { std::filesystem::remove(path); }
  } file;
  return file.path;
}

/// Frame and surface hash of the picture that a sink shows in PAUSED.
std::pair<guint64, guint64> shownBy(GstElement* sink) {
  GstSample* sample = nullptr;
  g_object_get(sink, "last-sample", &sample, nullptr);
  if (sample == nullptr) return {kFrames, 0};
  guint64 frame = kFrames, hash = 0;
  if (GstCustomMeta* meta = gst_buffer_get_custom_meta(gst_sample_get_buffer(sample), "IsoreelSurface")) {
    gst_structure_get(gst_custom_meta_get_structure(meta), "frame", G_TYPE_UINT64, &frame, "surface-hash",
                      G_TYPE_UINT64, &hash, nullptr);
  }
  gst_sample_unref(sample);
  return {frame, hash};
}

/// A pipeline that a test owns, with a sink of the name "shown".
class Pipeline {
 public:
  explicit Pipeline(const std::string& description) {
    GError* error = nullptr;
    pipeline_ = gst_parse_launch(description.c_str(), &error);
    EXPECT_EQ(error, nullptr) << error->message;
    sink_ = gst_bin_get_by_name(GST_BIN(pipeline_), "shown");
  }
  Pipeline(GstElement* pipeline, GstElement* sink) : pipeline_(pipeline), sink_(sink) {}
  ~Pipeline() {
    gst_element_set_state(pipeline_, GST_STATE_NULL);
    if (sink_ != nullptr) gst_object_unref(sink_);
    gst_object_unref(pipeline_);
  }
  GstElement* get() const { return pipeline_; }

  ::testing::AssertionResult to(GstState state) {
    if (gst_element_set_state(pipeline_, state) != GST_STATE_CHANGE_FAILURE && settled())
      return testing::AssertionSuccess();
    return testing::AssertionFailure() << message(GST_MESSAGE_ERROR);
  }
  bool settled() {
    return gst_element_get_state(pipeline_, nullptr, nullptr, kPatience) == GST_STATE_CHANGE_SUCCESS;
  }
  bool seek(GstClockTime time, GstSeekFlags flags = GST_SEEK_FLAG_ACCURATE) {
    const auto flushing = static_cast<GstSeekFlags>(flags | GST_SEEK_FLAG_FLUSH);
    return gst_element_seek_simple(pipeline_, GST_FORMAT_TIME, flushing, static_cast<gint64>(time)) &&
           settled();
  }
  /// Numbers of all frames from now to the end, in order.
  std::vector<guint64> playToTheEnd() {
    numbers_.clear();
    GstPad* pad = gst_element_get_static_pad(sink_, "sink");
    const gulong probe = gst_pad_add_probe(
        pad, GST_PAD_PROBE_TYPE_BUFFER,
        [](GstPad*, GstPadProbeInfo* info, gpointer numbers) {
          guint64 frame = kFrames;
          if (GstCustomMeta* meta =
                  gst_buffer_get_custom_meta(GST_PAD_PROBE_INFO_BUFFER(info), "IsoreelSurface"))
            gst_structure_get_uint64(gst_custom_meta_get_structure(meta), "frame", &frame);
          static_cast<std::vector<guint64>*>(numbers)->push_back(frame);
          return GST_PAD_PROBE_OK;
        },
        &numbers_, nullptr);
    gst_element_set_state(pipeline_, GST_STATE_PLAYING);
    EXPECT_EQ(message(static_cast<GstMessageType>(GST_MESSAGE_EOS | GST_MESSAGE_ERROR)), "");
    gst_pad_remove_probe(pad, probe);
    gst_object_unref(pad);
    return numbers_;
  }
  std::pair<guint64, guint64> shown() const { return shownBy(sink_); }

 private:
  /// Text of the next message of these types, "" for the end of the stream.
  std::string message(GstMessageType types) {
    GstBus* bus = gst_element_get_bus(pipeline_);
    GstMessage* found = gst_bus_timed_pop_filtered(bus, kPatience, types);
    gst_object_unref(bus);
    std::string text = found == nullptr ? "nothing was heard" : "";
    if (found != nullptr && GST_MESSAGE_TYPE(found) == GST_MESSAGE_ERROR) {
      GError* error = nullptr;
      gst_message_parse_error(found, &error, nullptr);
      text = error->message;
      g_clear_error(&error);
    }
    if (found != nullptr) gst_message_unref(found);
    return text;
  }

  GstElement* pipeline_ = nullptr;
  GstElement* sink_ = nullptr;
  std::vector<guint64> numbers_;
};

std::vector<guint64> numbersFrom(guint64 first) {
  std::vector<guint64> result;
  for (guint64 i = first; i < kFrames; ++i) result.push_back(i);
  return result;
}

std::string fileToSink(const char* sink = "fakesink name=shown sync=false enable-last-sample=true") {
  return "filesrc location=" + ballFile() +
         " ! isoreeldemux ! isoreelvideodec samples=1 ambient=false ! video/x-raw,width=16,height=12 ! " +
         sink;
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

// As gst-play-1.0 and other players do it: nothing but the file's name is given.
Pipeline player(const std::string& path) {
  GstElement* playbin = gst_element_factory_make("playbin", nullptr);
  gchar* uri = gst_filename_to_uri(path.c_str(), nullptr);
  GstElement* sink = gst_parse_bin_from_description(
      "capsfilter caps=video/x-raw,width=16,height=12 ! fakesink name=shown sync=false "
      "enable-last-sample=true",
      TRUE, nullptr);
  g_object_set(playbin, "uri", uri, "video-sink", sink, nullptr);
  g_free(uri);
  return {playbin, gst_bin_get_by_name(GST_BIN(sink), "shown")};
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

void seekAtRandom(Pipeline& pipeline, int seeks) {
  std::mt19937 random(7);
  for (int i = 0; i < seeks; ++i) {
    const GstClockTime time = random() % (kFrames * kFrameTime);
    ASSERT_TRUE(pipeline.seek(time)) << time;
    const auto [frame, hash] = pipeline.shown();
    EXPECT_EQ(frame, time / kFrameTime) << time;
    EXPECT_EQ(hash, ballPackets()[time / kFrameTime].header.surface_hash) << time;
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
