// SPDX-License-Identifier: BSD-3-Clause
// A solver that pushes its steps into a GStreamer pipeline: volumes from memory, by appsrc, into an .isr
// file. The same appsrc may feed a renderer, a tee, or a network instead.
#include <gst/app/gstappsrc.h>
#include <gst/gst.h>

#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

namespace {

constexpr int kNodes = 33;
constexpr int kSteps = 10;

// Stands for a solver: signed distance to a ball that rises and swells, in cells.
std::vector<float> solverStep(int step) {
  std::vector<float> phi;
  for (int z = 0; z < kNodes; ++z) {
    for (int y = 0; y < kNodes; ++y) {
      for (int x = 0; x < kNodes; ++x)
        phi.push_back(static_cast<float>(std::hypot(x - 16, y - 16, z - 10 - step) - 6 - 0.3 * step));
    }
  }
  return phi;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return std::fprintf(stderr, "usage: push_volumes OUT.isr\n"), 2;
  gst_init(nullptr, nullptr);

  GError* error = nullptr;
  GstElement* pipeline = gst_parse_launch(
      "appsrc name=solver format=time block=true max-buffers=4 caps=\"application/x-volume, format=F32LE, "
      "width=33, height=33, depth=33, level-set=true, framerate=25/1\" "
      "! isoreelenc step=1/32 ! isoreelmux ! filesink name=file",
      &error);
  if (error != nullptr) return std::fprintf(stderr, "%s\n", error->message), 1;
  GstElement* file = gst_bin_get_by_name(GST_BIN(pipeline), "file");
  g_object_set(file, "location", argv[1], nullptr);
  gst_object_unref(file);
  GstElement* solver = gst_bin_get_by_name(GST_BIN(pipeline), "solver");
  gst_element_set_state(pipeline, GST_STATE_PLAYING);

  GstFlowReturn flow = GST_FLOW_OK;
  for (int step = 0; step < kSteps && flow == GST_FLOW_OK; ++step) {
    const std::vector<float> phi = solverStep(step);
    GstBuffer* volume = gst_buffer_new_memdup(phi.data(), phi.size() * sizeof(float));
    GST_BUFFER_PTS(volume) = static_cast<GstClockTime>(step) * 40 * GST_MSECOND;
    flow = gst_app_src_push_buffer(GST_APP_SRC(solver), volume);  // waits while the encoder is behind
  }
  gst_app_src_end_of_stream(GST_APP_SRC(solver));

  GstBus* bus = gst_element_get_bus(pipeline);
  const auto ends = static_cast<GstMessageType>(GST_MESSAGE_EOS | GST_MESSAGE_ERROR);
  GstMessage* end = gst_bus_timed_pop_filtered(bus, GST_CLOCK_TIME_NONE, ends);
  const bool failed = GST_MESSAGE_TYPE(end) == GST_MESSAGE_ERROR;
  if (failed) {
    gst_message_parse_error(end, &error, nullptr);
    std::fprintf(stderr, "%s\n", error->message);
    g_error_free(error);
  }
  gst_message_unref(end);
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_object_unref(bus);
  gst_object_unref(solver);
  gst_object_unref(pipeline);
  return failed ? 1 : 0;
}
