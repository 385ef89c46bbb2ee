// SPDX-License-Identifier: BSD-3-Clause
/**
 * SECTION:element-isoreelmux
 *
 * Writes packets into an `.isr` file, a track for each sink pad. Bytes go out front to back and are never
 * written twice, so the output may be a pipe; what was written before a pipeline was killed can be read.
 *
 * Packets are kept bit for bit. A pad's title (a tag of the stream) is the name of its track, unless
 * `track-names` says otherwise; other tags, from the stream or by #GstTagSetter, are the file's tags; a table
 * of contents, from the stream or by #GstTocSetter, its chapters. What is shown stays what is shown: packets
 * in front of where a seek went are kept, hidden.
 *
 * ## Example
 * |[
 * gst-launch-1.0 filesrc location=splash.isr ! isoreeldemux ! isoreelmux parity=10 ! filesink
 * location=safe.isr
 * gst-launch-1.0 isoreelmux name=mux track-names=skin,bone ! filesink location=ct.isr \
 *     isoreelvolumesrc location=ct.nii.gz ! tee name=t ! queue ! isoreelenc iso=300 ! mux.sink_0 \
 *     t. ! queue ! isoreelenc iso=1200 ! mux.sink_1
 * ]|
 */
#include "mux.h"

#include <gst/base/gstaggregator.h>
#include <isoreel/container/parity.h>

#include <algorithm>
#include <map>
#include <memory>
#include <mutex>

#include "mux_track.h"
#include "outbox.h"
#include "tags.h"

namespace isoreel::gst {
namespace {

struct State {
  // Under the object's lock.
  guint parity = 0;
  MuxTimes times = MuxTimes::kStream;
  std::string names;  // of tracks, in the pads' order, with commas between
  // Belongs to the thread that aggregates; `lock` is for pads that come and go.
  std::mutex lock;
  std::map<GstPad*, MuxTrack> tracks;
  std::unique_ptr<Writer> writer;
  Bytes written;  // by the writer, not sent on yet
  std::uint64_t sent = 0;
  GstTagList* tags = nullptr;  // from upstream
  GstToc* toc = nullptr;
  std::string tags_written = "{}";
  std::vector<Chapter> chapters_written;
  TimeBase chapter_base;

  void reset() {
    const std::lock_guard guard(lock);
    for (auto& [pad, track] : tracks) {
      MuxTrack fresh;
      fresh.caps_base = track.caps_base;
      fresh.caps_record = track.caps_record;
      fresh.name = track.name;
      track = std::move(fresh);
    }
    writer.reset();
    written.clear();
    sent = 0;
    tags_written = "{}";
    chapters_written.clear();
  }
  void forgetStream() {
    gst_clear_tag_list(&tags);
    gst_clear_mini_object(reinterpret_cast<GstMiniObject**>(&toc));
  }
};

struct Element {
  GstAggregator parent;
  State* state;
};
struct ElementClass {
  GstAggregatorClass parent;
};

Element* self(gpointer element) { return static_cast<Element*>(element); }

std::string tagsNow(Element* element) {
  const GstTagList* set = gst_tag_setter_get_tag_list(GST_TAG_SETTER(element));
  const GstTagMergeMode mode = gst_tag_setter_get_tag_merge_mode(GST_TAG_SETTER(element));
  GstTagList* merged = gst_tag_list_merge(element->state->tags, set, mode);
  std::string json = merged != nullptr ? jsonOf(merged) : "{}";
  gst_clear_tag_list(&merged);
  return json;
}

std::vector<Chapter> chaptersNow(Element* element) {
  State& state = *element->state;
  GstToc* set = gst_toc_setter_get_toc(GST_TOC_SETTER(element));
  std::vector<Chapter> chapters;
  if (const GstToc* toc = set != nullptr ? set : state.toc) chapters = chaptersOf(toc, state.chapter_base);
  if (set != nullptr) gst_toc_unref(set);
  return chapters;
}

// What tags and chapters have become since they were written.
Status writeMetadata(Element* element) {
  State& state = *element->state;
  if (std::string tags = tagsNow(element); tags != state.tags_written) {
    ISOREEL_TRY(state.writer->setTags(tags));
    state.tags_written = std::move(tags);
  }
  if (std::vector<Chapter> chapters = chaptersNow(element); chapters != state.chapters_written) {
    ISOREEL_TRY(state.writer->setChapters(chapters));
    state.chapters_written = std::move(chapters);
  }
  return {};
}

Status addTrack(Element* element, MuxTrack& track) {
  State& state = *element->state;
  TrackSettings settings = track.settings();
  GST_OBJECT_LOCK(element);
  const std::string names = state.names;
  const guint parity = state.parity;
  GST_OBJECT_UNLOCK(element);
  settings.name =
      trackName(state.writer ? state.writer->info().tracks : std::vector<TrackInfo>(), names, track.name);
  if (state.writer) {
    ISOREEL_ASSIGN(track.id, state.writer->addTrack(std::move(settings)));
    return {};
  }
  WriterSettings file;
  file.time_base = state.chapter_base = settings.time_base;
  file.track_name = settings.name;
  file.configuration = settings.configuration;
  if (parity > 0) file.options.parity = reedSolomonParity(parity);
  auto sink = std::make_unique<Outbox>(state.written, GST_OBJECT_NAME(element));
  ISOREEL_ASSIGN(state.writer, Writer::create(std::move(sink), std::move(file)));
  track.id = 0;
  return {};
}

using PadList = std::vector<GstPad*>;  // with a reference each

PadList sinkPads(Element* element) {
  PadList pads;
  GST_OBJECT_LOCK(element);
  for (GList* at = GST_ELEMENT(element)->sinkpads; at != nullptr; at = at->next)
    pads.push_back(static_cast<GstPad*>(gst_object_ref(at->data)));
  GST_OBJECT_UNLOCK(element);
  return pads;
}

GstFlowReturn send(Element* element) {
  State& state = *element->state;
  if (state.written.empty()) return GST_FLOW_OK;
  GstBuffer* buffer = bufferOf(std::exchange(state.written, {}));
  GST_BUFFER_OFFSET(buffer) = state.sent;
  state.sent += gst_buffer_get_size(buffer);
  GST_BUFFER_OFFSET_END(buffer) = state.sent;
  return gst_aggregator_finish_buffer(GST_AGGREGATOR(element), buffer);
}

// Packets of one pad that wait to be written, as the file begins when each pad has one.
struct Due {
  GstPad* pad = nullptr;
  GstClockTime time = 0;
};

// As it is now: a flush from another thread may just have undone it.
GstSegment segmentOf(GstPad* pad) {
  GST_OBJECT_LOCK(pad);
  const GstSegment segment = GST_AGGREGATOR_PAD(pad)->segment;
  GST_OBJECT_UNLOCK(pad);
  return segment;
}

GstClockTime runningTime(GstPad* pad, GstBuffer* buffer) {
  const GstSegment segment = segmentOf(pad);
  guint64 time = 0;
  const GstClockTime start = GST_BUFFER_DTS_OR_PTS(buffer);
  if (start == GST_CLOCK_TIME_NONE || segment.format != GST_FORMAT_TIME) return 0;
  return gst_segment_to_running_time_full(&segment, GST_FORMAT_TIME, start, &time) > 0 ? time : 0;
}

Result<std::vector<Packet>> takeFrom(Element* element, GstPad* pad, MuxTrack& track) {
  GstBuffer* buffer = gst_aggregator_pad_pop_buffer(GST_AGGREGATOR_PAD(pad));
  if (buffer == nullptr) return std::vector<Packet>{};
  GST_OBJECT_LOCK(element);
  const MuxTimes times = element->state->times;
  GST_OBJECT_UNLOCK(element);
  const GstSegment segment = segmentOf(pad);
  if (segment.format == GST_FORMAT_UNDEFINED) {
    gst_buffer_unref(buffer);
    return std::vector<Packet>{};
  }
  Status warning;
  Result<std::vector<Packet>> packets = track.take(buffer, segment, times, warning);
  gst_buffer_unref(buffer);
  if (!warning.ok()) postWarning(GST_ELEMENT(element), warning, GST_OBJECT_NAME(pad));
  if (!packets) return packets.status().at(GST_OBJECT_NAME(pad));
  return packets;
}

// Finds the pad whose packet comes next; none where one has to be waited for. Whether all have ended stands
// in `eos`.
Due nextDue(const PadList& pads, bool& eos) {
  Due due;
  eos = true;
  for (GstPad* pad : pads) {
    GstBuffer* buffer = gst_aggregator_pad_peek_buffer(GST_AGGREGATOR_PAD(pad));
    if (buffer == nullptr) {
      if (gst_aggregator_pad_is_eos(GST_AGGREGATOR_PAD(pad))) continue;
      eos = false;
      return {};
    }
    eos = false;
    const GstClockTime time = runningTime(pad, buffer);
    gst_buffer_unref(buffer);
    if (due.pad == nullptr || time < due.time) due = {pad, time};
  }
  return due;
}

// Makes the file's tracks: all of them, in the pads' order, before the first packet. The configuration of a
// track that has packets is that of its first one, so all pads are looked at.
Status openTracks(Element* element, const PadList& pads) {
  State& state = *element->state;
  for (GstPad* pad : pads) {
    MuxTrack& track = state.tracks[pad];
    if (track.id || track.known()) continue;
    GstBuffer* buffer = gst_aggregator_pad_peek_buffer(GST_AGGREGATOR_PAD(pad));
    if (buffer == nullptr) {
      track.knowByCaps();
      continue;
    }
    const Status known = track.know(buffer).at(GST_OBJECT_NAME(pad));
    gst_buffer_unref(buffer);
    ISOREEL_TRY(known);
  }
  for (GstPad* pad : pads) {
    MuxTrack& track = state.tracks[pad];
    if (track.known() && !track.id) ISOREEL_TRY(addTrack(element, track));
  }
  return {};
}

Status writeNext(Element* element, const PadList& pads, GstPad* pad) {
  State& state = *element->state;
  ISOREEL_TRY(openTracks(element, pads));
  MuxTrack& track = state.tracks[pad];
  ISOREEL_ASSIGN(const std::vector<Packet> packets, takeFrom(element, pad, track));
  if (packets.empty()) return {};
  if (state.sent == 0 && state.written.empty()) ISOREEL_TRY(writeMetadata(element));
  for (const Packet& packet : packets) ISOREEL_TRY(state.writer->write(packet, *track.id));
  return {};
}

Status finish(Element* element, const PadList& pads) {
  State& state = *element->state;
  ISOREEL_TRY(openTracks(element, pads));
  if (!state.writer)
    return {ErrorCode::kNotFound,
            "no packet came, and no caps that tell what a track is: there is nothing to write"};
  ISOREEL_TRY(writeMetadata(element));
  return state.writer->finish();
}

GstFlowReturn aggregate(GstAggregator* aggregator, gboolean) {
  Element* element = self(aggregator);
  const PadList pads = sinkPads(element);
  bool eos = false;
  Status status;
  {
    const std::lock_guard guard(element->state->lock);
    const Due due = nextDue(pads, eos);
    if (eos) {
      status = finish(element, pads);
    } else if (due.pad != nullptr) {
      status = writeNext(element, pads, due.pad);
    }
  }
  for (GstPad* pad : pads) gst_object_unref(pad);
  if (!status.ok()) {
    postError(GST_ELEMENT(aggregator), status);
    return GST_FLOW_ERROR;
  }
  const GstFlowReturn flow = send(element);
  return flow == GST_FLOW_OK && eos ? GST_FLOW_EOS : flow;
}

void learn(State& state, GstPad* pad, GstEvent* event) {
  const std::lock_guard guard(state.lock);
  switch (GST_EVENT_TYPE(event)) {
    case GST_EVENT_CAPS: {
      GstCaps* caps = nullptr;
      gst_event_parse_caps(event, &caps);
      state.tracks[pad].takeCaps(caps);
      break;
    }
    case GST_EVENT_TAG: {
      GstTagList* tags = nullptr;
      gst_event_parse_tag(event, &tags);
      mergeTags(state.tags, tags, state.tracks[pad].name);
      break;
    }
    case GST_EVENT_TOC:
      gst_clear_mini_object(reinterpret_cast<GstMiniObject**>(&state.toc));
      gst_event_parse_toc(event, &state.toc, nullptr);
      break;
    default:
      break;
  }
}

gboolean sinkEvent(GstAggregator* aggregator, GstAggregatorPad* pad, GstEvent* event) {
  learn(*self(aggregator)->state, GST_PAD(pad), event);
  return parentClass<GstAggregatorClass>(aggregator)->sink_event(aggregator, pad, event);
}

gboolean start(GstAggregator* aggregator) {
  self(aggregator)->state->reset();
  GstSegment segment;
  gst_segment_init(&segment, GST_FORMAT_BYTES);
  gst_aggregator_update_segment(aggregator, &segment);
  return TRUE;
}

gboolean stop(GstAggregator* aggregator) {
  State& state = *self(aggregator)->state;
  state.reset();
  state.forgetStream();
  gst_tag_setter_reset_tags(GST_TAG_SETTER(aggregator));
  gst_toc_setter_reset(GST_TOC_SETTER(aggregator));
  return TRUE;
}

// What was sent is gone downstream: the file begins anew.
GstFlowReturn flush(GstAggregator* aggregator) {
  start(aggregator);
  return GST_FLOW_OK;
}

// Seeks go to whoever is upstream. The aggregator also applies them to its own segment, which has to be in
// their format for that; it is in bytes again afterwards.
gboolean sourceEvent(GstAggregator* aggregator, GstEvent* event) {
  if (GST_EVENT_TYPE(event) != GST_EVENT_SEEK)
    return parentClass<GstAggregatorClass>(aggregator)->src_event(aggregator, event);
  GstFormat format = GST_FORMAT_TIME;
  gst_event_parse_seek(event, nullptr, &format, nullptr, nullptr, nullptr, nullptr, nullptr);
  GstSegment& segment = GST_AGGREGATOR_PAD(aggregator->srcpad)->segment;
  GST_OBJECT_LOCK(aggregator->srcpad);
  const GstSegment bytes = segment;
  gst_segment_init(&segment, format);
  GST_OBJECT_UNLOCK(aggregator->srcpad);
  const gboolean done = parentClass<GstAggregatorClass>(aggregator)->src_event(aggregator, event);
  GST_OBJECT_LOCK(aggregator->srcpad);
  if (segment.format != GST_FORMAT_BYTES) segment = bytes;
  GST_OBJECT_UNLOCK(aggregator->srcpad);
  return done;
}

void releasePad(GstElement* element, GstPad* pad) {
  State& state = *self(element)->state;
  {
    const std::lock_guard guard(state.lock);
    state.tracks.erase(pad);
  }
  parentClass<GstElementClass>(element)->release_pad(element, pad);
}

enum Property { kParity = 1, kTimes, kTrackNames };

const GEnumValue kTimesValues[] = {
    {static_cast<gint>(MuxTimes::kStream), "Stream time: the times of a file stay what they are", "stream"},
    {static_cast<gint>(MuxTimes::kRunning),
     "Running time: sequences that follow each other continue each other", "running"},
    {0, nullptr, nullptr}};

void setProperty(GObject* object, guint id, const GValue* value, GParamSpec* spec) {
  State& state = *self(object)->state;
  GST_OBJECT_LOCK(object);
  switch (id) {
    case kParity:
      state.parity = g_value_get_uint(value);
      break;
    case kTimes:
      state.times = static_cast<MuxTimes>(g_value_get_enum(value));
      break;
    case kTrackNames:
      state.names = g_value_get_string(value) != nullptr ? g_value_get_string(value) : "";
      break;
    default:
      G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
  }
  GST_OBJECT_UNLOCK(object);
}

void getProperty(GObject* object, guint id, GValue* value, GParamSpec* spec) {
  const State& state = *self(object)->state;
  GST_OBJECT_LOCK(object);
  switch (id) {
    case kParity:
      g_value_set_uint(value, state.parity);
      break;
    case kTimes:
      g_value_set_enum(value, static_cast<gint>(state.times));
      break;
    case kTrackNames:
      g_value_set_string(value, state.names.c_str());
      break;
    default:
      G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
  }
  GST_OBJECT_UNLOCK(object);
}

void finalize(GObject* object) {
  self(object)->state->forgetStream();
  finalizeElement<Element>(object);
}

void initClass(ElementClass* klass) {
  auto* object = G_OBJECT_CLASS(klass);
  object->set_property = setProperty;
  object->get_property = getProperty;
  object->finalize = finalize;
  constexpr auto kFlags =
      static_cast<GParamFlags>(G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS | GST_PARAM_MUTABLE_READY);
  g_object_class_install_property(
      object, kParity,
      g_param_spec_uint(
          "parity", "Parity",
          "Percent of parity, by which 'isoreel repair' restores damage of up to that part of a GOP; 0: "
          "none",
          0, 100, 0, kFlags));
  g_object_class_install_property(
      object, kTimes,
      g_param_spec_enum("times", "Times", "Which times the file gets",
                        g_enum_register_static("GstIsoreelMuxTimes", kTimesValues),
                        static_cast<gint>(MuxTimes::kStream), kFlags));

  g_object_class_install_property(
      object, kTrackNames,
      g_param_spec_string(
          "track-names", "Track names",
          "Names of tracks in the order of the pads: NAME,NAME,...; none: the titles that come with "
          "the streams",
          "", kFlags));

  auto* element = GST_ELEMENT_CLASS(klass);
  element->release_pad = releasePad;
  gst_element_class_set_static_metadata(element, "Isoreel muxer", "Codec/Muxer",
                                        "Writes packets of isosurfaces into an .isr file", "Isoreel");
  GstCaps* packets = gst_caps_from_string(kAnyPacketCaps);
  gst_element_class_add_pad_template(
      element, gst_pad_template_new_with_gtype("sink_%u", GST_PAD_SINK, GST_PAD_REQUEST, packets,
                                               GST_TYPE_AGGREGATOR_PAD));
  gst_caps_unref(packets);
  GstCaps* file = gst_caps_from_string(kFileCaps);
  gst_element_class_add_pad_template(
      element,
      gst_pad_template_new_with_gtype("src", GST_PAD_SRC, GST_PAD_ALWAYS, file, GST_TYPE_AGGREGATOR_PAD));
  gst_caps_unref(file);

  auto* aggregator = GST_AGGREGATOR_CLASS(klass);
  aggregator->aggregate = aggregate;
  aggregator->sink_event = sinkEvent;
  aggregator->src_event = sourceEvent;
  aggregator->start = start;
  aggregator->stop = stop;
  aggregator->flush = flush;
}

void init(Element* element) { element->state = new State; }

}  // namespace

bool registerMux(GstPlugin* plugin) {
  const GType type =
      elementType<Element, ElementClass>(GST_TYPE_AGGREGATOR, "GstIsoreelMux", initClass, init);
  const GInterfaceInfo none{nullptr, nullptr, nullptr};
  g_type_add_interface_static(type, GST_TYPE_TAG_SETTER, &none);
  g_type_add_interface_static(type, GST_TYPE_TOC_SETTER, &none);
  return gst_element_register(plugin, "isoreelmux", GST_RANK_PRIMARY, type) != FALSE;
}

}  // namespace isoreel::gst
