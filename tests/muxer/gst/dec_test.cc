// SPDX-License-Identifier: BSD-3-Clause
#include <gst/check/gstharness.h>
#include <gtest/gtest.h>
#include <isoreel/codec/decoder.h>

#include "support.h"

namespace isoreel::gst {
namespace {

constexpr std::uint64_t kFrames = 24;
constexpr std::uint64_t kGop = 4;
constexpr GstClockTime kFrameTime = GST_SECOND / 25;

const std::vector<Packet>& packets() {
  static const std::vector<Packet> balls = ballPackets(kFrames);
  return balls;
}

/// What packet i decodes to, in full.
Surface surfaceOf(std::size_t i) {
  Decoder decoder;
  for (std::size_t k = i - i % kGop; k < i; ++k) static_cast<void>(decoder.decode(packets()[k].data));
  return *decoder.decode(packets()[i].data);
}

/// A buffer of a packet as any demuxer would make it.
GstBuffer* bufferFor(const Packet& packet) {
  GstBuffer* buffer = gst_buffer_new_memdup(packet.data.data(), packet.data.size());
  GST_BUFFER_PTS(buffer) = static_cast<GstClockTime>(packet.header.time) * kFrameTime;
  GST_BUFFER_DURATION(buffer) = kFrameTime;
  if (packet.header.type == PacketType::kPredicted) GST_BUFFER_FLAG_SET(buffer, GST_BUFFER_FLAG_DELTA_UNIT);
  return buffer;
}

/// What the meta on a mesh says.
struct Facts {
  guint64 frame = 0, hash = 0;
  guint vertices = 0, faces = 0, level = 0, depth = 0;
};

Facts factsOf(GstBuffer* buffer) {
  Facts facts;
  GstCustomMeta* meta = gst_buffer_get_custom_meta(buffer, "IsoreelSurface");
  if (meta == nullptr) return facts;
  gst_structure_get(gst_custom_meta_get_structure(meta), "frame", G_TYPE_UINT64, &facts.frame, "surface-hash",
                    G_TYPE_UINT64, &facts.hash, "vertices", G_TYPE_UINT, &facts.vertices, "faces",
                    G_TYPE_UINT, &facts.faces, "level", G_TYPE_UINT, &facts.level, "depth", G_TYPE_UINT,
                    &facts.depth, nullptr);
  return facts;
}

/// isoreeldec between pads of the test's.
class Dec : public testing::Test {
 protected:
  Dec() {
    gst_element_set_bus(harness_->element, bus_);
    gst_harness_set_src_caps_str(harness_, "video/x-isoreel, framerate = 25/1");
  }
  ~Dec() override {
    gst_element_set_bus(harness_->element, nullptr);
    gst_harness_teardown(harness_);
    gst_object_unref(bus_);
  }

  GstFlowReturn push(std::size_t i, guint flags = 0) {
    GstBuffer* buffer = bufferFor(packets()[i]);
    GST_BUFFER_FLAG_SET(buffer, flags);
    return gst_harness_push(harness_, buffer);
  }
  GstFlowReturn pushDamaged(std::size_t i) {
    Packet packet = packets()[i];
    packet.data.back() ^= 1;
    return gst_harness_push(harness_, bufferFor(packet));
  }
  void segment(double rate, GstClockTime start, GstClockTime stop,
               GstSegmentFlags flags = GST_SEGMENT_FLAG_NONE) {
    GstSegment segment;
    gst_segment_init(&segment, GST_FORMAT_TIME);
    segment.rate = rate;
    segment.start = segment.time = start;
    segment.stop = stop;
    segment.flags = flags;
    gst_harness_push_event(harness_, gst_event_new_segment(&segment));
  }
  void flush() {
    gst_harness_push_event(harness_, gst_event_new_flush_start());
    gst_harness_push_event(harness_, gst_event_new_flush_stop(TRUE));
    segment(1, 0, GST_CLOCK_TIME_NONE);
  }
  void late(std::size_t frame, GstClockTimeDiff by) {
    gst_harness_push_upstream_event(
        harness_, gst_event_new_qos(by > 0 ? GST_QOS_TYPE_UNDERFLOW : GST_QOS_TYPE_OVERFLOW, 1, by,
                                    frame * kFrameTime));
  }
  /// Frames that came out since the last call.
  std::vector<Facts> pull() {
    std::vector<Facts> result;
    while (GstBuffer* buffer = gst_harness_try_pull(harness_)) {
      result.push_back(factsOf(buffer));
      gst_buffer_unref(buffer);
    }
    return result;
  }
  std::vector<guint64> numbers() {
    std::vector<guint64> result;
    for (const Facts& facts : pull()) result.push_back(facts.frame);
    return result;
  }
  /// Texts of messages of a kind, since the last call.
  std::vector<std::string> messages(GstMessageType type) {
    std::vector<std::string> result;
    while (GstMessage* message = gst_bus_pop_filtered(bus_, type)) {
      GError* error = nullptr;
      if (type == GST_MESSAGE_WARNING) gst_message_parse_warning(message, &error, nullptr);
      if (type == GST_MESSAGE_ERROR) gst_message_parse_error(message, &error, nullptr);
      result.emplace_back(error != nullptr ? error->message : "");
      g_clear_error(&error);
      gst_message_unref(message);
    }
    return result;
  }

  GstHarness* harness_ = gst_harness_new("isoreeldec");
  GstBus* bus_ = gst_bus_new();
};

using Numbers = std::vector<guint64>;
constexpr guint kDiscont = GST_BUFFER_FLAG_DISCONT;

TEST_F(Dec, givesTheTrianglesOfEachFrame) {
  for (std::size_t i = 0; i < 8; ++i) ASSERT_EQ(push(i), GST_FLOW_OK);
  for (std::size_t i = 0; i < 8; ++i) {
    GstBuffer* buffer = gst_harness_pull(harness_);
    const Surface surface = surfaceOf(i);
    const std::vector<Triangle> triangles = surface.triangles();
    EXPECT_EQ(GST_BUFFER_PTS(buffer), i * kFrameTime);
    EXPECT_EQ(GST_BUFFER_DURATION(buffer), kFrameTime);
    const Facts facts = factsOf(buffer);
    EXPECT_EQ(facts.frame, i);
    EXPECT_EQ(facts.hash, surfaceHash(surface));
    EXPECT_EQ(facts.vertices, surface.vertices.size());
    EXPECT_EQ(facts.faces, surface.quads.size());
    EXPECT_EQ(facts.level, facts.depth);
    ASSERT_EQ(gst_buffer_n_memory(buffer), 2u);
    std::vector<float> points(surface.vertices.size() * 3);
    std::vector<Triangle> indices(triangles.size());
    ASSERT_EQ(gst_buffer_get_size(buffer), points.size() * 4 + indices.size() * 12);
    gst_buffer_extract(buffer, 0, points.data(), points.size() * 4);
    gst_buffer_extract(buffer, points.size() * 4, indices.data(), indices.size() * 12);
    EXPECT_EQ(indices, triangles);
    for (std::uint32_t v = 0; v < surface.vertices.size(); ++v) {
      for (std::size_t k = 0; k < 3; ++k)
        ASSERT_EQ(points[3 * v + k], static_cast<float>(surface.world(v)[k]));
    }
    gst_buffer_unref(buffer);
  }
}

TEST_F(Dec, takesWhatStockDemuxersHandOn) {
  for (const char* caps :
       {"video/x-gst-fourcc-ISRL, width = 21, height = 19, framerate = 25/1",
        "video/x-unknown, fourcc = (string) ISRL, bounding-box = (double) < -1, -1, -1, 1, 1, 1 >"}) {
    gst_harness_set_src_caps_str(harness_, caps);
    ASSERT_EQ(push(0), GST_FLOW_OK) << caps;
    EXPECT_EQ(numbers(), Numbers{0});
  }
  GstCaps* out = gst_pad_get_current_caps(harness_->sinkpad);
  gchar* text = gst_caps_to_string(out);
  EXPECT_NE(std::string(text).find("vertex-format=(string)F32LE"), std::string::npos) << text;
  EXPECT_NE(std::string(text).find("bounding-box=(double)< -1, -1, -1, 1, 1, 1 >"), std::string::npos)
      << text;
  g_free(text);
  gst_caps_unref(out);
  GstCaps* other = gst_caps_from_string("video/x-unknown, fourcc = (string) ABCD");
  EXPECT_FALSE(gst_pad_query_accept_caps(GST_PAD_PEER(harness_->srcpad), other));
  gst_caps_unref(other);
}

TEST_F(Dec, afterASeekWaitsForAKeyInSilence) {
  for (std::size_t i = 0; i < 3; ++i) push(i);
  numbers();
  flush();
  for (std::size_t i = 2; i < 6; ++i) EXPECT_EQ(push(i, i == 2 ? kDiscont : 0), GST_FLOW_OK);
  EXPECT_EQ(numbers(), (Numbers{4, 5}));
  EXPECT_TRUE(messages(GST_MESSAGE_WARNING).empty());
}

TEST_F(Dec, namesADamagedPacketAndGoesOnAtTheNextKey) {
  for (std::size_t i = 0; i < kFrames; ++i) EXPECT_EQ(i == 9 ? pushDamaged(i) : push(i), GST_FLOW_OK);
  EXPECT_EQ(numbers(), (Numbers{0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23}));
  Packet damaged = packets()[9];
  damaged.data.back() ^= 1;
  const auto expected = Decoder().decode(damaged.data).status().at("frame 9");
  EXPECT_EQ(messages(GST_MESSAGE_WARNING), std::vector<std::string>{std::string(expected.message())});
  EXPECT_TRUE(messages(GST_MESSAGE_ERROR).empty());
}

TEST_F(Dec, missingPacketsAreNamedToo) {
  for (const std::size_t i : {0u, 1u, 3u, 4u}) EXPECT_EQ(push(i), GST_FLOW_OK);
  EXPECT_EQ(numbers(), (Numbers{0, 1, 4}));
  const auto warnings = messages(GST_MESSAGE_WARNING);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("frame 3: packet: predicted from frame 2"), std::string::npos) << warnings[0];
}

TEST_F(Dec, nothingThatDecodesIsAnError) {
  pushDamaged(0);
  EXPECT_TRUE(messages(GST_MESSAGE_ERROR).empty());
  gst_harness_push_event(harness_, gst_event_new_eos());
  const auto errors = messages(GST_MESSAGE_ERROR);
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_NE(errors[0].find("no frame could be decoded: frame 0: packet"), std::string::npos) << errors[0];
}

TEST_F(Dec, showsWhatTheSegmentHolds) {
  segment(1, 9 * kFrameTime + kFrameTime / 2, 12 * kFrameTime);
  for (std::size_t i = 8; i < 14; ++i) push(i);
  GstBuffer* first = gst_harness_pull(harness_);
  EXPECT_EQ(factsOf(first).frame, 9u);
  EXPECT_EQ(GST_BUFFER_PTS(first), 9 * kFrameTime + kFrameTime / 2);
  EXPECT_EQ(GST_BUFFER_DURATION(first), kFrameTime / 2);
  EXPECT_TRUE(GST_BUFFER_IS_DISCONT(first));
  gst_buffer_unref(first);
  EXPECT_EQ(numbers(), (Numbers{10, 11}));
}

TEST_F(Dec, framesWithoutADurationLastAsLongAsThePacketSays) {
  segment(1, 2 * kFrameTime, GST_CLOCK_TIME_NONE);
  for (std::size_t i = 0; i < 4; ++i) {
    GstBuffer* buffer = bufferFor(packets()[i]);
    GST_BUFFER_DURATION(buffer) = GST_CLOCK_TIME_NONE;
    gst_harness_push(harness_, buffer);
  }
  EXPECT_EQ(numbers(), (Numbers{2, 3}));
}

TEST_F(Dec, decodesHiddenPacketsAndDoesNotShowThem) {
  for (std::size_t i = 0; i < 4; ++i) push(i, i < 2 ? guint{GST_BUFFER_FLAG_DECODE_ONLY} : 0);
  EXPECT_EQ(numbers(), (Numbers{2, 3}));
}

TEST_F(Dec, keysAloneWhenThatIsWanted) {
  segment(8, 0, GST_CLOCK_TIME_NONE, GST_SEGMENT_FLAG_TRICKMODE_KEY_UNITS);
  for (std::size_t i = 0; i < kFrames; ++i) push(i);
  EXPECT_EQ(numbers(), (Numbers{0, 4, 8, 12, 16, 20}));
}

TEST_F(Dec, playsBackward) {
  segment(-1, 0, 11 * kFrameTime);
  for (const std::size_t key : {8u, 4u, 0u}) {
    for (std::size_t i = key; i < key + kGop; ++i) push(i, i == key ? kDiscont : 0);
  }
  EXPECT_EQ(numbers(), (Numbers{10, 9, 8, 7, 6, 5, 4}));
  gst_harness_push_event(harness_, gst_event_new_eos());
  EXPECT_EQ(numbers(), (Numbers{3, 2, 1, 0}));
}

TEST_F(Dec, backwardADamagedPacketCostsWhatNeedsIt) {
  segment(-1, 0, 8 * kFrameTime);
  for (const std::size_t key : {4u, 0u}) {  // no DISCONT: told by the times
    for (std::size_t i = key; i < key + kGop; ++i) i == 6 ? pushDamaged(i) : push(i);
  }
  gst_harness_push_event(harness_, gst_event_new_eos());
  EXPECT_EQ(numbers(), (Numbers{5, 4, 3, 2, 1, 0}));
  const auto warnings = messages(GST_MESSAGE_WARNING);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("frame 7 needs: frame 6: packet"), std::string::npos) << warnings[0];
}

TEST_F(Dec, coarserMeshesBeforeFramesAreDropped) {
  push(0);
  late(0, kFrameTime);
  push(1);
  late(1, kFrameTime);
  push(2);
  late(1, kFrameTime);  // from before the last step: counts for nothing
  push(3);
  auto facts = pull();
  ASSERT_EQ(facts.size(), 4u);
  const guint depth = facts[0].depth;
  EXPECT_EQ(depth, 4u);
  for (const auto& [frame, level] :
       {std::pair{0u, depth}, {1u, depth - 1}, {2u, depth - 2}, {3u, depth - 2}}) {
    EXPECT_EQ(facts[frame].level, level) << frame;
    EXPECT_EQ(facts[frame].hash, packets()[frame].header.surface_hash);
  }
  EXPECT_TRUE(messages(GST_MESSAGE_QOS).empty());

  late(3, kFrameTime);  // in time again from twice as late on: frame 5
  push(4);
  push(5);
  EXPECT_EQ(numbers(), (Numbers{5}));
  EXPECT_EQ(messages(GST_MESSAGE_QOS).size(), 1u);

  late(5 + 30, -1);  // more than a second without a late one
  push(6);
  facts = pull();
  ASSERT_EQ(facts.size(), 1u);
  EXPECT_EQ(facts[0].level, depth - 1);

  flush();
  push(8);
  facts = pull();
  ASSERT_EQ(facts.size(), 1u);
  EXPECT_EQ(facts[0].level, depth);
}

TEST_F(Dec, withoutQosEveryFrameIsWhole) {
  g_object_set(harness_->element, "qos", FALSE, nullptr);
  push(0);
  for (std::size_t i = 1; i < 5; ++i) {
    late(i - 1, GST_SECOND);
    push(i);
  }
  const auto facts = pull();
  ASSERT_EQ(facts.size(), 5u);
  for (const Facts& f : facts) EXPECT_EQ(f.level, f.depth);
  g_object_set(harness_->element, "coarser", 3, nullptr);
  push(5);
  EXPECT_EQ(pull().at(0).level, 1u);
}

}  // namespace
}  // namespace isoreel::gst
