// SPDX-License-Identifier: BSD-3-Clause
#include "pipeline.h"

#include <isoreel/container/writer.h>
#include <unistd.h>

#include <filesystem>
#include <random>

#include "sequence.h"

namespace isoreel::gst {
namespace {

guint64 field(GstBuffer* buffer, const char* name) {
  guint64 value = G_MAXUINT64;
  if (GstCustomMeta* meta = gst_buffer_get_custom_meta(buffer, "IsoreelSurface"))
    gst_structure_get_uint64(gst_custom_meta_get_structure(meta), name, &value);
  return value;
}

}  // namespace

const std::string& ballFile() {
  static const struct File {
    std::string path =
        std::filesystem::temp_directory_path() / ("isoreel_gst_test_" + std::to_string(getpid()) + ".isr");
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

Pipeline::Pipeline(const std::string& description) {
  GError* error = nullptr;
  pipeline_ = gst_parse_launch(description.c_str(), &error);
  EXPECT_EQ(error, nullptr) << error->message;
  sink_ = gst_bin_get_by_name(GST_BIN(pipeline_), "shown");
}

Pipeline::~Pipeline() {
  gst_element_set_state(pipeline_, GST_STATE_NULL);
  gst_object_unref(sink_);
  gst_object_unref(pipeline_);
}

testing::AssertionResult Pipeline::to(GstState state) {
  if (gst_element_set_state(pipeline_, state) != GST_STATE_CHANGE_FAILURE && settled())
    return testing::AssertionSuccess();
  return testing::AssertionFailure() << message(GST_MESSAGE_ERROR);
}

bool Pipeline::settled() {
  return gst_element_get_state(pipeline_, nullptr, nullptr, kPatience) == GST_STATE_CHANGE_SUCCESS;
}

bool Pipeline::seek(GstClockTime time) {
  const auto flags = static_cast<GstSeekFlags>(GST_SEEK_FLAG_ACCURATE | GST_SEEK_FLAG_FLUSH);
  return gst_element_seek_simple(pipeline_, GST_FORMAT_TIME, flags, static_cast<gint64>(time)) && settled();
}

std::vector<guint64> Pipeline::playToTheEnd() {
  numbers_.clear();
  GstPad* pad = gst_element_get_static_pad(sink_, "sink");
  const gulong probe = gst_pad_add_probe(
      pad, GST_PAD_PROBE_TYPE_BUFFER,
      [](GstPad*, GstPadProbeInfo* info, gpointer numbers) {
        static_cast<std::vector<guint64>*>(numbers)->push_back(
            field(GST_PAD_PROBE_INFO_BUFFER(info), "frame"));
        return GST_PAD_PROBE_OK;
      },
      &numbers_, nullptr);
  gst_element_set_state(pipeline_, GST_STATE_PLAYING);
  EXPECT_EQ(message(static_cast<GstMessageType>(GST_MESSAGE_EOS | GST_MESSAGE_ERROR)), "");
  gst_pad_remove_probe(pad, probe);
  gst_object_unref(pad);
  return numbers_;
}

std::pair<guint64, guint64> Pipeline::shown() const {
  GstSample* sample = nullptr;
  g_object_get(sink_, "last-sample", &sample, nullptr);
  if (sample == nullptr) return {G_MAXUINT64, 0};
  GstBuffer* buffer = gst_sample_get_buffer(sample);
  const std::pair result{field(buffer, "frame"), field(buffer, "surface-hash")};
  gst_sample_unref(sample);
  return result;
}

/// Text of the next message of these types, "" for the end of the stream.
std::string Pipeline::message(GstMessageType types) {
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

std::vector<guint64> numbersFrom(guint64 first) {
  std::vector<guint64> result;
  for (guint64 i = first; i < kFrames; ++i) result.push_back(i);
  return result;
}

}  // namespace isoreel::gst
