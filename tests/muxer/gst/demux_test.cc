// SPDX-License-Identifier: BSD-3-Clause
// isoreeldemux from the start to the end: every way that bytes come in, tracks, tags, chapters, damage.
#include <gst/base/gsttypefindhelper.h>

#include <atomic>

#include "support.h"

namespace isoreel::gst {
namespace {

class Demux : public testing::TestWithParam<const char*> {
 protected:
  // Ways for the bytes of $F to come in.
  std::string from(const std::string& path) const {
    std::string text = GetParam();
    return text.replace(text.find('$'), 1, path);
  }
  Folder folder;
};

INSTANTIATE_TEST_SUITE_P(Sources, Demux,
                         testing::Values("filesrc location=$", "filesrc location=$ blocksize=1000 ! queue",
                                         "pushfilesrc location=$"));

TEST_P(Demux, givesThePacketsOfTheFile) {
  write(folder / "a.isr", ballFile(10));
  const auto reader = Reader::open(folder / "a.isr");
  ASSERT_TRUE(reader.ok());
  Pipeline pipeline(from(folder / "a.isr") + " ! isoreeldemux ! appsink name=sink sync=false");
  ASSERT_TRUE(pipeline.reach(GST_STATE_PLAYING)) << pipeline.error;
  const std::vector<Got> got = drain(pipeline["sink"]);
  ASSERT_EQ(got.size(), 10u);
  for (std::uint64_t i = 0; i < 10; ++i) {
    EXPECT_EQ(got[i].data, *(*reader)->packet(i));
    EXPECT_EQ(got[i].time, i * 40 * GST_MSECOND);
    EXPECT_EQ(got[i].duration, 40 * GST_MSECOND);
    EXPECT_EQ(got[i].key, (*reader)->header(i).type == PacketType::kIntra);
    EXPECT_EQ(got[i].jumps, i == 0);
    EXPECT_FALSE(got[i].hidden);
  }
}

TEST_P(Demux, muxAndDemuxGiveTheFilesBytes) {
  FileOptions options;
  options.tags =
      R"({"software":"isoreel 0.1.0","title":"Ball","frames":7,"nested":{"a":[1,2]},"source":"x y"})";
  options.chapters = {{Chapter::Kind::kChapter, 0, 0, "Start"},
                      {Chapter::Kind::kMarker, 3, 0, "Höhe"},
                      {Chapter::Kind::kChapter, 4, 0, "Rest"}};
  for (const std::int64_t first : {0, 120}) {
    options.first_time = first;
    const Bytes bytes = ballFile(10, options);
    write(folder / "a.isr", bytes);
    Pipeline pipeline(from(folder / "a.isr") +
                      " ! isoreeldemux ! isoreelmux ! filesink location=" + (folder / "b.isr"));
    ASSERT_TRUE(pipeline.run()) << pipeline.error;
    EXPECT_EQ(content(folder / "b.isr"), bytes) << "first frame at " << first;
  }
}

TEST_P(Demux, severalTracksHaveAPadEach) {
  const Bytes bytes = ballFile(9, {.tracks = 3});
  write(folder / "a.isr", bytes);
  Pipeline pipeline(
      from(folder / "a.isr") +
      " ! isoreeldemux name=d d.src_0 ! queue ! appsink name=s0 sync=false "
      "d.src_1 ! queue ! appsink name=s1 sync=false d.src_2 ! queue ! appsink name=s2 sync=false");
  ASSERT_TRUE(pipeline.reach(GST_STATE_PLAYING)) << pipeline.error;
  for (unsigned t = 0; t < 3; ++t) {
    const auto reader = Reader::open(folder / "a.isr", std::to_string(t));
    const std::vector<Got> got = drain(pipeline[("s" + std::to_string(t)).c_str()]);
    ASSERT_EQ(got.size(), 9u);
    for (std::uint64_t i = 0; i < 9; ++i) EXPECT_EQ(got[i].data, *(*reader)->packet(i));
  }
}

TEST_P(Demux, tracksAndTheirNamesSurviveRemuxing) {
  const Bytes bytes = ballFile(6, {.tracks = 2});
  write(folder / "a.isr", bytes);
  Pipeline pipeline(from(folder / "a.isr") + " ! isoreeldemux name=d isoreelmux name=m ! filesink location=" +
                    (folder / "b.isr") + " d.src_0 ! queue ! m.sink_0 d.src_1 ! queue ! m.sink_1");
  ASSERT_TRUE(pipeline.run()) << pipeline.error;
  EXPECT_EQ(content(folder / "b.isr"), bytes);
}

TEST_P(Demux, saysWhyAFileCannotBeRead) {
  for (const Bytes& bytes : {Bytes(4000, 'x'), Bytes{}, Bytes{0x89, 'I', 'S', 'R', 0x0D, 0x0A}}) {
    write(folder / "a.isr", bytes);
    const auto wanted = Reader::open(folder / "a.isr");
    ASSERT_FALSE(wanted.ok());
    const std::string reason = wanted.error().message;
    Pipeline pipeline(from(folder / "a.isr") + " ! isoreeldemux ! fakesink");
    EXPECT_FALSE(pipeline.run());
    EXPECT_TRUE(bytes.empty() || pipeline.error == reason) << pipeline.error << " for " << reason;
  }
}

TEST_P(Demux, playsWhatIsWholeOfACutFile) {
  Bytes bytes = ballFile(10, {.finished = false});
  bytes.resize(bytes.size() - 10);
  write(folder / "a.isr.part", bytes);
  Pipeline pipeline(from(folder / "a.isr.part") + " ! isoreeldemux ! appsink name=sink sync=false");
  ASSERT_TRUE(pipeline.reach(GST_STATE_PLAYING)) << pipeline.error;
  EXPECT_EQ(numbers(drain(pipeline["sink"])), "0 1 2 3 4 5 6 7 8");
  EXPECT_TRUE(pipeline.wait(GST_MESSAGE_EOS));
  EXPECT_EQ(pipeline.warnings.size(), 1u);
}

TEST_P(Demux, goesUpAndDownAHundredTimes) {
  write(folder / "a.isr", ballFile(10, {.tracks = 2}));
  Pipeline pipeline(from(folder / "a.isr") +
                    " ! isoreeldemux name=d queue name=q0 ! fakesink queue name=q1 ! fakesink");
  // Pads come and go with each round, where gst-launch links once.
  const auto link = [](GstElement* demux, GstPad* pad, gpointer) {
    GstElement* bin = GST_ELEMENT(gst_element_get_parent(demux));
    GstElement* queue =
        gst_bin_get_by_name(GST_BIN(bin), g_str_has_suffix(GST_PAD_NAME(pad), "0") ? "q0" : "q1");
    GstPad* to = gst_element_get_static_pad(queue, "sink");
    EXPECT_EQ(gst_pad_link(pad, to), GST_PAD_LINK_OK);
    gst_object_unref(to);
    gst_object_unref(queue);
    gst_object_unref(bin);
  };
  g_signal_connect(pipeline["d"], "pad-added", G_CALLBACK(+link), nullptr);
  for (int i = 0; i < 100; ++i) {
    const GstState up = i % 3 == 0 ? GST_STATE_PLAYING : GST_STATE_PAUSED;
    ASSERT_TRUE(pipeline.reach(up)) << pipeline.error << " at " << i;
    ASSERT_TRUE(pipeline.reach(i % 2 == 0 ? GST_STATE_READY : GST_STATE_NULL));
  }
}

using DemuxFile = Demux;
INSTANTIATE_TEST_SUITE_P(Sources, DemuxFile, testing::Values("filesrc location=$"));

TEST_P(DemuxFile, damagedPacketsAreToldAndTheRestOfTheirGopLeftOut) {
  Bytes bytes = ballFile(12);
  write(folder / "good.isr", bytes);
  const auto good = Reader::open(folder / "good.isr");
  const std::uint64_t fifth = (*good)->chunkOffset(5) + (*good)->chunkBytes(5) - 20;
  bytes[fifth] ^= 1;
  write(folder / "a.isr", bytes);
  const auto reader = Reader::open(folder / "a.isr");
  const std::string reason = (*reader)->packet(5).error().message;
  Pipeline pipeline(from(folder / "a.isr") + " ! isoreeldemux ! appsink name=sink sync=false");
  ASSERT_TRUE(pipeline.reach(GST_STATE_PLAYING)) << pipeline.error;
  const std::vector<Got> got = drain(pipeline["sink"]);
  EXPECT_EQ(numbers(got), "0 1 2 3 4 8 9 10 11");
  EXPECT_TRUE(got[5].jumps);
  EXPECT_TRUE(pipeline.wait(GST_MESSAGE_EOS));
  ASSERT_EQ(pipeline.warnings.size(), 1u);
  EXPECT_EQ(pipeline.warnings[0], reason);
}

TEST_P(DemuxFile, hiddenFramesAreMarked) {
  const std::vector<Packet> packets = ballPackets(8);
  auto writer = Writer::create(folder / "cut.isr", ballWriter());
  for (std::size_t i = 4; i < 8; ++i) {
    Packet packet = packets[i];
    packet.header.number = i < 6 ? 0 : i - 6;
    packet.header.flags = i < 6 ? FrameHeader::kHidden : 0;
    packet.header.time = static_cast<std::int64_t>(i) - 6;  // hidden ones below 0
    ASSERT_TRUE((*writer)->write(packet).ok());
  }
  ASSERT_TRUE((*writer)->finish().ok());
  Pipeline pipeline(
      from(folder / "cut.isr") +
      " ! isoreeldemux ! tee name=t t. ! queue ! appsink name=sink sync=false wait-on-eos=false "
      "t. ! queue ! isoreelmux ! filesink location=" +
      (folder / "b.isr"));
  ASSERT_TRUE(pipeline.run()) << pipeline.error;
  const std::vector<Got> got = drain(pipeline["sink"]);
  EXPECT_EQ(numbers(got), "(0)(0) 0 1");
  EXPECT_EQ(got[2].time, 0u);
  EXPECT_EQ(content(folder / "b.isr"), content(folder / "cut.isr"));
}

TEST_P(DemuxFile, tellsTagsAndChapters) {
  FileOptions options;
  options.tags = R"({"title":"Ball","artist":"solver","steps":{"dt":0.1}})";
  options.chapters = {{Chapter::Kind::kChapter, 0, 0, "Fall"}, {Chapter::Kind::kChapter, 5, 2, "Impact"}};
  write(folder / "a.isr", ballFile(8, options));
  Pipeline direct(from(folder / "a.isr") + " ! isoreeldemux ! fakesink");
  ASSERT_TRUE(direct.run()) << direct.error;
  ASSERT_NE(direct.tags, nullptr);
  gchar* text = nullptr;
  ASSERT_TRUE(gst_tag_list_get_string(direct.tags, GST_TAG_TITLE, &text));
  EXPECT_STREQ(text, "Ball");
  g_free(text);
  ASSERT_TRUE(gst_tag_list_get_string(direct.tags, GST_TAG_EXTENDED_COMMENT, &text));
  EXPECT_STREQ(text, "steps={\"dt\":0.1}");
  g_free(text);
  ASSERT_NE(direct.toc, nullptr);
  const GstTocEntry* edition = static_cast<GstTocEntry*>(gst_toc_get_entries(direct.toc)->data);
  const GList* chapters = gst_toc_entry_get_sub_entries(edition);
  ASSERT_EQ(g_list_length(const_cast<GList*>(chapters)), 2u);
  gint64 start = 0, stop = 0;
  ASSERT_TRUE(gst_toc_entry_get_start_stop_times(static_cast<GstTocEntry*>(chapters->data), &start, &stop));
  EXPECT_EQ(start, 0);
  EXPECT_EQ(stop, 5 * 40 * gint64{GST_MSECOND});
}

TEST_P(DemuxFile, followsAFileThatGrows) {
  const std::vector<Packet> packets = ballPackets(9);
  auto writer = Writer::create(folder / "a.isr", ballWriter());
  for (std::size_t i = 0; i < 3; ++i) ASSERT_TRUE((*writer)->write(packets[i]).ok());
  Pipeline pipeline(from(folder / "a.isr.part") +
                    " ! isoreeldemux follow=true ! appsink name=sink sync=false");
  ASSERT_TRUE(pipeline.reach(GST_STATE_PLAYING)) << pipeline.error;
  EXPECT_EQ(numbers(drain(pipeline["sink"], 3)), "0 1 2");
  for (std::size_t i = 3; i < 9; ++i) ASSERT_TRUE((*writer)->write(packets[i]).ok());
  ASSERT_TRUE((*writer)->finish().ok());
  EXPECT_EQ(numbers(drain(pipeline["sink"])), "3 4 5 6 7 8");
  EXPECT_TRUE(pipeline.wait(GST_MESSAGE_EOS));
}

// Somebody rewinds the source by bytes: all begins anew.
TEST(DemuxPush, aFlushFromUpstreamBeginsAnew) {
  const Folder folder;
  write(folder / "a.isr", ballFile(5));
  std::atomic<int> buffers{0};  // outlives the pipeline
  Pipeline pipeline("pushfilesrc name=f location=" + (folder / "a.isr") +
                    " ! identity name=i ! isoreeldemux name=d fakesink name=s sync=false");
  const auto link = [](GstElement*, GstPad* pad, gpointer sink) {
    GstPad* to = gst_element_get_static_pad(GST_ELEMENT(sink), "sink");
    EXPECT_EQ(gst_pad_link(pad, to), GST_PAD_LINK_OK);
    gst_object_unref(to);
  };
  const auto count = [](GstElement*, GstBuffer*, GstPad*, gpointer counter) {
    ++*static_cast<std::atomic<int>*>(counter);
  };
  GstElement* sink = pipeline["s"];
  g_object_set(sink, "signal-handoffs", TRUE, nullptr);
  g_signal_connect(sink, "handoff", G_CALLBACK(+count), &buffers);
  g_signal_connect(pipeline["d"], "pad-added", G_CALLBACK(+link), sink);
  ASSERT_TRUE(pipeline.run()) << pipeline.error;
  EXPECT_EQ(buffers, 5);
  GstPad* source = gst_element_get_static_pad(pipeline["i"], "sink");
  ASSERT_TRUE(gst_pad_push_event(source, gst_event_new_seek(1, GST_FORMAT_BYTES, GST_SEEK_FLAG_FLUSH,
                                                            GST_SEEK_TYPE_SET, 0, GST_SEEK_TYPE_NONE, -1)));
  gst_object_unref(source);
  EXPECT_TRUE(pipeline.wait(GST_MESSAGE_EOS)) << pipeline.error;
  EXPECT_EQ(buffers, 10);
}

TEST(TypeFind, knowsTheMagicAndNothingElse) {
  const Bytes bytes = ballFile(1);
  const auto type = [](ByteSpan data) {
    GstTypeFindProbability sure = GST_TYPE_FIND_NONE;
    GstCaps* caps = gst_type_find_helper_for_data(nullptr, data.data(), data.size(), &sure);
    std::string name = caps != nullptr ? gst_structure_get_name(gst_caps_get_structure(caps, 0)) : "";
    gst_clear_caps(&caps);
    return name;
  };
  EXPECT_EQ(type(bytes), "application/x-isoreel");
  Bytes other = bytes;
  other[4] = '\n';
  EXPECT_NE(type(other), "application/x-isoreel");
}

}  // namespace
}  // namespace isoreel::gst
