// SPDX-License-Identifier: BSD-3-Clause
// isoreeldemux from within: what its files share.
#pragma once

#include <gst/base/gstflowcombiner.h>

#include <atomic>
#include <mutex>
#include <vector>

#include "demux_stream.h"
#include "pad_source.h"

namespace isoreel::gst::demux {

struct Element;

/// A task of our own reads and sends, whether upstream is pulled from or pushes. It holds `task_lock` while
/// it does, and who wants to change what it works on (a seek) first stops it by halt().
struct State {
  explicit State(Element* of, GstPad* pad);
  ~State();
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  Element* element;
  GstPad* sink;
  GstTask* task;
  GRecMutex task_lock{};
  PushFeed feed;
  std::atomic<bool> halted{false};  // the task is to stop: failing flows are no errors then
  std::atomic<bool> active{false};  // the sink pad is
  std::atomic<bool> follow{false};  // property
  bool pulls = false;

  // Under task_lock.
  std::vector<std::unique_ptr<DemuxStream>> streams;
  GstFlowCombiner* flows;
  GstSegment segment;
  guint32 seqnum = GST_SEQNUM_INVALID;  // of the seek that the segment comes from
  bool opened = false;
  bool announced = false;  // tags and chapters
  bool segment_due = true;
  bool keys_only = false;
  bool restart = false;  // upstream begins anew
  std::uint64_t damaged = 0;

  // Under `facts_lock`: for queries, which come at any time.
  std::mutex facts_lock;
  struct Facts {
    bool seekable = false;
    Timeline timeline;     // of the first track
    GstClockTime end = 0;  // of all
    GstSegment segment{};
  } facts;

  // demux_task.cc
  /// Opens, or sends one packet.
  void work();
  /// Forgets file and pads.
  void close();
  void halt(bool flush);
  void resume();

  // demux_seek.cc
  bool seek(GstEvent* event);
  bool query(GstPad* pad, GstQuery* query);
  /// Lets all streams play what the segment asks for.
  void playSegment();

 private:
  Status open();
  Status addPads();
  void announce();
  void sendSegment();
  bool grow();
  void finish();
  DemuxStream* nextStream(Status& status);
  GstFlowReturn send(DemuxStream& stream);
  void setFacts(bool seekable);
  void stopWith(GstFlowReturn flow);
  void pushToAll(GstEvent* event);
};

struct Element {
  GstElement parent;
  GstPad* sink;
  State* state;
};
struct ElementClass {
  GstElementClass parent;
};

inline Element* self(gpointer element) { return static_cast<Element*>(element); }

gboolean sourceQuery(GstPad* pad, GstObject* parent, GstQuery* query);
gboolean sourceEvent(GstPad* pad, GstObject* parent, GstEvent* event);

}  // namespace isoreel::gst::demux
