// SPDX-License-Identifier: BSD-3-Clause
// Pipelines that show a sequence, and what they show.
#pragma once

#include <gst/gst.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

namespace isoreel::gst {

inline constexpr GstClockTime kPatience = 20 * GST_SECOND;

/// The ball (sequence.h) in an .isr file, while the tests run.
const std::string& ballFile();

/// A pipeline that a test owns.
class Pipeline {
 public:
  /// As gst-launch-1.0 takes it, with a sink of the name "shown".
  explicit Pipeline(const std::string& description);
  /// Takes both.
  Pipeline(GstElement* pipeline, GstElement* sink) : pipeline_(pipeline), sink_(sink) {}
  Pipeline(const Pipeline&) = delete;
  Pipeline& operator=(const Pipeline&) = delete;
  ~Pipeline();

  GstElement* get() const { return pipeline_; }
  testing::AssertionResult to(GstState state);
  bool settled();
  /// Flushes, and waits until the frame is there.
  bool seek(GstClockTime time);
  /// Numbers of all frames from now to the end, in order.
  std::vector<guint64> playToTheEnd();
  /// Frame and surface hash of the picture that the sink has.
  std::pair<guint64, guint64> shown() const;

 private:
  std::string message(GstMessageType types);

  GstElement* pipeline_ = nullptr;
  GstElement* sink_ = nullptr;
  std::vector<guint64> numbers_;
};

/// As gst-play-1.0 and other players do it: nothing but the file's name is given.
Pipeline player(const std::string& path);

/// Seeks to times of the ball in PAUSED; each time the frame of that time is shown, its surface the right
/// one.
void seekAtRandom(Pipeline& pipeline, int seeks);

std::vector<guint64> numbersFrom(guint64 first);

}  // namespace isoreel::gst
