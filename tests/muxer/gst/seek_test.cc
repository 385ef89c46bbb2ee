// SPDX-License-Identifier: BSD-3-Clause
// Seeks of isoreeldemux: by time and frame, every flag, backward, keys only, segments; and queries.
#include <gst/app/gstappsink.h>

#include <mutex>
#include <random>

#include "support.h"

namespace isoreel::gst {
namespace {

constexpr gint64 kFrame = 40 * GST_MSECOND;
constexpr int kFlush = GST_SEEK_FLAG_FLUSH;
constexpr int kAccurate = GST_SEEK_FLAG_FLUSH | GST_SEEK_FLAG_ACCURATE;
constexpr int kKeys = GST_SEEK_FLAG_FLUSH | GST_SEEK_FLAG_KEY_UNIT;

// Twelve frames, keys 0, 4, 8, pulled or pushed with seeks by bytes.
class Seek : public testing::TestWithParam<const char*> {
 protected:
  Seek()
      : pipeline((write(folder / "a.isr", ballFile(12)), GetParam()) + (" location=" + (folder / "a.isr")) +
                 " ! isoreeldemux name=d ! appsink name=sink sync=false max-buffers=1 wait-on-eos=false") {
    EXPECT_TRUE(pipeline.reach(GST_STATE_PAUSED)) << pipeline.error;
    sink = pipeline["sink"];
    const auto watch = [](GstPad*, GstPadProbeInfo* info, gpointer data) {
      auto& test = *static_cast<Seek*>(data);
      const std::lock_guard guard(test.lock);
      if ((info->type & GST_PAD_PROBE_TYPE_BUFFER) != 0) {
        test.arrived.push_back(gotFrom(GST_PAD_PROBE_INFO_BUFFER(info)));
        return GST_PAD_PROBE_OK;
      }
      GstEvent* event = GST_PAD_PROBE_INFO_EVENT(info);
      if (GST_EVENT_TYPE(event) == GST_EVENT_FLUSH_STOP) test.arrived.clear();
      if (GST_EVENT_TYPE(event) == GST_EVENT_SEGMENT) gst_event_copy_segment(event, &test.segment);
      test.segment_done = test.segment_done || GST_EVENT_TYPE(event) == GST_EVENT_SEGMENT_DONE;
      return GST_PAD_PROBE_OK;
    };
    GstPad* pad = gst_element_get_static_pad(sink, "sink");
    const int what =
        GST_PAD_PROBE_TYPE_BUFFER | GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM | GST_PAD_PROBE_TYPE_EVENT_FLUSH;
    gst_pad_add_probe(pad, static_cast<GstPadProbeType>(what), watch, this, nullptr);
    gst_object_unref(pad);
  }

  ~Seek() override {
    gst_element_set_state(pipeline.get(), GST_STATE_NULL);
  }  // before what the probe writes to goes

  // What comes after a flushing seek, to the end; the sink itself drops what is not to be shown.
  std::string seek(double rate, GstFormat format, int flags, gint64 start, gint64 stop = -1) {
    if (!pipeline.seek(rate, format, flags, start, stop)) return "refused";
    EXPECT_TRUE(pipeline.reach(GST_STATE_PLAYING));
    drain(sink);
    EXPECT_TRUE(pipeline.reach(GST_STATE_PAUSED));
    const std::lock_guard guard(lock);
    got = arrived;
    return numbers(got);
  }
  std::string frames(int flags, gint64 start, gint64 stop = -1) {
    return seek(1, GST_FORMAT_DEFAULT, flags, start, stop);
  }

  Folder folder;
  Pipeline pipeline;
  GstElement* sink = nullptr;
  std::mutex lock;
  std::vector<Got> arrived, got;
  GstSegment segment{};
  bool segment_done = false;
};

INSTANTIATE_TEST_SUITE_P(Sources, Seek, testing::Values("filesrc", "pushfilesrc"));

TEST_P(Seek, accurateSeeksGiveWhatIsNeededAndMarkIt) {
  EXPECT_EQ(frames(kAccurate, 6), "(4)(5) 6 7 8 9 10 11");
  EXPECT_TRUE(got[0].jumps);
  EXPECT_TRUE(got[0].key);
  EXPECT_EQ(segment.start, guint64{6 * kFrame});
  EXPECT_EQ(segment.time, guint64{6 * kFrame});
  EXPECT_EQ(frames(kFlush, 8), "8 9 10 11");
  EXPECT_EQ(frames(kAccurate, 3, 6), "(0)(1)(2) 3 4 5");
  // A time within a frame shows that frame, and the segment starts where it was asked to.
  EXPECT_EQ(seek(1, GST_FORMAT_TIME, kAccurate, 6 * kFrame + 7, 7 * kFrame + 1), "(4)(5) 6 7");
  EXPECT_EQ(segment.start, guint64{6 * kFrame + 7});
  EXPECT_EQ(segment.stop, guint64{7 * kFrame + 1});
  EXPECT_EQ(seek(1, GST_FORMAT_TIME, kAccurate, 0), "0 1 2 3 4 5 6 7 8 9 10 11");
}

TEST_P(Seek, keyUnitsLandOnKeys) {
  EXPECT_EQ(frames(kKeys, 6, 10), "4 5 6 7 8 9");
  EXPECT_EQ(segment.start, guint64{4 * kFrame});
  EXPECT_EQ(frames(kKeys | GST_SEEK_FLAG_SNAP_BEFORE, 7, 9), "4 5 6 7 8");
  EXPECT_EQ(frames(kKeys | GST_SEEK_FLAG_SNAP_AFTER, 5, 10), "8 9");
  EXPECT_EQ(segment.start, guint64{8 * kFrame});
  EXPECT_EQ(frames(kKeys | GST_SEEK_FLAG_SNAP_NEAREST, 5, 6), "4 5");
  EXPECT_EQ(frames(kKeys | GST_SEEK_FLAG_SNAP_NEAREST, 7, 9), "8");
  EXPECT_EQ(frames(kKeys, 4, 5), "4");
  EXPECT_EQ(frames(kKeys | GST_SEEK_FLAG_SNAP_AFTER, 9), "8 9 10 11") << "there is no later key";
}

TEST_P(Seek, backwardGivesGopsFromTheLast) {
  EXPECT_EQ(seek(-1, GST_FORMAT_DEFAULT, kAccurate, 2, 10), "8 9 4 5 6 7(0)(1) 2 3");
  EXPECT_EQ(segment.rate, -1);
  EXPECT_EQ(segment.stop, guint64{10 * kFrame});
  for (const std::size_t first : {0u, 2u, 6u}) EXPECT_TRUE(got[first].jumps);
  EXPECT_FALSE(got[1].jumps);
  EXPECT_EQ(seek(-2, GST_FORMAT_TIME, kAccurate, 0, 12 * kFrame), "8 9 10 11 4 5 6 7 0 1 2 3");
}

TEST_P(Seek, trickModeSendsKeysOnly) {
  const int trick = kFlush | GST_SEEK_FLAG_TRICKMODE | GST_SEEK_FLAG_TRICKMODE_KEY_UNITS;
  EXPECT_EQ(seek(8, GST_FORMAT_TIME, trick | GST_SEEK_FLAG_KEY_UNIT, 0), "0 4 8");
  EXPECT_EQ(segment.rate, 8);
  EXPECT_EQ(seek(4, GST_FORMAT_DEFAULT, trick, 5), "4 8");
  EXPECT_EQ(seek(-8, GST_FORMAT_TIME, trick, 0, 12 * kFrame), "8 4 0");
}

TEST_P(Seek, segmentsEndBySegmentDone) {
  ASSERT_TRUE(pipeline.seek(1, GST_FORMAT_DEFAULT, kAccurate | GST_SEEK_FLAG_SEGMENT, 2, 5));
  ASSERT_TRUE(pipeline.reach(GST_STATE_PLAYING));
  EXPECT_EQ(numbers(drain(sink, 3)), "2 3 4");
  EXPECT_TRUE(pipeline.wait(GST_MESSAGE_SEGMENT_DONE));
  // The next one follows without a flush, and running time goes on.
  ASSERT_TRUE(pipeline.seek(1, GST_FORMAT_DEFAULT, GST_SEEK_FLAG_SEGMENT, 4, 7));
  EXPECT_EQ(numbers(drain(sink, 3)), "4 5 6");
  {
    const std::lock_guard guard(lock);  // the stream goes on
    EXPECT_EQ(segment.base, guint64{3 * kFrame});
    EXPECT_TRUE(segment_done) << "the event of the one before";
  }
  EXPECT_TRUE(pipeline.wait(GST_MESSAGE_SEGMENT_DONE));
  ASSERT_TRUE(pipeline.seek(1, GST_FORMAT_DEFAULT, GST_SEEK_FLAG_NONE, 8));
  EXPECT_EQ(numbers(drain(sink)), "8 9 10 11");
}

TEST_P(Seek, refusesWhatItCannot) {
  EXPECT_FALSE(pipeline.seek(1, GST_FORMAT_BUFFERS, kFlush, 0));
  EXPECT_EQ(frames(kAccurate, 11), "(8)(9)(10) 11");
  EXPECT_EQ(frames(kAccurate, 12), "(8)(9)(10) 11") << "the end: a segment that holds none of it";
}

TEST_P(Seek, answersQueries) {
  GstElement* demux = pipeline["d"];
  gint64 value = 0;
  EXPECT_TRUE(gst_element_query_duration(pipeline.get(), GST_FORMAT_TIME, &value));
  EXPECT_EQ(value, 12 * kFrame);
  EXPECT_TRUE(gst_element_query_duration(pipeline.get(), GST_FORMAT_DEFAULT, &value));
  EXPECT_EQ(value, 12);
  frames(kAccurate, 6, 8);
  GstPad* pad = gst_element_get_static_pad(demux, "src_0");
  EXPECT_TRUE(gst_pad_query_position(pad, GST_FORMAT_DEFAULT, &value));
  EXPECT_EQ(value, 7);
  EXPECT_TRUE(gst_pad_query_convert(pad, GST_FORMAT_TIME, 3 * kFrame + 1, GST_FORMAT_DEFAULT, &value));
  EXPECT_EQ(value, 3);
  EXPECT_TRUE(gst_pad_query_convert(pad, GST_FORMAT_DEFAULT, 12, GST_FORMAT_TIME, &value));
  EXPECT_EQ(value, 12 * kFrame);
  EXPECT_FALSE(gst_pad_query_convert(pad, GST_FORMAT_BYTES, 3, GST_FORMAT_DEFAULT, &value));
  gst_object_unref(pad);
  for (const GstFormat format : {GST_FORMAT_TIME, GST_FORMAT_DEFAULT, GST_FORMAT_BYTES}) {
    GstQuery* query = gst_query_new_seeking(format);
    gboolean seekable = FALSE;
    gint64 end = 0;
    if (gst_element_query(pipeline.get(), query))
      gst_query_parse_seeking(query, nullptr, &seekable, nullptr, &end);
    gst_query_unref(query);
    EXPECT_EQ(seekable != FALSE, format != GST_FORMAT_BYTES);
    EXPECT_TRUE(format != GST_FORMAT_DEFAULT || end == 12);
  }
}

// As from an impatient user: seeks before what the last one asked for has come.
TEST_P(Seek, aThousandTimesGiveTheRightFrame) {
  const auto reader = Reader::open(folder / "a.isr");
  std::mt19937 random(5);
  ASSERT_TRUE(pipeline.reach(GST_STATE_PLAYING));
  for (int i = 0; i < 1000; ++i) {
    const std::uint64_t frame = random() % 12;
    ASSERT_TRUE(pipeline.seek(1, GST_FORMAT_DEFAULT, kAccurate, static_cast<gint64>(frame)));
    for (const Got& one : drain(sink, i % 7 == 0 ? 5 : 1)) {
      if (one.hidden || one.offset != frame) continue;
      ASSERT_EQ(one.data, *(*reader)->packet(frame));
    }
  }
}

TEST_P(Seek, pausesAmidAGop) {
  ASSERT_TRUE(pipeline.seek(1, GST_FORMAT_DEFAULT, kAccurate, 1));
  ASSERT_TRUE(pipeline.reach(GST_STATE_PLAYING));
  EXPECT_EQ(numbers(drain(sink, 2)), "1 2");
  ASSERT_TRUE(pipeline.reach(GST_STATE_PAUSED));
  EXPECT_EQ(frames(kAccurate, 2, 4), "(0)(1) 2 3");
  ASSERT_TRUE(pipeline.reach(GST_STATE_READY));
}

TEST(SeekPipe, isRefusedAndPlaysOn) {
  Folder folder;
  write(folder / "a.isr", ballFile(12));
  Pipeline pipeline("filesrc location=" + (folder / "a.isr") +
                    " ! queue ! identity name=i ! isoreeldemux ! appsink name=sink sync=false max-buffers=1");
  // Nothing goes back upstream of here, as from a pipe.
  GstPad* pad = gst_element_get_static_pad(pipeline["i"], "sink");
  const auto block = [](GstPad*, GstPadProbeInfo* info, gpointer) {
    const bool query = (info->type & GST_PAD_PROBE_TYPE_QUERY_UPSTREAM) != 0;
    return query ? GST_PAD_PROBE_DROP : GST_PAD_PROBE_OK;
  };
  gst_pad_add_probe(pad, GST_PAD_PROBE_TYPE_QUERY_UPSTREAM, block, nullptr, nullptr);
  gst_object_unref(pad);
  ASSERT_TRUE(pipeline.reach(GST_STATE_PLAYING)) << pipeline.error;
  EXPECT_EQ(numbers(drain(pipeline["sink"], 2)), "0 1");
  EXPECT_FALSE(pipeline.seek(1, GST_FORMAT_DEFAULT, kAccurate, 0));
  EXPECT_EQ(numbers(drain(pipeline["sink"])), "2 3 4 5 6 7 8 9 10 11");
}

}  // namespace
}  // namespace isoreel::gst
