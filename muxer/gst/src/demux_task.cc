// SPDX-License-Identifier: BSD-3-Clause
// The task of isoreeldemux: opens the file, sends packets, ends.
#include <isoreel/codec/configuration.h>

#include <algorithm>
#include <utility>

#include "demux_state.h"
#include "mesh.h"
#include "packet_caps.h"
#include "tags.h"

namespace isoreel::gst::demux {
namespace {

constexpr std::uint64_t kMostKept = 64u << 20;  // of a stream whose tracks are far apart, in bytes
constexpr std::size_t kMostWarnings = 20;
constexpr gint64 kGrowthPause = G_USEC_PER_SEC / 5;  // between looks at a file that grows

}  // namespace

State::State(Element* of, GstPad* pad) : element(of), sink(pad), feed(pad), flows(gst_flow_combiner_new()) {
  g_rec_mutex_init(&task_lock);
  const auto run = [](gpointer state) { static_cast<State*>(state)->work(); };
  task = gst_task_new(run, this, nullptr);
  gst_task_set_lock(task, &task_lock);
  gst_segment_init(&segment, GST_FORMAT_TIME);
}

State::~State() {
  gst_object_unref(task);
  gst_flow_combiner_free(flows);
  g_rec_mutex_clear(&task_lock);
}

void State::halt(bool flush) {
  halted = true;
  if (flush) {
    pushToAll(gst_event_new_flush_start());
    if (pulls) gst_pad_push_event(sink, gst_event_new_flush_start());
  }
  feed.interrupt(true);
  gst_task_pause(task);
  g_rec_mutex_lock(&task_lock);
}

void State::resume() {
  feed.interrupt(false);
  halted = !active;
  if (active) gst_task_start(task);
  g_rec_mutex_unlock(&task_lock);
}

void State::pushToAll(GstEvent* event) {
  GST_OBJECT_LOCK(element);
  std::vector<GstPad*> pads;
  for (GList* at = GST_ELEMENT(element)->srcpads; at != nullptr; at = at->next)
    pads.push_back(static_cast<GstPad*>(gst_object_ref(at->data)));
  GST_OBJECT_UNLOCK(element);
  for (GstPad* pad : pads) {
    gst_pad_push_event(pad, gst_event_ref(event));
    gst_object_unref(pad);
  }
  gst_event_unref(event);
}

void State::close() {
  for (const auto& stream : streams) {
    if (stream->pad == nullptr) continue;
    gst_flow_combiner_remove_pad(flows, stream->pad);
    gst_pad_set_active(stream->pad, FALSE);
    gst_element_remove_pad(GST_ELEMENT(element), stream->pad);
  }
  streams.clear();
  gst_segment_init(&segment, GST_FORMAT_TIME);
  seqnum = GST_SEQNUM_INVALID;
  opened = announced = restart = keys_only = false;
  segment_due = true;
  damaged = 0;
  const std::lock_guard lock(facts_lock);
  facts = {};
}

Status State::open() {
  bool seekable = false;
  if (pulls) {
    seekable = pullSource(sink)->seekable();
  } else {
    ISOREEL_ASSIGN(seekable, feed.begin());
  }
  const auto source = [&] { return pulls ? pullSource(sink) : feed.source(); };
  if (seekable) {
    ISOREEL_ASSIGN(streams, openTracks(source));
  } else {
    ISOREEL_ASSIGN(streams, openStream(source));
    feed.release();
  }
  setTimes(streams);
  std::size_t told = 0;
  for (const std::string& line : streams.front()->info().damage) {
    if (++told > kMostWarnings) break;
    postWarning(GST_ELEMENT(element), Status(ErrorCode::kBadData, line));
  }
  setFacts(seekable);
  GstClockTime first = GST_CLOCK_TIME_NONE;
  for (const auto& stream : streams) {
    if (stream->timeline.frames() > 0) first = std::min(first, stream->timeline.start(0));
    if (stream->pending && stream->pending->header.time + stream->shift >= 0)
      first = std::min(first, toClockTime(stream->pending->header.time + stream->shift, stream->base));
  }
  if (first == GST_CLOCK_TIME_NONE) first = 0;
  segment.start = segment.position = segment.time = first;
  if (seekable) {
    segment.duration = facts.end;
    playSegment();
  }
  return addPads();
}

void State::setFacts(bool seekable) {
  Facts now;
  now.seekable = seekable;
  now.timeline = streams.front()->timeline;
  for (const auto& stream : streams) now.end = std::max(now.end, stream->timeline.end());
  now.segment = segment;
  const std::lock_guard lock(facts_lock);
  facts = std::move(now);
}

Status State::addPads() {
  guint group = gst_util_group_id_next();
  if (GstEvent* start = gst_pad_get_sticky_event(sink, GST_EVENT_STREAM_START, 0)) {
    gst_event_parse_group_id(start, &group);
    gst_event_unref(start);
  }
  for (std::size_t i = 0; i < streams.size(); ++i) {
    DemuxStream& stream = *streams[i];
    ISOREEL_ASSIGN(const Bytes record, configurationOf(stream));
    ISOREEL_ASSIGN(const Configuration configuration, readConfiguration(record));
    const std::string name = "src_" + std::to_string(i);
    GstPad* pad = newPad(element, "src_%u", name.c_str());
    gst_pad_set_event_function(pad, sourceEvent);
    gst_pad_set_query_function(pad, sourceQuery);
    gst_pad_use_fixed_caps(pad);
    gst_pad_set_active(pad, TRUE);
    gchar* id = gst_pad_create_stream_id_printf(pad, GST_ELEMENT(element), "%03u", static_cast<guint>(i));
    GstEvent* start = gst_event_new_stream_start(id);
    g_free(id);
    gst_event_set_group_id(start, group);
    gst_pad_push_event(pad, start);
    GstCaps* caps = packetCaps(configuration, record, stream.base, stream.timeline.frame());
    inspect::Box box;
    for (std::uint64_t frame = 0; stream.reader && frame < stream.reader->frameCount(); ++frame)
      box.join(inspect::boundingBox(stream.reader->header(frame), configuration.grid));
    setBoundingBox(caps, box);
    gst_pad_set_caps(pad, caps);
    gst_caps_unref(caps);
    stream.pad = pad;
    gst_flow_combiner_add_pad(flows, pad);
    gst_element_add_pad(GST_ELEMENT(element), pad);
  }
  gst_element_no_more_pads(GST_ELEMENT(element));
  return {};
}

void State::sendSegment() {
  GstEvent* event = gst_event_new_segment(&segment);
  if (seqnum == GST_SEQNUM_INVALID) seqnum = gst_util_seqnum_next();
  gst_event_set_seqnum(event, seqnum);
  pushToAll(event);
  const std::lock_guard lock(facts_lock);
  facts.segment = segment;
}

// Tags and chapters, once.
void State::announce() {
  const FileInfo& info = streams.front()->info();
  GstTagList* tags = tagListOf(info.tags);
  gst_tag_list_add(tags, GST_TAG_MERGE_REPLACE, GST_TAG_CONTAINER_FORMAT, "Isoreel", nullptr);
  pushToAll(gst_event_new_tag(tags));
  for (const auto& stream : streams) {
    GstTagList* own = gst_tag_list_new(GST_TAG_VIDEO_CODEC, "Isoreel", nullptr);
    const std::string& name = stream->info().track_name;
    if (!name.empty() && g_utf8_validate(name.c_str(), -1, nullptr))
      gst_tag_list_add(own, GST_TAG_MERGE_REPLACE, GST_TAG_TITLE, name.c_str(), nullptr);
    gst_pad_push_event(stream->pad, gst_event_new_tag(own));
  }
  const DemuxStream& first = *streams.front();
  const TimeBase base = info.tracks.empty() ? first.base : info.tracks.front().time_base;
  if (GstToc* toc = tocOf(info.chapters, base, first.shift)) {
    pushToAll(gst_event_new_toc(toc, FALSE));
    gst_toc_unref(toc);
  }
}

// Of streams that are read once, the next packet of each has to be known, so that they come in the order of
// their times; where that would keep too much, the one that has least goes first.
DemuxStream* State::nextStream(Status& status) {
  DemuxStream* chosen = nullptr;
  const bool backward = segment.rate < 0;
  for (const auto& stream : streams) {
    if (stream->stream && !stream->pending && !stream->ended &&
        (feed.kept() < kMostKept || chosen == nullptr)) {
      Result<std::optional<Packet>> packet = stream->stream->next();
      if (!packet && packet.error().code == ErrorCode::kTruncated && !halted) {
        postWarning(GST_ELEMENT(element), packet.status());
        packet = std::optional<Packet>();
      }
      if (!packet) {
        status = packet.status();
        return nullptr;
      }
      stream->pending = *std::move(packet);
      stream->ended = !stream->pending.has_value();
    }
    const FrameHeader* header = stream->next();
    if (header == nullptr) {
      if (stream->eos_sent || (segment.flags & GST_SEGMENT_FLAG_SEGMENT) != 0 || follow) continue;
      stream->eos_sent = true;
      GstEvent* eos = gst_event_new_eos();
      gst_event_set_seqnum(eos, seqnum);
      gst_pad_push_event(stream->pad, eos);
      continue;
    }
    const auto key = [&](DemuxStream& s) { return s.base.seconds(s.next()->time + s.shift); };
    if (chosen == nullptr || (backward ? key(*stream) > key(*chosen) : key(*stream) < key(*chosen)))
      chosen = stream.get();
  }
  return chosen;
}

GstFlowReturn State::send(DemuxStream& stream) {
  Result<GstBuffer*> buffer = stream.take();
  if (!buffer) {
    if (halted) return GST_FLOW_FLUSHING;
    if (buffer.error().code == ErrorCode::kIo) {
      postError(GST_ELEMENT(element), buffer.status());
      return GST_FLOW_ERROR;
    }
    if (++damaged <= kMostWarnings) postWarning(GST_ELEMENT(element), buffer.status());
    stream.cursor->skipToKey();
    return GST_FLOW_OK;
  }
  if (GST_BUFFER_PTS_IS_VALID(*buffer) && !GST_BUFFER_FLAG_IS_SET(*buffer, GST_BUFFER_FLAG_DECODE_ONLY)) {
    segment.position = GST_BUFFER_PTS(*buffer);
    const std::lock_guard lock(facts_lock);
    facts.segment.position = segment.position;
  }
  return gst_flow_combiner_update_pad_flow(flows, stream.pad, gst_pad_push(stream.pad, *buffer));
}

// Looks whether a file that was still being written has more by now. Waits for it; false when it never will.
bool State::grow() {
  if (!pulls || !follow || segment.rate < 0 || streams.empty() || !streams.front()->reader) return false;
  if (streams.front()->info().indexed || segment.stop != GST_CLOCK_TIME_NONE) return false;
  const std::uint64_t size = streams.front()->info().bytes;
  gint64 pause = kGrowthPause;
  while (!halted) {
    g_usleep(static_cast<gulong>(kGrowthPause));
    pause -= kGrowthPause;
    if (pause > 0 || pullSource(sink)->size().value_or(0) <= size) continue;
    const gint64 started = g_get_monotonic_time();
    auto fresh = openTracks([&] { return pullSource(sink); });
    if (!fresh || fresh->size() < streams.size()) return false;
    setTimes(*fresh);
    bool more = (*fresh)[0]->info().indexed;
    for (std::size_t i = 0; i < streams.size(); ++i) {
      DemuxStream &old = *streams[i], &now = *(*fresh)[i];
      more = more || now.timeline.frames() > old.timeline.frames();
      old.reader = std::move(now.reader);
      old.timeline = std::move(now.timeline);
      old.cursor->extend(*old.reader, old.timeline.frames());
    }
    setFacts(true);
    segment.duration = facts.end;
    if (more) {
      gst_element_post_message(GST_ELEMENT(element), gst_message_new_duration_changed(GST_OBJECT(element)));
      return true;
    }
    pause = 4 * (g_get_monotonic_time() - started);  // a long file is looked through less often
  }
  return true;
}

void State::finish() {
  if ((segment.flags & GST_SEGMENT_FLAG_SEGMENT) != 0) {
    const bool backward = segment.rate < 0;
    const GstClockTime stop = segment.stop != GST_CLOCK_TIME_NONE ? segment.stop : facts.end;
    segment.position = backward ? segment.start : stop;
    const auto at = static_cast<gint64>(segment.position);
    GstMessage* message = gst_message_new_segment_done(GST_OBJECT(element), GST_FORMAT_TIME, at);
    gst_message_set_seqnum(message, seqnum);
    gst_element_post_message(GST_ELEMENT(element), message);
    GstEvent* event = gst_event_new_segment_done(GST_FORMAT_TIME, at);
    gst_event_set_seqnum(event, seqnum);
    pushToAll(event);
  } else {
    for (const auto& stream : streams) {
      if (std::exchange(stream->eos_sent, true)) continue;
      GstEvent* event = gst_event_new_eos();
      gst_event_set_seqnum(event, seqnum);
      gst_pad_push_event(stream->pad, event);
    }
  }
  gst_task_pause(task);
}

void State::stopWith(GstFlowReturn flow) {
  gst_task_pause(task);
  if (flow == GST_FLOW_FLUSHING || halted) return;
  if (flow == GST_FLOW_EOS) {
    finish();
    return;
  }
  if (flow == GST_FLOW_NOT_LINKED || flow < GST_FLOW_EOS) {
    GST_ELEMENT_FLOW_ERROR(element, flow);
  }
  pushToAll(gst_event_new_eos());
}

void State::work() {
  if (halted) {
    gst_task_pause(task);
    return;
  }
  if (restart) close();
  Status status;
  if (!opened) {
    status = open();
    opened = status.ok();
  }
  if (status.ok() && std::exchange(segment_due, false)) {
    sendSegment();
    if (!std::exchange(announced, true)) announce();
  }
  DemuxStream* stream = status.ok() ? nextStream(status) : nullptr;
  if (!status.ok()) {
    gst_task_pause(task);
    if (halted) return;
    postError(GST_ELEMENT(element), status);
    pushToAll(gst_event_new_eos());
    return;
  }
  if (stream == nullptr) {
    if (!grow() && !halted) finish();
    return;
  }
  const GstFlowReturn flow = send(*stream);
  if (flow != GST_FLOW_OK) stopWith(flow);
}

}  // namespace isoreel::gst::demux
