// SPDX-License-Identifier: BSD-3-Clause
#include <gst/check/gstharness.h>
#include <gst/controller/gstdirectcontrolbinding.h>
#include <gst/controller/gstinterpolationcontrolsource.h>
#include <gst/video/navigation.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

namespace isoreel::gst {
namespace {

constexpr GstClockTime kFrameTime = GST_SECOND / 25;
constexpr auto kNoKeys = GST_NAVIGATION_MODIFIER_NONE;
constexpr char kMesh[] = "model/x-triangle-mesh, vertex-format = F32LE, index-format = U32LE";

template <class Element>
GstMemory* memoryOf(const std::vector<Element>& elements) {
  const std::size_t bytes = elements.size() * sizeof(Element);
  GstMemory* memory = gst_allocator_alloc(nullptr, bytes, nullptr);
  GstMapInfo map;
  gst_memory_map(memory, &map, GST_MAP_WRITE);
  if (bytes > 0) std::memcpy(map.data, elements.data(), bytes);  // an empty vector has no data to point at
  gst_memory_unmap(memory, &map);
  return memory;
}

GstBuffer* meshOf(const std::vector<float>& points, const std::vector<guint32>& triangles, guint64 frame) {
  GstBuffer* buffer = gst_buffer_new();
  gst_buffer_append_memory(buffer, memoryOf(points));
  gst_buffer_append_memory(buffer, memoryOf(triangles));
  GST_BUFFER_PTS(buffer) = frame * kFrameTime;
  GST_BUFFER_DURATION(buffer) = kFrameTime;
  return buffer;
}

/// A pyramid on the ground.
GstBuffer* pyramid(guint64 frame) {
  return meshOf({-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0, 0, 0, 1},
                {0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4, 0, 2, 1, 0, 3, 2}, frame);
}

struct Picture {
  int width = 0, height = 0;
  std::vector<guint8> pixels;
  /// Pixels of the surface: bluer than the backdrop's grey, of the left and the right half.
  int blue(int from, int to) const {
    int count = 0;
    for (int y = 0; y < height; ++y) {
      for (int x = from; x < to; ++x) {
        const guint8* p = &pixels[static_cast<std::size_t>(4 * (y * width + x))];
        count += p[2] - p[0] >= 24;
      }
    }
    return count;
  }
  int blue() const { return blue(0, width); }
};

/// isoreelrender between pads of the test's.
class Render : public testing::Test {
 protected:
  Render() {
    gst_element_set_bus(element(), bus_);
    gst_harness_set_src_caps_str(harness_, kMesh);
    gst_harness_set_sink_caps_str(harness_, "video/x-raw, format = RGBA, width = 64, height = 48");
  }
  ~Render() override {
    gst_element_set_bus(element(), nullptr);
    gst_harness_teardown(harness_);
    gst_object_unref(bus_);
  }
  GstElement* element() const { return harness_->element; }
  void meshCaps(const char* more) {
    gchar* caps = g_strconcat(kMesh, more, nullptr);
    gst_harness_set_src_caps_str(harness_, caps);
    g_free(caps);
  }
  double number(const char* property) const {
    double value = 0;
    g_object_get(element(), property, &value, nullptr);
    return value;
  }
  Picture draw(guint64 frame = 0) {
    if (gst_harness_push(harness_, pyramid(frame)) != GST_FLOW_OK) return {};
    GstBuffer* buffer = gst_harness_pull(harness_);
    Picture picture;
    GstCaps* caps = gst_pad_get_current_caps(harness_->sinkpad);
    gst_structure_get(gst_caps_get_structure(caps, 0), "width", G_TYPE_INT, &picture.width, "height",
                      G_TYPE_INT, &picture.height, nullptr);
    gst_caps_unref(caps);
    picture.pixels.resize(gst_buffer_get_size(buffer));
    gst_buffer_extract(buffer, 0, picture.pixels.data(), picture.pixels.size());
    EXPECT_EQ(GST_BUFFER_PTS(buffer), frame * kFrameTime);
    gst_buffer_unref(buffer);
    EXPECT_EQ(picture.pixels.size(), static_cast<std::size_t>(4 * picture.width * picture.height));
    return picture;
  }
  bool navigate(GstEvent* event) {
    const guint before = gst_harness_upstream_events_received(harness_);
    gst_harness_push_upstream_event(harness_, event);
    return gst_harness_upstream_events_received(harness_) == before;  // it went no further
  }
  void late(guint64 frame, GstClockTimeDiff by) {
    gst_harness_push_upstream_event(harness_,
                                    gst_event_new_qos(GST_QOS_TYPE_UNDERFLOW, 1, by, frame * kFrameTime));
  }
  std::string error() {
    GstMessage* message = gst_bus_pop_filtered(bus_, GST_MESSAGE_ERROR);
    if (message == nullptr) return "";
    GError* error = nullptr;
    gst_message_parse_error(message, &error, nullptr);
    std::string text = error->message;
    g_clear_error(&error);
    gst_message_unref(message);
    return text;
  }

  GstHarness* harness_ = gst_harness_new("isoreelrender");
  GstBus* bus_ = gst_bus_new();
};

TEST_F(Render, drawsAtTheSizeThatIsAskedFor) {
  const Picture small = draw();
  EXPECT_EQ(small.width, 64);
  EXPECT_EQ(small.height, 48);
  EXPECT_GT(small.blue(), 64 * 48 / 20);
  EXPECT_LT(small.blue(), 64 * 48 / 2);
  gst_harness_set_sink_caps_str(harness_,
                                "video/x-raw, format = RGBA, width = 120, height = 40, framerate = 0/1");
  const Picture wide = draw(1);
  EXPECT_EQ(wide.width, 120);
  EXPECT_EQ(wide.height, 40);
}

TEST_F(Render, fillsInWhatNobodyAsksFor) {
  for (const auto& [open, filled] :
       {std::pair{"video/x-raw", "640, height=(int)480, framerate=(fraction)30/1"},
        {"video/x-raw, width = 96", "96, height=(int)72, framerate=(fraction)30/1"},
        {"video/x-raw, height = 90", "120, height=(int)90, framerate=(fraction)30/1"},
        {"video/x-raw, height = [ 1, 60 ], width = [ 1, 100 ]",
         "80, height=(int)60, framerate=(fraction)30/1"}}) {
    gst_harness_set_sink_caps_str(harness_, open);
    meshCaps(", framerate = 30/1");
    draw();
    GstCaps* caps = gst_pad_get_current_caps(harness_->sinkpad);
    gchar* text = gst_caps_to_string(caps);
    EXPECT_NE(std::string(text).find(filled), std::string::npos) << open << " gave " << text;
    g_free(text);
    gst_caps_unref(caps);
  }
}

TEST_F(Render, widePixelsTakeHalfAsMany) {
  const Picture square = draw();
  gst_harness_set_sink_caps_str(
      harness_, "video/x-raw, format = RGBA, width = 32, height = 48, pixel-aspect-ratio = 2/1");
  EXPECT_NEAR(2 * draw(1).blue(), square.blue(), square.blue() / 10.0);
}

TEST_F(Render, looksAtTheBoxThatTheCapsTell) {
  const int own = draw().blue();
  meshCaps(", bounding-box = (double) < -3, -3, 0, 3, 3, 3 >");
  EXPECT_LT(draw(1).blue(), own / 4);
}

TEST_F(Render, controllersMoveTheCamera) {
  GstControlSource* source = gst_interpolation_control_source_new();
  g_object_set(source, "mode", GST_INTERPOLATION_MODE_LINEAR, nullptr);
  gst_timed_value_control_source_set(GST_TIMED_VALUE_CONTROL_SOURCE(source), 0, 0);
  gst_timed_value_control_source_set(GST_TIMED_VALUE_CONTROL_SOURCE(source), 10 * kFrameTime, 90);
  gst_object_add_control_binding(GST_OBJECT(element()), gst_direct_control_binding_new_absolute(
                                                            GST_OBJECT(element()), "azimuth", source));
  gst_object_unref(source);
  draw(0);
  EXPECT_EQ(number("azimuth"), 0);
  draw(5);
  EXPECT_NEAR(number("azimuth"), 45, 1e-9);
}

TEST_F(Render, theMouseTurnsAndMagnifies) {
  draw();
  EXPECT_FALSE(navigate(gst_navigation_event_new_mouse_move(5, 5, kNoKeys)));  // no button held
  EXPECT_TRUE(navigate(gst_navigation_event_new_mouse_button_press(1, 10, 10, kNoKeys)));
  EXPECT_TRUE(navigate(gst_navigation_event_new_mouse_move(26, 22, kNoKeys)));
  EXPECT_NEAR(number("azimuth"), 35 - 45, 1e-9);
  EXPECT_NEAR(number("elevation"), 25 + 45, 1e-9);
  EXPECT_TRUE(navigate(gst_navigation_event_new_mouse_button_release(1, 26, 22, kNoKeys)));
  EXPECT_FALSE(navigate(gst_navigation_event_new_mouse_move(40, 40, kNoKeys)));
  EXPECT_NEAR(number("azimuth"), 35 - 45, 1e-9);
  const int before = draw(1).blue();
  EXPECT_TRUE(navigate(gst_navigation_event_new_mouse_scroll(0, 0, 0, 2, kNoKeys)));
  EXPECT_NEAR(number("zoom"), 1.21, 1e-9);
  EXPECT_GT(draw(2).blue(), before);
  EXPECT_FALSE(navigate(gst_navigation_event_new_key_press("space", kNoKeys)));
}

TEST_F(Render, draftsBeforeTheDecoderIsAskedForLess) {
  const Picture full = draw(0);
  guint passed = gst_harness_upstream_events_received(harness_);
  late(0, kFrameTime);
  EXPECT_EQ(gst_harness_upstream_events_received(harness_), passed);
  const Picture draft = draw(1);
  EXPECT_NE(draft.pixels, full.pixels);
  EXPECT_NEAR(draft.blue(), full.blue(), full.blue() / 10.0);
  late(1, kFrameTime);  // that did not do: somebody else's turn
  EXPECT_EQ(gst_harness_upstream_events_received(harness_), passed + 1);
  gst_harness_push_event(harness_, gst_event_new_flush_start());
  gst_harness_push_event(harness_, gst_event_new_flush_stop(FALSE));
  GstSegment segment;
  gst_segment_init(&segment, GST_FORMAT_TIME);
  gst_harness_push_event(harness_, gst_event_new_segment(&segment));
  EXPECT_EQ(draw(0).pixels, full.pixels);
}

TEST_F(Render, writesFrameAndTime) {
  const Picture plain = draw(3);
  g_object_set(element(), "overlay", TRUE, nullptr);
  const Picture captioned = draw(3);
  EXPECT_NE(captioned.pixels, plain.pixels);
  EXPECT_TRUE(std::equal(plain.pixels.begin() + 4 * 64 * 24, plain.pixels.end(),
                         captioned.pixels.begin() + 4 * 64 * 24));
}

TEST_F(Render, aSurfaceWithoutTrianglesIsTheBackdrop) {
  ASSERT_EQ(gst_harness_push(harness_, meshOf({}, {}, 0)), GST_FLOW_OK);
  gst_buffer_unref(gst_harness_pull(harness_));
  EXPECT_GT(draw(1).blue(), 0);  // and the camera waits for the first that has some
}

TEST_F(Render, refusesWhatIsNoMesh) {
  EXPECT_EQ(gst_harness_push(harness_, meshOf({0, 0, 0, 1, 0, 0, 0, 1, 0}, {0, 1, 3}, 0)), GST_FLOW_ERROR);
  EXPECT_EQ(error(), "mesh: a triangle names vertex 3 of 3");
  EXPECT_EQ(gst_harness_push(harness_, meshOf({0, 0, 0, 1, 0, 0, 0, 1, NAN}, {0, 1, 2}, 0)), GST_FLOW_ERROR);
  EXPECT_EQ(error(), "mesh: a position is not finite");
  EXPECT_EQ(gst_harness_push(harness_, meshOf({0, 0, 0, 1}, {}, 0)), GST_FLOW_ERROR);
  EXPECT_EQ(error(), "mesh: memories that are not whole positions and whole triangles");
  GstBuffer* one = gst_buffer_new_allocate(nullptr, 48, nullptr);
  EXPECT_EQ(gst_harness_push(harness_, one), GST_FLOW_ERROR);
  EXPECT_EQ(error(), "mesh: a buffer of 1 memories, where positions and triangles are expected");
}

}  // namespace
}  // namespace isoreel::gst
