// SPDX-License-Identifier: BSD-3-Clause
#include "pictures.h"

#include <random>

namespace isoreel::gst {
namespace {

guint64 field(GstBuffer* buffer, const char* name) {
  guint64 value = G_MAXUINT64;
  if (GstCustomMeta* meta = gst_buffer_get_custom_meta(buffer, "IsoreelSurface"))
    gst_structure_get_uint64(gst_custom_meta_get_structure(meta), name, &value);
  return value;
}

}  // namespace

std::string playerOf(const std::string& path) {
  return "playbin uri=file://" + path + " video-sink=\"" + kSmallSink + "\"";
}

bool settled(Pipeline& pipeline) {
  return gst_element_get_state(pipeline.get(), nullptr, nullptr, 60 * GST_SECOND) == GST_STATE_CHANGE_SUCCESS;
}

bool seekTo(Pipeline& pipeline, GstClockTime time) {
  return pipeline.seek(1, GST_FORMAT_TIME, GST_SEEK_FLAG_ACCURATE | GST_SEEK_FLAG_FLUSH,
                       static_cast<gint64>(time)) &&
         settled(pipeline);
}

std::pair<guint64, guint64> shown(const Pipeline& pipeline) {
  GstElement* sink = gst_bin_get_by_name(GST_BIN(pipeline.get()), "shown");
  if (sink == nullptr) return {G_MAXUINT64, 0};
  GstSample* sample = nullptr;
  g_object_get(sink, "last-sample", &sample, nullptr);
  gst_object_unref(sink);
  if (sample == nullptr) return {G_MAXUINT64, 0};
  GstBuffer* buffer = gst_sample_get_buffer(sample);
  const std::pair result{field(buffer, "frame"), field(buffer, "surface-hash")};
  gst_sample_unref(sample);
  return result;
}

void seekAtRandom(Pipeline& pipeline, int seeks, GstClockTime grain) {
  const std::vector<Packet> packets = ballPackets(kFrames);
  std::mt19937 random(7);
  for (int i = 0; i < seeks; ++i) {
    const GstClockTime time = random() % (kFrames * kFrameTime) / grain * grain;
    ASSERT_TRUE(seekTo(pipeline, time)) << time << ": " << pipeline.error;
    const auto [frame, hash] = shown(pipeline);
    EXPECT_EQ(frame, time / kFrameTime) << time;
    EXPECT_EQ(hash, packets[time / kFrameTime].header.surface_hash) << time;
  }
}

std::vector<guint64> playToTheEnd(Pipeline& pipeline) {
  std::vector<guint64> numbers;
  GstPad* pad = gst_element_get_static_pad(pipeline["shown"], "sink");
  const gulong probe = gst_pad_add_probe(
      pad, GST_PAD_PROBE_TYPE_BUFFER,
      [](GstPad*, GstPadProbeInfo* info, gpointer list) {
        static_cast<std::vector<guint64>*>(list)->push_back(field(GST_PAD_PROBE_INFO_BUFFER(info), "frame"));
        return GST_PAD_PROBE_OK;
      },
      &numbers, nullptr);
  EXPECT_TRUE(pipeline.run()) << pipeline.error;
  gst_pad_remove_probe(pad, probe);
  gst_object_unref(pad);
  return numbers;
}

std::vector<guint64> numbersFrom(guint64 first) {
  std::vector<guint64> result;
  for (guint64 i = first; i < kFrames; ++i) result.push_back(i);
  return result;
}

}  // namespace isoreel::gst
