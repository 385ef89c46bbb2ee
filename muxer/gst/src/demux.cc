// SPDX-License-Identifier: BSD-3-Clause
/**
 * SECTION:element-isoreeldemux
 *
 * Reads an `.isr` file: a pad for each track, packets as they are in the file. A file that is finished, cut,
 * damaged or still being written (`.part`) plays; what had to be left out is told by warnings, with the text
 * of `isoreel info`.
 *
 * Times are the file's. Seeks go by time or by frame (GST_FORMAT_DEFAULT), with all flags: KEY_UNIT and
 * SNAP_* land on keys; otherwise packets from the key on come first, marked DECODE_ONLY, and the
 * segment starts where it was asked to. TRICKMODE_KEY_UNITS sends keys only; a rate below 0 sends GOPs last
 * to first; SEGMENT ends with SEGMENT_DONE. Where upstream neither can be pulled from nor seeks by bytes (a
 * pipe), the file plays front to back.
 *
 * Tags: those that GStreamer has names for, others as extended-comment, and all together as JSON in
 * isoreel-tags. Chapters are a table of contents. Attachments stay in the file.
 *
 * ## Example
 * |[
 * gst-launch-1.0 filesrc location=splash.isr ! isoreeldemux ! isoreelmux ! filesink location=copy.isr
 * gst-launch-1.0 filesrc location=run.isr.part ! isoreeldemux follow=true ! fakesink silent=false -v
 * ]|
 */
#include "demux.h"

#include <cstring>

#include "demux_state.h"

namespace isoreel::gst {
namespace demux {

gboolean sourceQuery(GstPad* pad, GstObject* parent, GstQuery* query) {
  return self(parent)->state->query(pad, query);
}

gboolean sourceEvent(GstPad* pad, GstObject* parent, GstEvent* event) {
  if (GST_EVENT_TYPE(event) == GST_EVENT_SEEK) {
    const bool done = self(parent)->state->seek(event);
    gst_event_unref(event);
    return done;
  }
  if (GST_EVENT_TYPE(event) == GST_EVENT_QOS || GST_EVENT_TYPE(event) == GST_EVENT_NAVIGATION) {
    gst_event_unref(event);
    return FALSE;  // nothing here could go faster, or move
  }
  return gst_pad_event_default(pad, parent, event);
}

namespace {

GstFlowReturn chain(GstPad*, GstObject* parent, GstBuffer* buffer) {
  const GstFlowReturn flow = self(parent)->state->feed.take(buffer);
  gst_buffer_unref(buffer);
  return flow;
}

// Upstream begins anew, and so do we: what was made of the bytes before is of no use. The task stops before
// pads take buffers again.
gboolean beginAnew(State& state, GstPad* pad, GstObject* parent, GstEvent* flush_stop) {
  state.halt(false);
  state.restart = true;
  state.feed.reset();
  const gboolean done = gst_pad_event_default(pad, parent, flush_stop);
  state.resume();
  return done;
}

gboolean sinkEvent(GstPad* pad, GstObject* parent, GstEvent* event) {
  State& state = *self(parent)->state;
  const bool own = state.feed.ownSeek(event);
  switch (GST_EVENT_TYPE(event)) {
    case GST_EVENT_FLUSH_START:
      state.feed.flushStart();
      if (!own) return gst_pad_event_default(pad, parent, event);
      break;
    case GST_EVENT_FLUSH_STOP:
      if (!own) return beginAnew(state, pad, parent, event);
      state.feed.flushStop();
      break;
    case GST_EVENT_SEGMENT: {
      const GstSegment* segment = nullptr;
      gst_event_parse_segment(event, &segment);
      state.feed.takeSegment(*segment);
      break;
    }
    case GST_EVENT_EOS:
      state.feed.takeEos();
      break;
    default:
      break;  // what upstream says of itself (its caps, its tags) is not about packets
  }
  gst_event_unref(event);
  return TRUE;
}

gboolean activate(GstPad* pad, GstObject*) {
  GstQuery* query = gst_query_new_scheduling();
  const bool pull =
      gst_pad_peer_query(pad, query) &&
      gst_query_has_scheduling_mode_with_flags(query, GST_PAD_MODE_PULL, GST_SCHEDULING_FLAG_SEEKABLE);
  gst_query_unref(query);
  return gst_pad_activate_mode(pad, pull ? GST_PAD_MODE_PULL : GST_PAD_MODE_PUSH, TRUE);
}

gboolean activateMode(GstPad*, GstObject* parent, GstPadMode mode, gboolean active) {
  State& state = *self(parent)->state;
  state.active = active != FALSE;
  state.halted = !active;
  state.feed.stop(!active);
  if (active) {
    state.feed.reset();
    state.pulls = mode == GST_PAD_MODE_PULL;
    return gst_task_start(state.task);
  }
  gst_task_stop(state.task);
  g_rec_mutex_lock(&state.task_lock);  // a seek that is under way
  g_rec_mutex_unlock(&state.task_lock);
  return gst_task_join(state.task);
}

GstStateChangeReturn changeState(GstElement* element, GstStateChange change) {
  const GstStateChangeReturn result = parentClass<GstElementClass>(element)->change_state(element, change);
  if (change == GST_STATE_CHANGE_PAUSED_TO_READY) self(element)->state->close();
  return result;
}

enum Property { kFollow = 1 };

void setProperty(GObject* object, guint id, const GValue* value, GParamSpec* spec) {
  if (id == kFollow) {
    self(object)->state->follow = g_value_get_boolean(value) != FALSE;
  } else {
    G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
  }
}

void getProperty(GObject* object, guint id, GValue* value, GParamSpec* spec) {
  if (id == kFollow) {
    g_value_set_boolean(value, self(object)->state->follow);
  } else {
    G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
  }
}

void initClass(ElementClass* klass) {
  auto* object = G_OBJECT_CLASS(klass);
  object->set_property = setProperty;
  object->get_property = getProperty;
  object->finalize = finalizeElement<Element>;
  g_object_class_install_property(
      object, kFollow,
      g_param_spec_boolean("follow", "Follow",
                           "At the end of a file that is still being written, wait for more (pull mode)",
                           FALSE, static_cast<GParamFlags>(G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS)));
  auto* element = GST_ELEMENT_CLASS(klass);
  element->change_state = changeState;
  gst_element_class_set_static_metadata(element, "Isoreel demuxer", "Codec/Demuxer",
                                        "Reads packets of isosurfaces from an .isr file", "Isoreel");
  addTemplate(element, "sink", GST_PAD_SINK, GST_PAD_ALWAYS, kFileCaps);
  addTemplate(element, "src_%u", GST_PAD_SRC, GST_PAD_SOMETIMES, kPacketCaps);
}

void init(Element* element) {
  element->sink = newPad(element, "sink");
  gst_pad_set_chain_function(element->sink, chain);
  gst_pad_set_event_function(element->sink, sinkEvent);
  gst_pad_set_activate_function(element->sink, activate);
  gst_pad_set_activatemode_function(element->sink, activateMode);
  element->state = new State(element, element->sink);
  gst_element_add_pad(GST_ELEMENT(element), element->sink);
}

// The eight bytes that an `.isr` file starts with (spec container 2.1).
void find(GstTypeFind* finder, gpointer) {
  constexpr guint8 kMagic[] = {0x89, 'I', 'S', 'R', 0x0D, 0x0A, 0x1A, 0x0A};
  const guint8* start = gst_type_find_peek(finder, 0, sizeof(kMagic));
  if (start != nullptr && std::memcmp(start, kMagic, sizeof(kMagic)) == 0)
    gst_type_find_suggest_empty_simple(finder, GST_TYPE_FIND_MAXIMUM, kFileCaps);
}

}  // namespace
}  // namespace demux

bool registerDemux(GstPlugin* plugin) {
  const GType type = elementType<demux::Element, demux::ElementClass>(GST_TYPE_ELEMENT, "GstIsoreelDemux",
                                                                      demux::initClass, demux::init);
  GstCaps* caps = gst_caps_from_string(kFileCaps);
  const bool found =
      gst_type_find_register(plugin, kFileCaps, GST_RANK_PRIMARY, demux::find, "isr", caps, nullptr, nullptr);
  gst_caps_unref(caps);
  return found && gst_element_register(plugin, "isoreeldemux", GST_RANK_PRIMARY, type);
}

}  // namespace isoreel::gst
