// SPDX-License-Identifier: BSD-3-Clause
/**
 * SECTION:element-isoreelenc
 *
 * Codes the isosurface of each volume into a packet. Volumes come from #isoreelvolumesrc, or from a program's
 * own appsrc as application/x-volume. Every option is the one of the same name of `isoreel encode`, and the
 * same volumes and options give the same packets.
 *
 * A buffer that carries an isovalue (isoreelvolumesrc puts it there) is coded at that one, unless the
 * property `iso` is set. After a flush, and where a buffer has DISCONT, a GOP begins.
 *
 * ## Example
 * |[
 * gst-launch-1.0 isoreelvolumesrc location='run/step_*.vti' array=phi ! isoreelenc iso=0 inside=below
 * step=1/32 ! isoreelmux ! filesink location=run.isr
 * ]|
 */
#include "enc.h"

#include <isoreel/codec/encoder.h>

#include <bit>
#include <memory>
#include <utility>

#include "enc_settings.h"
#include "frame_meta.h"
#include "numbers.h"
#include "packet_caps.h"
#include "threads.h"
#include "volume_caps.h"

namespace isoreel::gst {
namespace {

// What one run of buffers is coded with; made when caps come.
struct Session {
  VolumeFormat format;
  std::vector<double> isovalues;  // from the property; none: from buffers, or 0 for level sets
  Encoder encoder;
};

struct Element {
  GstElement parent;
  GstPad* sink;
  GstPad* src;
  struct State* state;
};
struct ElementClass {
  GstElementClass parent;
};

struct State {
  EncoderProperties properties;  // under the object's lock
  // The rest belongs to the streaming thread.
  EncoderSettings settings;
  std::optional<Session> session;
  std::uint64_t frames = 0;
  std::uint64_t gop_start = 0;  // frame that the encoder began with
  bool renew = false;           // the next frame begins a GOP
  bool told = false;            // who the encoder is, as tags
  GstBuffer* held = nullptr;    // until the time of the next one tells its duration
  GstClockTime last_duration = GST_CLOCK_TIME_NONE;

  void release() {
    gst_clear_buffer(&held);
    session.reset();
    frames = 0;
    told = false;
    last_duration = GST_CLOCK_TIME_NONE;
  }
};

Element* self(gpointer element) { return static_cast<Element*>(element); }

/// The unit of times: what the caps say, a frame, or a nanosecond.
TimeBase timeBase(const VolumeFormat& format) {
  return format.time_base.value_or(format.frame.value_or(TimeBase{1, GST_SECOND}));
}

Status begin(Element* element, const GstCaps* caps) {
  State& state = *element->state;
  ISOREEL_ASSIGN(VolumeFormat format, volumeFormat(caps));
  GST_OBJECT_LOCK(element);
  const EncoderProperties properties = state.properties;
  GST_OBJECT_UNLOCK(element);
  std::vector<double> isovalues;
  if (!properties.isovalues.empty()) {
    ISOREEL_ASSIGN(isovalues, numbersIn("iso", properties.isovalues));
  }
  if (state.session && !(state.session->format.grid == format.grid))
    return {ErrorCode::kInvalidArgument,
            "caps: all volumes of a sequence lie on one grid, and this is another"};
  EncoderSettings settings = properties.chosen();
  settings.configuration.grid = format.grid;
  settings.configuration.inside =
      properties.inside.value_or(format.level_set ? Inside::kBelow : Inside::kAbove);
  settings.configuration.time_base = timeBase(format);
  settings.parallel = threads(properties.jobs);
  ISOREEL_ASSIGN(Encoder encoder, Encoder::create(settings));
  GstCaps* out = packetCaps(encoder.configuration(), encoder.configurationRecord(),
                            settings.configuration.time_base, format.frame);
  const bool taken = gst_pad_set_caps(element->src, out) != FALSE;
  gst_caps_unref(out);
  if (!taken) return {ErrorCode::kInvalidArgument, "what comes behind the encoder does not take its packets"};
  state.settings = settings;
  state.session.emplace(Session{format, std::move(isovalues), std::move(encoder)});
  state.gop_start = state.frames;
  return {};
}

Result<double> isovalueOf(const Session& session, std::uint64_t frame, GstBuffer* buffer) {
  if (session.isovalues.size() == 1) return session.isovalues[0];
  if (!session.isovalues.empty()) {
    if (frame < session.isovalues.size()) return session.isovalues[static_cast<std::size_t>(frame)];
    return {ErrorCode::kInvalidArgument,
            "iso: " + std::to_string(session.isovalues.size()) + " values, and more volumes than that"};
  }
  if (const double* value = isovalue(buffer)) return *value;
  if (session.format.level_set) return 0.0;
  return {ErrorCode::kInvalidArgument, "iso: is required: these volumes do not say that they are level sets"};
}

Result<FrameTiming> timing(State& state, GstBuffer* buffer) {
  const Session& session = *state.session;
  const TimeBase base = timeBase(session.format);
  const std::uint64_t frame = state.frames;
  FrameTiming result;
  result.number = frame;
  ISOREEL_ASSIGN(result.isovalue, isovalueOf(session, frame, buffer));
  const GstClockTime time = GST_BUFFER_PTS(buffer);
  if (time != GST_CLOCK_TIME_NONE) {
    result.time = toTicks(time, base);
  } else if (session.format.frame) {
    result.time = toTicks(toClockTime(static_cast<std::int64_t>(frame), *session.format.frame), base);
  } else {
    return {ErrorCode::kInvalidArgument, "the buffer has no time, and its caps no framerate"};
  }
  GstClockTime length = GST_BUFFER_DURATION(buffer);
  if (length == GST_CLOCK_TIME_NONE && session.format.frame) length = toClockTime(1, *session.format.frame);
  if (length == GST_CLOCK_TIME_NONE) length = state.last_duration;
  state.last_duration = length;
  if (length != GST_CLOCK_TIME_NONE) {
    const GstClockTime start = toClockTime(result.time, base);
    const std::int64_t ticks = toTicks(start + length, base) - result.time;
    result.duration = static_cast<std::uint64_t>(std::max<std::int64_t>(ticks, 1));
  }
  return result;
}

Result<GstBuffer*> encode(State& state, GstBuffer* buffer) {
  Session& session = *state.session;
  // GOPs begin at multiples of their length, as those of the command line do, which codes them side by side.
  const std::uint64_t since = state.frames - state.gop_start;
  if (since > 0 && (state.renew || since % state.settings.gop == 0)) {
    ISOREEL_ASSIGN(session.encoder, Encoder::create(state.settings));
    if (state.renew) state.gop_start = state.frames;
  }
  state.renew = false;
  ISOREEL_ASSIGN(const FrameTiming when, timing(state, buffer));
  ISOREEL_ASSIGN(const Volume volume, volumeOf(buffer, session.format));
  ISOREEL_ASSIGN(Packet packet, session.encoder.encode(volume, when));
  ++state.frames;
  GstBuffer* out = packetBuffer(std::move(packet), state.settings.configuration.time_base, 0);
  return out;
}

// Codes `buffer`, which it takes, and sends the packet on.
GstFlowReturn handle(Element* element, GstBuffer* buffer) {
  State& state = *element->state;
  if (GST_BUFFER_IS_DISCONT(buffer)) state.renew = true;
  const Result<GstBuffer*> coded = encode(state, buffer);
  gst_buffer_unref(buffer);
  if (!coded) {
    postError(GST_ELEMENT(element), coded.status(), "volume " + std::to_string(state.frames));
    return GST_FLOW_ERROR;
  }
  if (!std::exchange(state.told, true)) {
    GstTagList* tags = gst_tag_list_new(GST_TAG_VIDEO_CODEC, "Isoreel", GST_TAG_ENCODER,
                                        "isoreel " ISOREEL_VERSION, nullptr);
    gst_pad_push_event(element->src, gst_event_new_tag(tags));
  }
  return gst_pad_push(element->src, *coded);
}

GstFlowReturn drain(Element* element) {
  GstBuffer* held = std::exchange(element->state->held, nullptr);
  return held != nullptr ? handle(element, held) : GST_FLOW_OK;
}

GstFlowReturn chain(GstPad*, GstObject* parent, GstBuffer* buffer) {
  Element* element = self(parent);
  State& state = *element->state;
  if (!state.session) {
    gst_buffer_unref(buffer);
    postError(GST_ELEMENT(element), Status(ErrorCode::kInvalidArgument, "a volume came before its caps"));
    return GST_FLOW_NOT_NEGOTIATED;
  }
  if (state.held != nullptr) {
    GstBuffer* held = std::exchange(state.held, nullptr);
    const GstClockTime from = GST_BUFFER_PTS(held), to = GST_BUFFER_PTS(buffer);
    held = gst_buffer_make_writable(held);
    if (to != GST_CLOCK_TIME_NONE && to > from) GST_BUFFER_DURATION(held) = to - from;
    if (const GstFlowReturn flow = handle(element, held); flow != GST_FLOW_OK) {
      gst_buffer_unref(buffer);
      return flow;
    }
  }
  const bool lasts = GST_BUFFER_DURATION_IS_VALID(buffer) || state.session->format.frame.has_value();
  if (lasts || !GST_BUFFER_PTS_IS_VALID(buffer)) return handle(element, buffer);
  state.held = buffer;
  return GST_FLOW_OK;
}

gboolean sinkEvent(GstPad* pad, GstObject* parent, GstEvent* event) {
  Element* element = self(parent);
  State& state = *element->state;
  switch (GST_EVENT_TYPE(event)) {
    case GST_EVENT_CAPS: {
      drain(element);
      GstCaps* caps = nullptr;
      gst_event_parse_caps(event, &caps);
      const Status begun = begin(element, caps);
      gst_event_unref(event);
      if (!begun.ok()) postError(GST_ELEMENT(element), begun);
      return begun.ok();
    }
    case GST_EVENT_EOS:
      drain(element);
      break;
    case GST_EVENT_SEGMENT: {
      drain(element);
      const GstSegment* segment = nullptr;
      gst_event_parse_segment(event, &segment);
      if (segment->format == GST_FORMAT_TIME) break;
      // Who pushes volumes and says nothing of time gets that of the buffers.
      GstSegment time;
      gst_segment_init(&time, GST_FORMAT_TIME);
      GstEvent* timed = gst_event_new_segment(&time);
      gst_event_set_seqnum(timed, gst_event_get_seqnum(event));
      gst_event_unref(event);
      event = timed;
      break;
    }
    case GST_EVENT_FLUSH_STOP:
      gst_clear_buffer(&state.held);
      state.renew = true;
      break;
    default:
      break;
  }
  return gst_pad_event_default(pad, parent, event);
}

GstStateChangeReturn changeState(GstElement* element, GstStateChange change) {
  const GstStateChangeReturn result = parentClass<GstElementClass>(element)->change_state(element, change);
  if (change == GST_STATE_CHANGE_PAUSED_TO_READY) self(element)->state->release();
  return result;
}

void setProperty(GObject* object, guint id, const GValue* value, GParamSpec* spec) {
  GST_OBJECT_LOCK(object);
  self(object)->state->properties.set(object, id, value, spec);
  GST_OBJECT_UNLOCK(object);
}

void getProperty(GObject* object, guint id, GValue* value, GParamSpec* spec) {
  GST_OBJECT_LOCK(object);
  self(object)->state->properties.get(object, id, value, spec);
  GST_OBJECT_UNLOCK(object);
}

void finalize(GObject* object) {
  self(object)->state->release();
  finalizeElement<Element>(object);
}

void initClass(ElementClass* klass) {
  auto* object = G_OBJECT_CLASS(klass);
  object->set_property = setProperty;
  object->get_property = getProperty;
  object->finalize = finalize;
  EncoderProperties::install(object);
  auto* element = GST_ELEMENT_CLASS(klass);
  element->change_state = changeState;
  gst_element_class_set_static_metadata(element, "Isoreel encoder", "Codec/Encoder/Video",
                                        "Codes the isosurfaces of volumes into packets", "Isoreel");
  addTemplate(element, "sink", GST_PAD_SINK, GST_PAD_ALWAYS, kVolumeCaps);
  addTemplate(element, "src", GST_PAD_SRC, GST_PAD_ALWAYS, kPacketCaps);
}

void init(Element* element) {
  element->state = new State;
  element->sink = newPad(element, "sink");
  gst_pad_set_chain_function(element->sink, chain);
  gst_pad_set_event_function(element->sink, sinkEvent);
  GST_PAD_SET_ACCEPT_TEMPLATE(element->sink);
  gst_element_add_pad(GST_ELEMENT(element), element->sink);
  element->src = newPad(element, "src");
  gst_pad_use_fixed_caps(element->src);
  gst_element_add_pad(GST_ELEMENT(element), element->src);
}

}  // namespace

bool registerEncoder(GstPlugin* plugin) {
  const GType type = elementType<Element, ElementClass>(GST_TYPE_ELEMENT, "GstIsoreelEnc", initClass, init);
  return gst_element_register(plugin, "isoreelenc", GST_RANK_PRIMARY, type) != FALSE;
}

}  // namespace isoreel::gst
