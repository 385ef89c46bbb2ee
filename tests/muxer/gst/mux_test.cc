// SPDX-License-Identifier: BSD-3-Clause
// isoreelmux by GstHarness and in pipelines.
#include <gst/check/gstharness.h>
#include <isoreel/container/parity.h>

#include "support.h"

namespace isoreel::gst {
namespace {

constexpr char kCaps[] = "video/x-isoreel, stream-format=packet, width=13, height=13";

GstBuffer* packetOf(const Packet& packet, GstClockTime time, bool matroska) {
  GstBuffer* buffer = gst_buffer_new_memdup(packet.data.data(), packet.data.size());
  (matroska ? GST_BUFFER_DTS(buffer) : GST_BUFFER_PTS(buffer)) = time;
  GST_BUFFER_DURATION(buffer) = 40 * GST_MSECOND;
  return buffer;
}

// What comes out of the muxer by now.
Bytes pulled(GstHarness* harness) {
  Bytes bytes;
  while (GstBuffer* buffer = gst_harness_try_pull(harness)) {
    const Got got = gotFrom(buffer);
    EXPECT_EQ(got.offset, bytes.size());
    bytes.insert(bytes.end(), got.data.begin(), got.data.end());
    gst_buffer_unref(buffer);
  }
  return bytes;
}

// Pushes packets from `first` on, ends, and gives the file.
Bytes muxed(const std::vector<Packet>& packets, std::size_t first, const char* caps = kCaps,
            bool matroska = false) {
  GstHarness* harness = gst_harness_new_with_padnames("isoreelmux", "sink_0", "src");
  gst_harness_set_src_caps_str(harness, caps);
  for (std::size_t i = first; i < packets.size(); ++i)
    EXPECT_EQ(gst_harness_push(harness, packetOf(packets[i], i * 40 * GST_MSECOND, matroska)), GST_FLOW_OK);
  gst_harness_push_event(harness, gst_event_new_eos());
  while (GST_STATE(harness->element) == GST_STATE_PLAYING) {
    GstEvent* event = gst_harness_pull_event(harness);
    const bool eos = event == nullptr || GST_EVENT_TYPE(event) == GST_EVENT_EOS;
    if (event != nullptr) gst_event_unref(event);
    if (eos) break;
  }
  const Bytes bytes = pulled(harness);
  gst_harness_teardown(harness);
  return bytes;
}

TEST(Mux, keepsPacketsBitForBitWithoutTheirHeaders) {
  const std::vector<Packet> packets = ballPackets(6);
  const auto reader = Reader::open(openMemory(muxed(packets, 0)));
  ASSERT_TRUE(reader.ok()) << reader.error().message;
  EXPECT_TRUE((*reader)->info().indexed);
  ASSERT_EQ((*reader)->frameCount(), 6u);
  for (std::uint64_t i = 0; i < 6; ++i) {
    EXPECT_EQ(*(*reader)->packet(i), packets[i].data);
    const FrameHeader& header = (*reader)->header(i);
    EXPECT_EQ(header.time, static_cast<std::int64_t>(i));
    EXPECT_EQ(header.type, packets[i].header.type);
    EXPECT_EQ(header.vertices, packets[i].header.vertices);
    EXPECT_EQ(header.surface_hash, packets[i].header.surface_hash);
    EXPECT_EQ(header.area, 0) << "no packet tells that";
  }
}

TEST(Mux, takesWhatDemuxersOfOtherContainersGive) {
  const std::vector<Packet> packets = ballPackets(10);
  for (const bool matroska : {false, true}) {
    const char* caps =
        matroska ? "video/x-unknown, fourcc=ISRL" : "video/x-gst-fourcc-ISRL, width=13, height=13";
    // Behind a cut by someone who knows nothing of keys: what cannot be decoded is left out.
    const auto reader = Reader::open(openMemory(muxed(packets, 2, caps, matroska)));
    ASSERT_TRUE(reader.ok()) << reader.error().message;
    ASSERT_EQ((*reader)->frameCount(), 6u);
    EXPECT_EQ(*(*reader)->packet(0), packets[4].data);
    EXPECT_EQ((*reader)->header(0).time, 4);
  }
}

TEST(Mux, leavesOutWhatIsBehindAGap) {
  std::vector<Packet> packets = ballPackets(10);
  packets.erase(packets.begin() + 1);
  const auto reader = Reader::open(openMemory(muxed(packets, 0)));
  ASSERT_TRUE(reader.ok());
  ASSERT_EQ((*reader)->frameCount(), 7u);
  EXPECT_EQ(*(*reader)->packet(1), packets[3].data);
}

TEST(Mux, aSeekBeforeItIsACut) {
  const Folder folder;
  write(folder / "a.isr", ballFile(12));
  Pipeline pipeline("filesrc location=" + (folder / "a.isr") +
                    " ! isoreeldemux ! isoreelmux ! filesink location=" + (folder / "b.isr"));
  ASSERT_TRUE(pipeline.reach(GST_STATE_PAUSED)) << pipeline.error;
  ASSERT_TRUE(pipeline.seek(1, GST_FORMAT_DEFAULT, GST_SEEK_FLAG_FLUSH | GST_SEEK_FLAG_ACCURATE, 6, 10));
  ASSERT_TRUE(pipeline.run()) << pipeline.error;
  const std::string command = ISOREEL_COMMAND " trim " + (folder / "a.isr") + " --from 6 --to 10 -o " +
                              (folder / "c.isr") + " >" + (folder / "log");
  ASSERT_EQ(std::system(command.c_str()), 0);
  EXPECT_EQ(content(folder / "b.isr"), content(folder / "c.isr"));
}

TEST(Mux, writesTagsAndChaptersThatAreSet) {
  const Folder folder;
  write(folder / "a.isr", ballFile(8, {.tags = R"({"title":"old","deep":[1]})"}));
  Pipeline pipeline("filesrc location=" + (folder / "a.isr") +
                    " ! isoreeldemux ! isoreelmux name=mux ! filesink location=" + (folder / "b.isr"));
  GstElement* mux = pipeline["mux"];
  gst_tag_setter_add_tags(GST_TAG_SETTER(mux), GST_TAG_MERGE_REPLACE, GST_TAG_TITLE, "new", GST_TAG_ARTIST,
                          "me", nullptr);
  gst_tag_setter_set_tag_merge_mode(GST_TAG_SETTER(mux), GST_TAG_MERGE_REPLACE);
  GstToc* toc = gst_toc_new(GST_TOC_SCOPE_GLOBAL);
  for (int i = 0; i < 2; ++i) {
    GstTocEntry* entry = gst_toc_entry_new(GST_TOC_ENTRY_TYPE_CHAPTER, std::to_string(i).c_str());
    gst_toc_entry_set_start_stop_times(entry, i * 80 * gint64{GST_MSECOND},
                                       (i + 1) * 80 * gint64{GST_MSECOND});
    gst_toc_entry_set_tags(entry, gst_tag_list_new(GST_TAG_TITLE, i == 0 ? "a" : "b", nullptr));
    gst_toc_append_entry(toc, entry);
  }
  gst_toc_setter_set_toc(GST_TOC_SETTER(mux), toc);
  gst_toc_unref(toc);
  ASSERT_TRUE(pipeline.run()) << pipeline.error;
  const auto reader = Reader::open(folder / "b.isr");
  ASSERT_TRUE(reader.ok());
  EXPECT_EQ((*reader)->info().tags, R"({"title":"new","deep":[1],"artist":"me"})");
  const std::vector<Chapter> wanted{{Chapter::Kind::kChapter, 0, 0, "a"},
                                    {Chapter::Kind::kChapter, 2, 2, "b"}};
  EXPECT_EQ((*reader)->info().chapters, wanted);
}

TEST(Mux, joinsSequencesByTheirRunningTimes) {
  const Folder folder;
  write(folder / "a.isr", ballFile(5));
  write(folder / "b.isr", ballFile(3, {.first_time = 100}));
  Pipeline pipeline("concat name=c ! isoreelmux times=running ! filesink location=" + (folder / "c.isr") +
                    " filesrc location=" + (folder / "a.isr") +
                    " ! isoreeldemux ! queue ! c. filesrc location=" + (folder / "b.isr") +
                    " ! isoreeldemux ! queue ! c.");
  ASSERT_TRUE(pipeline.run()) << pipeline.error;
  const auto reader = Reader::open(folder / "c.isr");
  ASSERT_TRUE(reader.ok());
  ASSERT_EQ((*reader)->frameCount(), 8u);
  for (std::uint64_t i = 0; i < 8; ++i) EXPECT_EQ((*reader)->header(i).time, static_cast<std::int64_t>(i));
}

TEST(Mux, namesTracks) {
  const Folder folder;
  write(folder / "a.isr", ballFile(4));
  const std::string in = " filesrc location=" + (folder / "a.isr") + " ! isoreeldemux ! queue ! mux.sink_";
  Pipeline pipeline("isoreelmux name=mux track-names=skin,,skin ! filesink location=" + (folder / "b.isr") +
                    in + "0" + in + "1" + in + "2" + in + "3");
  ASSERT_TRUE(pipeline.run()) << pipeline.error;
  const auto reader = Reader::open(folder / "b.isr", "skin 2");
  ASSERT_TRUE(reader.ok()) << reader.error().message;
  std::string names;
  for (const TrackInfo& track : (*reader)->info().tracks) names += track.name + "/";
  EXPECT_EQ(names, "skin//skin 2/track 2/");
  EXPECT_EQ((*reader)->frameCount(), 4u);
}

TEST(Mux, protectsByParity) {
  const Folder folder;
  write(folder / "a.isr", ballFile(8));
  Pipeline pipeline("filesrc location=" + (folder / "a.isr") +
                    " ! isoreeldemux ! isoreelmux parity=20 ! filesink location=" + (folder / "b.isr"));
  ASSERT_TRUE(pipeline.run()) << pipeline.error;
  const auto source = openFile(folder / "b.isr");
  const auto report = checkParity(**source);
  ASSERT_TRUE(report.ok());
  EXPECT_EQ(report->runs, 2u);
  EXPECT_EQ(report->damaged, 0u);
}

TEST(Mux, saysWhatIsWrong) {
  const Folder folder;
  write(folder / "x", Bytes(3000, 7));
  Pipeline bytes("filesrc location=" + (folder / "x") + " ! capssetter caps=\"" + kCaps +
                 "\" ! isoreelmux ! fakesink");
  EXPECT_FALSE(bytes.run());
  EXPECT_NE(bytes.error.find("sink_0: packet header"), std::string::npos) << bytes.error;
  Pipeline nothing("fakesrc num-buffers=0 ! capssetter caps=\"" + std::string(kCaps) +
                   "\" ! isoreelmux ! fakesink");
  EXPECT_FALSE(nothing.run());
  EXPECT_NE(nothing.error.find("there is nothing to write"), std::string::npos) << nothing.error;
}

}  // namespace
}  // namespace isoreel::gst
