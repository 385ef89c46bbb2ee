// SPDX-License-Identifier: BSD-3-Clause
/**
 * SECTION:element-isoreeldec
 *
 * Decodes packets to triangle meshes, `model/x-triangle-mesh` (mesh.h has the format), for those who want
 * triangles and not pictures: take them from an appsink. Works behind isoreeldemux and behind qtdemux and
 * matroskademux.
 *
 * A damaged packet is named by a warning, and what needs it is left out, up to the next key. When frames come
 * late, a coarser level of the octree is decoded, and only then frames are dropped.
 *
 * ## Example
 * |[
 * gst-launch-1.0 -v filesrc location=splash.isr ! isoreeldemux ! isoreeldec ! fakesink silent=false
 * ]|
 */
#include "dec.h"

#include <isoreel/codec/player.h>

#include "gop_packets.h"
#include "lateness.h"
#include "mesh.h"
#include "threads.h"

namespace isoreel::gst {
namespace {

enum Property : guint { kCoarser = 1, kQos, kMaxCoarser, kJobs };

struct Settings {
  gint coarser = 0;
  gboolean qos = TRUE;
  gint max_coarser = 2;
  gint jobs = 0;
};

struct State {
  // Behind the object's lock.
  Settings settings;
  Lateness lateness;

  // The streaming thread's.
  GstSegment segment{};
  Configuration configuration;  // of the last key
  ParallelFor parallel = serialFor;
  Decoder decoder;
  bool waiting = true;  // for a key
  bool discont = true;  // the next mesh does not follow on the one before
  GopPackets gop;       // gathered to be played backward
  bool shown = false;   // something, since the start
  std::optional<Status> damage;
  guint64 meshes = 0, dropped = 0;
  GstAllocator* allocator = nullptr;
  GstAllocationParams parameters{};
};

struct Element {
  GstElement parent;
  GstPad *sink, *source;
  State* state;
};
struct ElementClass {
  GstElementClass parent;
};

Element* self(gpointer element) { return static_cast<Element*>(element); }

/// How a frame is to be decoded.
struct Plan {
  GstClockTime time = 0, duration = 0;  // within the segment
  bool shown = false;
  int coarser = 0;
};

Plan planOf(Element* element, const TimedPacket& timed) {
  State& state = *element->state;
  Plan plan{timed.time, timed.duration, timed.shown, 0};
  const GstSegment& segment = state.segment;
  if (plan.shown && segment.format == GST_FORMAT_TIME && GST_CLOCK_TIME_IS_VALID(timed.time)) {
    guint64 end = GST_CLOCK_TIME_IS_VALID(timed.duration) ? timed.time + timed.duration : GST_CLOCK_TIME_NONE;
    plan.shown = gst_segment_clip(&segment, GST_FORMAT_TIME, timed.time, end, &plan.time, &end);
    if (GST_CLOCK_TIME_IS_VALID(end)) plan.duration = end - plan.time;
  }
  if (!plan.shown) return plan;
  const GstClockTime running = segment.format == GST_FORMAT_TIME
                                   ? gst_segment_to_running_time(&segment, GST_FORMAT_TIME, plan.time)
                                   : GST_CLOCK_TIME_NONE;
  GST_OBJECT_LOCK(element);
  const Settings settings = state.settings;
  plan.coarser = settings.coarser;
  if (settings.qos && GST_CLOCK_TIME_IS_VALID(running)) {
    plan.coarser += state.lateness.degree(running);
    plan.shown = !state.lateness.hopeless(running, settings.max_coarser);
  }
  GST_OBJECT_UNLOCK(element);
  if (plan.shown) return plan;
  ++state.dropped;
  GstMessage* message = gst_message_new_qos(GST_OBJECT(element), FALSE, running,
                                            gst_segment_to_stream_time(&segment, GST_FORMAT_TIME, plan.time),
                                            plan.time, plan.duration);
  gst_message_set_qos_stats(message, GST_FORMAT_BUFFERS, state.meshes, state.dropped);
  gst_element_post_message(GST_ELEMENT(element), message);
  state.discont = true;
  return plan;
}

std::uint32_t levelOf(const State& state, int coarser) {
  const std::uint32_t depth = octreeDepth(state.configuration.grid);
  return depth - std::min(static_cast<std::uint32_t>(coarser), depth);
}

/// A frame that could not be decoded: said, and left out.
GstFlowReturn leaveOut(Element* element, const Status& status) {
  State& state = *element->state;
  state.waiting = state.discont = true;
  state.decoder = Decoder(state.parallel);
  if (status.error().code == ErrorCode::kUnsupported) {
    postError(GST_ELEMENT(element), status);
    return GST_FLOW_ERROR;
  }
  postWarning(GST_ELEMENT(element), status);
  state.damage = status;
  return GST_FLOW_OK;
}

GstFlowReturn push(Element* element, const FrameHeader& header, const Plan& plan, const Surface& surface) {
  State& state = *element->state;
  GstBuffer* buffer = meshBuffer(surface, state.allocator, &state.parameters);
  if (buffer == nullptr) {
    GST_ELEMENT_ERROR(element, RESOURCE, NO_SPACE_LEFT, ("No memory for a mesh"), (nullptr));
    return GST_FLOW_ERROR;
  }
  GST_BUFFER_PTS(buffer) = plan.time;
  GST_BUFFER_DURATION(buffer) = plan.duration;
  GST_BUFFER_OFFSET(buffer) = header.number;
  if (state.discont) GST_BUFFER_FLAG_SET(buffer, GST_BUFFER_FLAG_DISCONT);
  addSurfaceFacts(buffer, {header.number, header.isovalue, header.surface_hash, header.vertices, header.faces,
                           levelOf(state, plan.coarser), octreeDepth(surface.grid)});
  state.discont = false;
  state.shown = true;
  ++state.meshes;
  return gst_pad_push(element->source, buffer);
}

GstFlowReturn decode(Element* element, const TimedPacket& timed) {
  State& state = *element->state;
  const FrameHeader& header = timed.packet.header;
  const Plan plan = planOf(element, timed);
  DecodeOptions options;
  options.level = plan.shown ? levelOf(state, plan.coarser) : 0;
  const Result<Surface> surface = state.decoder.decode(timed.packet.data, options).at(placeOf(header));
  if (!surface) return leaveOut(element, surface.status());
  state.waiting = false;
  return plan.shown ? push(element, header, plan, *surface) : GST_FLOW_OK;
}

/// Last frame first, of what was gathered.
GstFlowReturn playBackward(Element* element) {
  State& state = *element->state;
  GstFlowReturn flow = GST_FLOW_OK;
  Player player(state.gop, Player::kCacheBytes, state.parallel);
  std::optional<DecodeOptions> options;  // the same for all, or what the player keeps would be of no use
  int coarser = 0;
  bool damaged = false;
  for (std::uint64_t frame = state.gop.frameCount(); frame-- > 0 && flow == GST_FLOW_OK;) {
    Plan plan = planOf(element, state.gop.timed(frame));
    if (!plan.shown) continue;
    if (!options) options = DecodeOptions{.level = levelOf(state, coarser = plan.coarser)};
    plan.coarser = coarser;
    const Result<Surface> surface = player.frame(frame, *options);
    if (surface.ok()) {
      flow = push(element, state.gop.header(frame), plan, *surface);
    } else if (!std::exchange(damaged, true)) {  // once for all that need the same packet
      flow = leaveOut(element, surface.status());
    }
  }
  state.gop.clear();
  return flow;
}

GstFlowReturn chain(GstPad*, GstObject* parent, GstBuffer* buffer) {
  Element* element = self(parent);
  State& state = *element->state;
  const bool discont = GST_BUFFER_FLAG_IS_SET(buffer, GST_BUFFER_FLAG_DISCONT);
  TimedPacket timed = packetOf(buffer, state.configuration);
  gst_buffer_unref(buffer);
  const bool backward = state.segment.rate < 0;
  if (discont || (backward && !state.gop.empty() && timed.time < state.gop.last().time)) {
    const GstFlowReturn flow = playBackward(element);
    state.waiting = state.discont = true;
    if (flow != GST_FLOW_OK) return flow;
  }
  const bool keys_only = (state.segment.flags & GST_SEGMENT_FLAG_TRICKMODE_KEY_UNITS) != 0;
  if (timed.packet.header.type == PacketType::kPredicted && (state.waiting || keys_only)) {
    GST_DEBUG_OBJECT(element, "frame %" G_GUINT64_FORMAT " is left out: %s", timed.packet.header.number,
                     keys_only ? "keys are wanted" : "its key is not there");
    return GST_FLOW_OK;
  }
  if (!backward) return decode(element, timed);
  state.waiting = false;
  state.gop.add(std::move(timed));
  return GST_FLOW_OK;
}

bool setCaps(Element* element, GstCaps* coded) {
  State& state = *element->state;
  GstCaps* caps = gst_caps_from_string(kMeshCaps);
  const GstStructure* from = gst_caps_get_structure(coded, 0);
  for (const char* field : {"framerate", "bounding-box"}) {
    if (const GValue* value = gst_structure_get_value(from, field)) gst_caps_set_value(caps, field, value);
  }
  const bool done = gst_pad_set_caps(element->source, caps);
  GstQuery* query = gst_query_new_allocation(caps, FALSE);
  if (state.allocator != nullptr) gst_object_unref(state.allocator);
  state.allocator = nullptr;
  gst_allocation_params_init(&state.parameters);
  if (gst_pad_peer_query(element->source, query) && gst_query_get_n_allocation_params(query) > 0)
    gst_query_parse_nth_allocation_param(query, 0, &state.allocator, &state.parameters);
  gst_query_unref(query);
  gst_caps_unref(caps);
  return done;
}

void reset(Element* element) {
  State& state = *element->state;
  state.decoder = Decoder(state.parallel);
  state.waiting = state.discont = true;
  state.gop.clear();
  gst_segment_init(&state.segment, GST_FORMAT_UNDEFINED);
  GST_OBJECT_LOCK(element);
  state.lateness = {};
  GST_OBJECT_UNLOCK(element);
}

gboolean sinkEvent(GstPad* pad, GstObject* parent, GstEvent* event) {
  Element* element = self(parent);
  State& state = *element->state;
  switch (GST_EVENT_TYPE(event)) {
    case GST_EVENT_CAPS: {
      playBackward(element);
      GstCaps* caps = nullptr;
      gst_event_parse_caps(event, &caps);
      const bool done = setCaps(element, caps);
      gst_event_unref(event);
      return done;
    }
    case GST_EVENT_SEGMENT:
      playBackward(element);
      gst_event_copy_segment(event, &state.segment);
      break;
    case GST_EVENT_FLUSH_STOP:
      reset(element);
      break;
    case GST_EVENT_EOS:
      playBackward(element);
      if (!state.shown && state.damage)
        postError(GST_ELEMENT(element), *state.damage, "no frame could be decoded");
      break;
    default:
      break;
  }
  return gst_pad_event_default(pad, parent, event);
}

gboolean sourceEvent(GstPad* pad, GstObject* parent, GstEvent* event) {
  State& state = *self(parent)->state;
  if (GST_EVENT_TYPE(event) == GST_EVENT_QOS) {
    GstClockTimeDiff late = 0;
    GstClockTime time = 0;
    gst_event_parse_qos(event, nullptr, nullptr, &late, &time);
    GST_OBJECT_LOCK(parent);
    state.lateness.report(time, late, state.settings.max_coarser);
    GST_OBJECT_UNLOCK(parent);
  }
  return gst_pad_event_default(pad, parent, event);
}

GstStateChangeReturn changeState(GstElement* base, GstStateChange change) {
  Element* element = self(base);
  State& state = *element->state;
  if (change == GST_STATE_CHANGE_READY_TO_PAUSED) {
    GST_OBJECT_LOCK(element);
    const int jobs = state.settings.jobs;
    GST_OBJECT_UNLOCK(element);
    state.parallel = threads(jobs);
    reset(element);
    state.shown = false;
    state.damage.reset();
    state.meshes = state.dropped = 0;
  }
  const GstStateChangeReturn result = parentClass<GstElementClass>(base)->change_state(base, change);
  if (change == GST_STATE_CHANGE_PAUSED_TO_READY) {
    reset(element);
    if (state.allocator != nullptr) gst_object_unref(state.allocator);
    state.allocator = nullptr;
  }
  return result;
}

void setProperty(GObject* object, guint id, const GValue* value, GParamSpec*) {
  Settings& settings = self(object)->state->settings;
  GST_OBJECT_LOCK(object);
  if (id == kCoarser) settings.coarser = g_value_get_int(value);
  if (id == kQos) settings.qos = g_value_get_boolean(value);
  if (id == kMaxCoarser) settings.max_coarser = g_value_get_int(value);
  if (id == kJobs) settings.jobs = g_value_get_int(value);
  GST_OBJECT_UNLOCK(object);
}

void getProperty(GObject* object, guint id, GValue* value, GParamSpec*) {
  const Settings& settings = self(object)->state->settings;
  GST_OBJECT_LOCK(object);
  if (id == kCoarser) g_value_set_int(value, settings.coarser);
  if (id == kQos) g_value_set_boolean(value, settings.qos);
  if (id == kMaxCoarser) g_value_set_int(value, settings.max_coarser);
  if (id == kJobs) g_value_set_int(value, settings.jobs);
  GST_OBJECT_UNLOCK(object);
}

void initClass(ElementClass* klass) {
  GObjectClass* object = G_OBJECT_CLASS(klass);
  object->set_property = setProperty;
  object->get_property = getProperty;
  object->finalize = finalizeElement<Element>;
  installDecoderProperties(object);
  GstElementClass* element = GST_ELEMENT_CLASS(klass);
  element->change_state = changeState;
  gst_element_class_set_static_metadata(element, "Isosurface decoder", "Codec/Decoder",
                                        "Decodes packets of time-varying isosurfaces to triangle meshes",
                                        "Isoreel");
  addTemplate(element, "sink", GST_PAD_SINK, GST_PAD_ALWAYS, kCodedCaps);
  addTemplate(element, "src", GST_PAD_SRC, GST_PAD_ALWAYS, kMeshCaps);
}

void init(Element* element) {
  element->state = new State;
  element->sink = newPad(element, "sink");
  gst_pad_set_chain_function(element->sink, chain);
  gst_pad_set_event_function(element->sink, sinkEvent);
  GST_PAD_SET_ACCEPT_TEMPLATE(element->sink);
  element->source = newPad(element, "src");
  gst_pad_set_event_function(element->source, sourceEvent);
  gst_pad_use_fixed_caps(element->source);
  gst_element_add_pad(GST_ELEMENT(element), element->sink);
  gst_element_add_pad(GST_ELEMENT(element), element->source);
}

}  // namespace

void installDecoderProperties(GObjectClass* klass) {
  constexpr auto kFlags =
      static_cast<GParamFlags>(G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS | GST_PARAM_MUTABLE_PLAYING);
  g_object_class_install_property(
      klass, kCoarser,
      g_param_spec_int(
          "coarser", "Coarser",
          "Levels of the octree to leave out: each makes cells twice as large (0: the full surface)", 0, 16,
          Settings{}.coarser, kFlags));
  g_object_class_install_property(
      klass, kQos,
      g_param_spec_boolean("qos", "QoS",
                           "Do less for frames that would come late, and drop those that would be of no use",
                           Settings{}.qos, kFlags));
  g_object_class_install_property(
      klass, kMaxCoarser,
      g_param_spec_int("max-coarser", "Most coarser",
                       "With qos: levels that are left out of late frames before any are dropped", 0, 16,
                       Settings{}.max_coarser, kFlags));
  g_object_class_install_property(
      klass, kJobs,
      g_param_spec_int(
          "jobs", "Jobs", "Threads for a frame, from the next start on; 0: one a core", 0, 256,
          Settings{}.jobs,
          static_cast<GParamFlags>(G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS | GST_PARAM_MUTABLE_READY)));
}

GType decoderType() {
  static const GType type =
      elementType<Element, ElementClass>(GST_TYPE_ELEMENT, "GstIsoreelDec", initClass, init);
  return type;
}

bool registerDecoder(GstPlugin* plugin) {
  registerSurfaceMeta();
  // Not by itself what a player looks for: isoreelvideodec is.
  return gst_element_register(plugin, "isoreeldec", GST_RANK_NONE, decoderType());
}

}  // namespace isoreel::gst
