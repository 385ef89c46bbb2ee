// SPDX-License-Identifier: BSD-3-Clause
// A small sequence, files of it, and pipelines that run to their end.
#pragma once

#include <gst/gst.h>
#include <gtest/gtest.h>
#include <isoreel/codec/encoder.h>
#include <isoreel/container/reader.h>
#include <isoreel/container/writer.h>

#include <filesystem>
#include <string>
#include <vector>

namespace isoreel::gst {

/// A folder that goes with the test.
class Folder {
 public:
  Folder();
  ~Folder();
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

Bytes content(const std::string& path);
void write(const std::string& path, ByteSpan bytes);

/// Frame `i` of a ball that wanders: signed distances, in cells, on a grid of 13 nodes a side.
std::vector<float> ball(std::uint64_t i, double radius = 3);
Grid ballGrid();
/// What the tests encode with: level set, 25 frames a second, GOPs of four.
EncoderSettings ballSettings();
/// Packets of `frames` balls.
std::vector<Packet> ballPackets(std::uint64_t frames, double radius = 3);

/// What a file of these packets is written with.
WriterSettings ballWriter();

struct FileOptions {
  std::string tags = "{}";
  std::vector<Chapter> chapters{};
  std::int64_t first_time = 0;  // ticks
  unsigned tracks = 1;          // balls of radius 3, 2, ...
  bool finished = true;
};
/// The bytes of a file of balls.
Bytes ballFile(std::uint64_t frames, const FileOptions& options = {});

/// A pipeline as gst-launch has it.
class Pipeline {
 public:
  explicit Pipeline(const std::string& description);
  ~Pipeline();
  Pipeline(const Pipeline&) = delete;
  Pipeline& operator=(const Pipeline&) = delete;

  GstElement* operator->() const { return pipeline_; }
  GstElement* get() const { return pipeline_; }
  /// A reference that lives as long as the pipeline.
  GstElement* operator[](const char* name);

  /// Waits until the state is reached; false after an error, which is kept.
  bool reach(GstState state);
  /// Plays until the end (true) or an error.
  bool run();
  /// Waits for a message of this type; false for an error or after ten seconds.
  bool wait(GstMessageType type);
  bool seek(double rate, GstFormat format, int flags, gint64 start, gint64 stop = -1);

  std::string error;
  std::vector<std::string> warnings;
  GstTagList* tags = nullptr;
  GstToc* toc = nullptr;

 private:
  void look(GstMessage* message);
  GstElement* pipeline_ = nullptr;
  std::vector<GstElement*> elements_;
};

/// What a buffer of packets says.
struct Got {
  Bytes data;
  GstClockTime time = 0, duration = 0;
  guint64 offset = 0;
  bool key = false, hidden = false, jumps = false;
};
Got gotFrom(GstBuffer* buffer);
/// Takes all that comes out of an appsink until its end, or `most` of it.
std::vector<Got> drain(GstElement* appsink, std::size_t most = SIZE_MAX);
/// Offsets (frame numbers), those not to be shown in brackets: "(4)(5)6 7".
std::string numbers(const std::vector<Got>& got);

}  // namespace isoreel::gst
