// SPDX-License-Identifier: BSD-3-Clause
// Seeks and queries of isoreeldemux.
#include <algorithm>

#include "demux_state.h"

namespace isoreel::gst::demux {
namespace {

// A place in frames as a time; what is no place (-1) stays as it is.
gint64 toTime(const Timeline& timeline, gint64 frame) {
  return frame < 0 ? frame : static_cast<gint64>(timeline.start(static_cast<std::uint64_t>(frame)));
}

gint64 toFrame(const Timeline& timeline, gint64 time) {
  if (time < 0) return time;
  const auto at = static_cast<GstClockTime>(time);
  return static_cast<gint64>(at >= timeline.end() ? timeline.frames() : timeline.frameAt(at));
}

bool knownFormat(GstFormat format) { return format == GST_FORMAT_TIME || format == GST_FORMAT_DEFAULT; }

bool convert(const Timeline& timeline, GstFormat from, gint64 given, GstFormat to, gint64& result) {
  if (!knownFormat(from) || !knownFormat(to) || (from != to && timeline.frames() == 0)) return false;
  result = from == to                   ? given
           : from == GST_FORMAT_DEFAULT ? toTime(timeline, given)
                                        : toFrame(timeline, given);
  return true;
}

}  // namespace

void State::playSegment() {
  const bool backward = segment.rate < 0;
  for (const auto& stream : streams) {
    const Timeline& timeline = stream->timeline;
    const GstClockTime from = backward ? segment.start : segment.position;
    const GstClockTime to = backward ? segment.position : segment.stop;
    const std::uint64_t end = to == GST_CLOCK_TIME_NONE ? timeline.frames() : timeline.frameFrom(to);
    stream->play(timeline.frameAt(from), end, backward, keys_only);
  }
}

bool State::seek(GstEvent* event) {
  gdouble rate = 1;
  GstFormat format = GST_FORMAT_UNDEFINED;
  GstSeekFlags flags = GST_SEEK_FLAG_NONE;
  GstSeekType start_type = GST_SEEK_TYPE_NONE, stop_type = GST_SEEK_TYPE_NONE;
  gint64 start = 0, stop = 0;
  gst_event_parse_seek(event, &rate, &format, &flags, &start_type, &start, &stop_type, &stop);
  {
    const std::lock_guard lock(facts_lock);
    if (!facts.seekable || !knownFormat(format) || (flags & GST_SEEK_FLAG_INSTANT_RATE_CHANGE) != 0)
      return false;
    // From the end, frames count backward.
    const auto in_time = [&](GstSeekType type, gint64 place) {
      const auto frames = static_cast<gint64>(facts.timeline.frames());
      if (format == GST_FORMAT_TIME || type == GST_SEEK_TYPE_NONE) return place;
      if (type == GST_SEEK_TYPE_SET) return toTime(facts.timeline, place);
      return toTime(facts.timeline, std::clamp<gint64>(frames + place, 0, frames)) -
             static_cast<gint64>(facts.end);
    };
    start = in_time(start_type, start);
    stop = in_time(stop_type, stop);
  }
  const bool flush = (flags & GST_SEEK_FLAG_FLUSH) != 0;
  const guint32 number = gst_event_get_seqnum(event);
  halt(flush);
  GstSegment wanted = segment;
  bool done = opened && gst_segment_do_seek(&wanted, rate, GST_FORMAT_TIME, flags, start_type,
                                            static_cast<guint64>(start), stop_type,
                                            static_cast<guint64>(stop), nullptr);
  if (done) {
    const Timeline& timeline = streams.front()->timeline;
    const std::uint64_t frame = rate > 0 ? timeline.snapped(wanted.position, flags) : timeline.frames();
    if (frame < timeline.frames()) wanted.start = wanted.position = wanted.time = timeline.start(frame);
    segment = wanted;
    seqnum = number;
    keys_only = (flags & GST_SEEK_FLAG_TRICKMODE_KEY_UNITS) != 0;
    segment_due = true;
    playSegment();
  }
  if (flush) {
    if (pulls) gst_pad_push_event(sink, gst_event_new_flush_stop(TRUE));
    GstEvent* end = gst_event_new_flush_stop(TRUE);
    gst_event_set_seqnum(end, number);
    pushToAll(end);
    gst_flow_combiner_reset(flows);
  }
  if (done && (flags & GST_SEEK_FLAG_SEGMENT) != 0) {
    GstMessage* message = gst_message_new_segment_start(GST_OBJECT(element), GST_FORMAT_TIME,
                                                        static_cast<gint64>(segment.position));
    gst_message_set_seqnum(message, number);
    gst_element_post_message(GST_ELEMENT(element), message);
  }
  resume();
  return done;
}

bool State::query(GstPad* pad, GstQuery* query) {
  const std::lock_guard lock(facts_lock);
  GstFormat format = GST_FORMAT_UNDEFINED;
  gint64 value = 0;
  switch (GST_QUERY_TYPE(query)) {
    case GST_QUERY_POSITION: {
      gst_query_parse_position(query, &format, nullptr);
      if (facts.segment.format != GST_FORMAT_TIME) return false;
      const auto at = static_cast<gint64>(
          gst_segment_to_stream_time(&facts.segment, GST_FORMAT_TIME, facts.segment.position));
      if (!convert(facts.timeline, GST_FORMAT_TIME, at, format, value)) return false;
      gst_query_set_position(query, format, value);
      return true;
    }
    case GST_QUERY_DURATION:
      gst_query_parse_duration(query, &format, nullptr);
      if (!facts.seekable || !knownFormat(format)) return false;
      value = static_cast<gint64>(format == GST_FORMAT_TIME ? facts.end : facts.timeline.frames());
      gst_query_set_duration(query, format, value);
      return true;
    case GST_QUERY_SEEKING:
      gst_query_parse_seeking(query, &format, nullptr, nullptr, nullptr);
      if (!knownFormat(format)) return false;
      value = static_cast<gint64>(format == GST_FORMAT_TIME ? facts.end : facts.timeline.frames());
      gst_query_set_seeking(query, format, facts.seekable, 0, facts.seekable ? value : -1);
      return true;
    case GST_QUERY_CONVERT: {
      GstFormat to = GST_FORMAT_UNDEFINED;
      gint64 given = 0;
      gst_query_parse_convert(query, &format, &given, &to, nullptr);
      if (facts.timeline.frames() == 0 || !convert(facts.timeline, format, given, to, value)) return false;
      gst_query_set_convert(query, format, given, to, value);
      return true;
    }
    case GST_QUERY_SEGMENT: {
      const GstSegment& now = facts.segment;
      const auto stop = now.stop != GST_CLOCK_TIME_NONE ? now.stop : facts.end;
      gst_query_set_segment(query, now.rate, GST_FORMAT_TIME, static_cast<gint64>(now.start),
                            static_cast<gint64>(stop));
      return true;
    }
    case GST_QUERY_FORMATS:
      gst_query_set_formats(query, 2, GST_FORMAT_TIME, GST_FORMAT_DEFAULT);
      return true;
    default:
      return gst_pad_query_default(pad, GST_OBJECT(element), query) != FALSE;
  }
}

}  // namespace isoreel::gst::demux
