// SPDX-License-Identifier: BSD-3-Clause
#include "support.h"

#include <gst/app/gstappsink.h>

#include <cmath>
#include <fstream>
#include <iterator>

namespace isoreel::gst {

Folder::Folder() {
  std::string name = (std::filesystem::temp_directory_path() / "isoreel-gst-XXXXXX").string();
  if (mkdtemp(name.data()) != nullptr) path_ = name;
}
Folder::~Folder() { std::filesystem::remove_all(path_); }

Bytes content(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

void write(const std::string& path, ByteSpan bytes) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

Grid ballGrid() {
  Grid grid;
  grid.nodes = {13, 13, 13};
  grid.spacing = {0.5, 0.5, 0.5};
  grid.origin = {-1, 0, 2};
  return grid;
}

std::vector<float> ball(std::uint64_t i, double radius) {
  const Grid grid = ballGrid();
  std::vector<float> samples;
  for (std::uint32_t z = 0; z < grid.nodes[2]; ++z) {
    for (std::uint32_t y = 0; y < grid.nodes[1]; ++y) {
      for (std::uint32_t x = 0; x < grid.nodes[0]; ++x) {
        const double dx = x - 5.0 - 0.1 * static_cast<double>(i);
        samples.push_back(static_cast<float>(std::hypot(dx, y - 6.0, z - 6.2) - radius));
      }
    }
  }
  return samples;
}

EncoderSettings ballSettings() {
  EncoderSettings settings;
  settings.configuration.grid = ballGrid();
  settings.configuration.inside = Inside::kBelow;
  settings.configuration.time_base = {1, 25};
  settings.frame_types = FrameTypes::kAuto;
  settings.gop = 4;
  return settings;
}

std::vector<Packet> ballPackets(std::uint64_t frames, double radius) {
  std::vector<Packet> packets;
  Result<Encoder> encoder = Encoder::create(ballSettings());
  for (std::uint64_t i = 0; i < frames; ++i) {
    if (i % 4 == 0) encoder = Encoder::create(ballSettings());
    Result<Packet> packet =
        encoder->encode(Volume::own(ballGrid(), ball(i, radius)), {i, static_cast<std::int64_t>(i), 1, 0});
    EXPECT_TRUE(packet.ok()) << packet.status().message();
    packets.push_back(*std::move(packet));
  }
  return packets;
}

WriterSettings ballWriter() {
  WriterSettings settings;
  settings.time_base = {1, 25};
  settings.configuration = Encoder::create(ballSettings())->configurationRecord();
  return settings;
}

Bytes ballFile(std::uint64_t frames, const FileOptions& options) {
  Bytes bytes;
  WriterSettings settings = ballWriter();
  settings.tags = options.tags;
  if (options.tracks > 1) settings.track_name = "ball 0";
  auto writer = Writer::create(openMemorySink(bytes), settings);
  EXPECT_TRUE(writer.ok());
  for (unsigned i = 1; i < options.tracks; ++i)
    EXPECT_TRUE((*writer)->addTrack({{1, 25}, "ball " + std::to_string(i), settings.configuration}).ok());
  EXPECT_TRUE((*writer)->setChapters(options.chapters).ok());
  std::vector<std::vector<Packet>> tracks;
  for (unsigned t = 0; t < options.tracks; ++t) tracks.push_back(ballPackets(frames, 3 - 0.5 * t));
  for (std::uint64_t i = 0; i < frames; ++i) {
    for (unsigned t = 0; t < options.tracks; ++t) {
      Packet packet = tracks[t][i];
      packet.header.time += options.first_time;
      EXPECT_TRUE((*writer)->write(packet, t).ok());
    }
  }
  EXPECT_TRUE(!options.finished || (*writer)->finish().ok());
  return bytes;
}

Pipeline::Pipeline(const std::string& description) {
  GError* failed = nullptr;
  pipeline_ = gst_parse_launch(description.c_str(), &failed);
  EXPECT_EQ(failed, nullptr) << failed->message;
  g_clear_error(&failed);
}

Pipeline::~Pipeline() {
  gst_element_set_state(pipeline_, GST_STATE_NULL);
  for (GstElement* element : elements_) gst_object_unref(element);
  gst_clear_tag_list(&tags);
  if (toc != nullptr) gst_toc_unref(toc);
  gst_object_unref(pipeline_);
}

GstElement* Pipeline::operator[](const char* name) {
  elements_.push_back(gst_bin_get_by_name(GST_BIN(pipeline_), name));
  return elements_.back();
}

void Pipeline::look(GstMessage* message) {
  GError* what = nullptr;
  switch (GST_MESSAGE_TYPE(message)) {
    case GST_MESSAGE_ERROR:
      gst_message_parse_error(message, &what, nullptr);
      if (error.empty()) error = what->message;
      break;
    case GST_MESSAGE_WARNING:
      gst_message_parse_warning(message, &what, nullptr);
      warnings.emplace_back(what->message);
      break;
    case GST_MESSAGE_TAG: {
      GstTagList *more = nullptr, *all = nullptr;
      gst_message_parse_tag(message, &more);
      all = gst_tag_list_merge(tags, more, GST_TAG_MERGE_KEEP);
      gst_tag_list_unref(more);
      gst_clear_tag_list(&tags);
      tags = all;
      break;
    }
    case GST_MESSAGE_TOC:
      if (toc == nullptr) gst_message_parse_toc(message, &toc, nullptr);
      break;
    default:
      break;
  }
  g_clear_error(&what);
}

bool Pipeline::wait(GstMessageType type) {
  GstBus* bus = gst_element_get_bus(pipeline_);
  const gint64 until = g_get_monotonic_time() + 60 * G_USEC_PER_SEC;
  bool found = false;
  while (!found && error.empty() && g_get_monotonic_time() < until) {
    GstMessage* message = gst_bus_timed_pop(bus, 100 * GST_MSECOND);
    if (message == nullptr) continue;
    look(message);
    found = GST_MESSAGE_TYPE(message) == type;
    gst_message_unref(message);
  }
  gst_object_unref(bus);
  return found && (error.empty() || type == GST_MESSAGE_ERROR);
}

bool Pipeline::reach(GstState state) {
  switch (gst_element_set_state(pipeline_, state)) {
    case GST_STATE_CHANGE_SUCCESS:
    case GST_STATE_CHANGE_NO_PREROLL:
      return true;
    case GST_STATE_CHANGE_ASYNC:
      return wait(GST_MESSAGE_ASYNC_DONE);
    case GST_STATE_CHANGE_FAILURE:
      wait(GST_MESSAGE_ERROR);
      return false;
  }
  return false;
}

bool Pipeline::run() {
  if (gst_element_set_state(pipeline_, GST_STATE_PLAYING) == GST_STATE_CHANGE_FAILURE) {
    wait(GST_MESSAGE_ERROR);
    return false;
  }
  return wait(GST_MESSAGE_EOS);
}

bool Pipeline::seek(double rate, GstFormat format, int flags, gint64 start, gint64 stop) {
  return gst_element_seek(pipeline_, rate, format, static_cast<GstSeekFlags>(flags), GST_SEEK_TYPE_SET, start,
                          GST_SEEK_TYPE_SET, stop) != FALSE;
}

Got gotFrom(GstBuffer* buffer) {
  Got got;
  got.data.resize(gst_buffer_get_size(buffer));
  gst_buffer_extract(buffer, 0, got.data.data(), got.data.size());
  got.time = GST_BUFFER_PTS(buffer);
  got.duration = GST_BUFFER_DURATION(buffer);
  got.offset = GST_BUFFER_OFFSET(buffer);
  got.key = !GST_BUFFER_FLAG_IS_SET(buffer, GST_BUFFER_FLAG_DELTA_UNIT);
  got.hidden = GST_BUFFER_FLAG_IS_SET(buffer, GST_BUFFER_FLAG_DECODE_ONLY);
  got.jumps = GST_BUFFER_IS_DISCONT(buffer);
  return got;
}

std::vector<Got> drain(GstElement* appsink, std::size_t most) {
  std::vector<Got> all;
  while (all.size() < most) {
    GstSample* sample = gst_app_sink_try_pull_sample(GST_APP_SINK(appsink), 60 * GST_SECOND);
    if (sample == nullptr) break;
    all.push_back(gotFrom(gst_sample_get_buffer(sample)));
    gst_sample_unref(sample);
  }
  return all;
}

std::string numbers(const std::vector<Got>& got) {
  std::string text;
  for (const Got& one : got) {
    const std::string number = std::to_string(one.offset);
    if (!one.hidden && !text.empty() && text.back() != '(') text += ' ';
    text += one.hidden ? "(" + number + ")" : number;
  }
  return text;
}

}  // namespace isoreel::gst
