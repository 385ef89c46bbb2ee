// SPDX-License-Identifier: BSD-3-Clause
// isoreelenc by GstHarness, and isoreelvolumesrc with it.
#include <gst/check/gstharness.h>
#include <isoreel/io/scalar.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "support.h"

namespace isoreel::gst {
namespace {

constexpr char kBallCaps[] =
    "application/x-volume, format=F32LE, width=13, height=13, depth=13, spacing=<0.5,0.5,0.5>, "
    "origin=<-1,0,2>, "
    "level-set=true, framerate=25/1";

GstBuffer* bufferOf(const void* data, std::size_t bytes, GstClockTime time = GST_CLOCK_TIME_NONE) {
  GstBuffer* buffer = gst_buffer_new_memdup(data, bytes);
  GST_BUFFER_PTS(buffer) = time;
  return buffer;
}
GstBuffer* ballBuffer(std::uint64_t i, GstClockTime time = GST_CLOCK_TIME_NONE) {
  const std::vector<float> samples = ball(i);
  return bufferOf(samples.data(), samples.size() * sizeof(float), time);
}

// The encoder between two pads of ours, and what it says.
class Encode : public testing::Test {
 protected:
  void start(const std::string& properties, const std::string& caps = kBallCaps) {
    harness = gst_harness_new_parse(("isoreelenc gop=4 " + properties).c_str());
    bus = gst_bus_new();
    GstElement* encoder = gst_harness_find_element(harness, "isoreelenc");
    gst_element_set_bus(encoder, bus);
    gst_object_unref(encoder);
    gst_harness_set_src_caps_str(harness, caps.c_str());
  }
  ~Encode() override {
    if (harness != nullptr) gst_harness_teardown(harness);
    if (bus != nullptr) gst_object_unref(bus);
  }
  std::vector<Got> packets() {
    std::vector<Got> all;
    while (GstBuffer* buffer = gst_harness_try_pull(harness)) {
      all.push_back(gotFrom(buffer));
      gst_buffer_unref(buffer);
    }
    return all;
  }
  std::string error() {
    GstMessage* message = gst_bus_pop_filtered(bus, GST_MESSAGE_ERROR);
    if (message == nullptr) return "";
    GError* what = nullptr;
    gst_message_parse_error(message, &what, nullptr);
    std::string text = what->message;
    g_error_free(what);
    gst_message_unref(message);
    return text;
  }

  GstHarness* harness = nullptr;
  GstBus* bus = nullptr;
};

TEST_F(Encode, givesThePacketsOfTheLibrary) {
  start("");
  for (std::uint64_t i = 0; i < 9; ++i)
    ASSERT_EQ(gst_harness_push(harness, ballBuffer(i, i * 40 * GST_MSECOND)), GST_FLOW_OK);
  const std::vector<Packet> wanted = ballPackets(9);
  const std::vector<Got> got = packets();
  ASSERT_EQ(got.size(), 9u);
  for (std::size_t i = 0; i < 9; ++i) {
    EXPECT_EQ(got[i].data, wanted[i].data);
    EXPECT_EQ(got[i].key, wanted[i].header.type == PacketType::kIntra);
    EXPECT_EQ(got[i].time, i * 40 * GST_MSECOND);
    EXPECT_EQ(got[i].duration, 40 * GST_MSECOND);
  }
  GstCaps* caps = gst_pad_get_current_caps(harness->sinkpad);
  const GstStructure* structure = gst_caps_get_structure(caps, 0);
  EXPECT_STREQ(gst_structure_get_name(structure), "video/x-isoreel");
  gint width = 0, numerator = 0, denominator = 0;
  EXPECT_TRUE(gst_structure_get_int(structure, "width", &width));
  EXPECT_EQ(width, 13);
  EXPECT_TRUE(gst_structure_get_fraction(structure, "framerate", &numerator, &denominator));
  EXPECT_EQ(numerator, 25);
  GstBuffer* record = gst_value_get_buffer(gst_structure_get_value(structure, "codec_data"));
  EXPECT_EQ(
      gst_buffer_memcmp(record, 0, ballWriter().configuration.data(), ballWriter().configuration.size()), 0);
  gst_caps_unref(caps);
}

TEST_F(Encode, timesMayComeFromTheRateAlone) {
  start("");
  for (std::uint64_t i = 0; i < 3; ++i) gst_harness_push(harness, ballBuffer(i));
  const std::vector<Packet> wanted = ballPackets(3);
  const std::vector<Got> got = packets();
  ASSERT_EQ(got.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(got[i].data, wanted[i].data);
}

TEST_F(Encode, withoutARateTheNextVolumeTellsHowLongOneLasts) {
  start("", "application/x-volume, format=F32LE, width=13, height=13, depth=13, level-set=true");
  for (const guint64 milliseconds : {0u, 30u, 35u})
    gst_harness_push(harness, ballBuffer(0, milliseconds * GST_MSECOND));
  gst_harness_push_event(harness, gst_event_new_eos());
  const std::vector<Got> got = packets();
  ASSERT_EQ(got.size(), 3u);
  EXPECT_EQ(got[0].duration, 30 * GST_MSECOND);
  EXPECT_EQ(got[1].duration, 5 * GST_MSECOND);
  EXPECT_EQ(got[2].duration, 5 * GST_MSECOND) << "as the one before";
  EXPECT_EQ(got[2].time, 35 * GST_MSECOND);
}

TEST_F(Encode, convertsSamplesOfAnyType) {
  struct Case {
    const char* format;
    std::vector<std::uint8_t> (*made)(float);
  };
  constexpr Case kCases[] = {
      {"U8", [](float v) { return std::vector{static_cast<std::uint8_t>(v)}; }},
      {"S16BE",
       [](float v) {
         const auto s = static_cast<std::int16_t>(v);
         return std::vector{static_cast<std::uint8_t>(s >> 8), static_cast<std::uint8_t>(s)};
       }},
      {"F64LE", [](float v) {
         const double d = static_cast<double>(v);
         std::vector<std::uint8_t> bytes(8);
         std::memcpy(bytes.data(), &d, 8);
         return bytes;
       }}};
  std::vector<float> samples;
  for (const float value : ball(2)) samples.push_back(std::floor(value * 10) + 60);
  std::vector<Bytes> results;
  for (const Case& c : kCases) {
    start("iso=50 inside=below",
          std::string(kBallCaps).replace(std::string(kBallCaps).find("F32LE"), 5, c.format));
    Bytes bytes;
    for (const float value : samples) {
      for (const std::uint8_t byte : c.made(value)) bytes.push_back(byte);
    }
    EXPECT_EQ(gst_harness_push(harness, bufferOf(bytes.data(), bytes.size(), 0)), GST_FLOW_OK) << error();
    results.push_back(packets().at(0).data);
    gst_harness_teardown(std::exchange(harness, nullptr));
    gst_object_unref(std::exchange(bus, nullptr));
  }
  Result<Encoder> encoder = Encoder::create(ballSettings());
  const Bytes wanted = encoder->encode(Volume::own(ballGrid(), samples), {0, 0, 1, 50})->data;
  for (const Bytes& result : results) EXPECT_EQ(result, wanted);
}

TEST_F(Encode, aFlushBeginsAGop) {
  start("");
  gst_harness_push(harness, ballBuffer(0));
  gst_harness_push(harness, ballBuffer(1));
  gst_harness_push_event(harness, gst_event_new_flush_start());
  gst_harness_push_event(harness, gst_event_new_flush_stop(TRUE));
  GstSegment segment;
  gst_segment_init(&segment, GST_FORMAT_TIME);
  gst_harness_push_event(harness, gst_event_new_segment(&segment));
  for (std::uint64_t i = 2; i < 7; ++i) gst_harness_push(harness, ballBuffer(i));
  std::string keys;
  for (const Got& one : packets()) keys += one.key ? 'I' : 'P';
  EXPECT_EQ(keys, "IPIPPPI");
}

TEST_F(Encode, saysWhatIsWrong) {
  const std::string caps(kBallCaps);
  struct Case {
    std::string properties, caps, error;
  };
  std::vector<float> samples = ball(0);
  const auto run = [&](const Case& c, std::size_t bytes) {
    start(c.properties, c.caps);
    gst_harness_push(harness, bufferOf(samples.data(), bytes, 0));
    const std::string text = error();
    EXPECT_NE(text.find(c.error), std::string::npos) << text;
    EXPECT_TRUE(packets().empty());
    gst_harness_teardown(std::exchange(harness, nullptr));
    gst_object_unref(std::exchange(bus, nullptr));
  };
  const std::size_t all = samples.size() * sizeof(float);
  run({"", caps, "volume 0: the buffer has 8784 bytes, and a volume of these caps 8788"}, all - 4);
  run({"", "application/x-volume, format=F32LE, width=13, height=13, depth=13, framerate=25/1",
       "iso: is required"},
      all);
  run({"iso=1,x", caps, "iso: '1,x' is not a list of numbers"}, all);
  run({"", caps.substr(0, caps.find(", framerate")), ""}, all);
  run({"", "application/x-volume, format=F32LE, width=13, height=13, depth=13, spacing=<1,2>",
       "caps: spacing"},
      all);
  run({"", "application/x-volume, format=F32LE, width=13, height=13, depth=13, spacing=<0,1,1>", "spacing"},
      all);
  samples[5] = std::numeric_limits<float>::quiet_NaN();
  run({"", caps, "volume 0: "}, all);
}

TEST(VolumeSource, withEncoderAndMuxGivesTheFileOfTheCommandLine) {
  const Folder folder;
  Bytes bytes;
  std::string names;
  for (std::uint64_t i = 0; i < 10; ++i) {
    const std::vector<float> samples = ball(i);
    const auto* raw = reinterpret_cast<const std::uint8_t*>(samples.data());
    write(folder / (std::to_string(i) + ".raw"), {raw, samples.size() * sizeof(float)});
    names += (i > 0 ? ",\"" : "\"") + std::to_string(i) + ".raw\"";
  }
  const std::string json =
      R"({"dims":[13,13,13],"dtype":"float32","spacing":[0.5,0.5,0.5],"files":[)" + names + "]}";
  write(folder / "steps.json", {reinterpret_cast<const std::uint8_t*>(json.data()), json.size()});
  for (const bool scan : {false, true}) {
    const std::string input = scan ? folder / "one.json" : folder / "steps.json";
    const std::string one = R"({"dims":[13,13,13],"dtype":"float32","files":["3.raw"]})";
    write(folder / "one.json", {reinterpret_cast<const std::uint8_t*>(one.data()), one.size()});
    const std::string iso = scan ? "-1,-0.5,0,1" : "0";
    const std::string command = ISOREEL_COMMAND " encode " + input + " --iso=" + iso +
                                " --inside below --step 1/32 --gop 3 --fps 30 --force --jobs 1 -o " +
                                (folder / "cli.isr") + " >" + (folder / "log");
    ASSERT_EQ(std::system(command.c_str()), 0);
    Pipeline pipeline(
        "isoreelvolumesrc fps=30/1 location=" + input + " iso=" + iso +
        " ! isoreelenc inside=below step=1/32 gop=3 ! isoreelmux name=mux ! filesink location=" +
        (folder / "gst.isr"));
    // What a command line knows and elements do not: where the volumes come from.
    gst_tag_setter_add_tags(GST_TAG_SETTER(pipeline["mux"]), GST_TAG_MERGE_APPEND, GST_TAG_EXTENDED_COMMENT,
                            scan ? "source=one.json" : "source=steps.json", nullptr);
    ASSERT_TRUE(pipeline.run()) << pipeline.error;
    EXPECT_EQ(content(folder / "gst.isr"), content(folder / "cli.isr"));
  }
}

TEST_F(Encode, presetFitAndSlicesAreThoseOfTheLibrary) {
  const auto run = [&](const std::string& properties) {
    start(properties);
    Bytes all;
    for (std::uint64_t i = 0; i < 4; ++i) gst_harness_push(harness, ballBuffer(i));
    for (const Got& one : packets()) all.insert(all.end(), one.data.begin(), one.data.end());
    gst_harness_teardown(std::exchange(harness, nullptr));
    gst_object_unref(std::exchange(bus, nullptr));
    return all;
  };
  const auto wanted = [](Preset preset, Fit fit, std::optional<std::uint32_t> block = {},
                         std::uint32_t slices = 1, double cell = 1) {
    EncoderSettings settings = ballSettings();
    usePreset(preset, settings);
    if (block) settings.motion.block_log2 = *block;
    settings.heights.fit = fit;
    settings.configuration.slices.most = slices;
    settings.cell = cell;
    Result<Encoder> encoder = Encoder::create(settings);
    Bytes all;
    for (std::uint64_t i = 0; i < 4; ++i) {
      const Bytes data =
          encoder->encode(Volume::own(ballGrid(), ball(i)), {i, static_cast<std::int64_t>(i), 1, 0})->data;
      all.insert(all.end(), data.begin(), data.end());
    }
    return all;
  };
  const Bytes plain = wanted(Preset::kDefault, Fit::kVolume), fast = wanted(Preset::kFast, Fit::kVolume);
  EXPECT_EQ(run("preset=default fit=volume"), plain);
  EXPECT_EQ(run("preset=fast"), fast);
  EXPECT_NE(fast, plain);
  EXPECT_EQ(run("preset=best"), wanted(Preset::kBest, Fit::kVolume));
  EXPECT_EQ(run("block=4 preset=fast"), wanted(Preset::kFast, Fit::kVolume, 2)) << "what is set counts";
  const Bytes to_mesh = wanted(Preset::kDefault, Fit::kExtracted);
  EXPECT_EQ(run("fit=extracted"), to_mesh);
  EXPECT_NE(to_mesh, plain);
  const Bytes slices = wanted(Preset::kDefault, Fit::kVolume, {}, 3);
  EXPECT_EQ(run("slices=3"), slices);
  EXPECT_NE(slices, plain);
  EXPECT_EQ(run("cell=1.5"), wanted(Preset::kDefault, Fit::kVolume, {}, 1, 1.5));
}

TEST(VolumeSource, saysWhatIsWrong) {
  Pipeline none("isoreelvolumesrc ! fakesink");
  EXPECT_FALSE(none.run());
  EXPECT_EQ(none.error, "location: is not set");
  Pipeline missing("isoreelvolumesrc location=/nowhere/x.vdb ! fakesink");
  EXPECT_FALSE(missing.run());
  EXPECT_NE(missing.error.find("/nowhere/x.vdb"), std::string::npos) << missing.error;
}

}  // namespace
}  // namespace isoreel::gst
