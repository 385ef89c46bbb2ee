// SPDX-License-Identifier: BSD-3-Clause
/**
 * SECTION:element-isoreelvolumesrc
 *
 * Reads volumes from files of any format that Isoreel knows (OpenVDB, NRRD, NIfTI, MetaImage, VTI, raw +
 * JSON), by what they hold and not by their names.
 *
 * ## Example
 * |[
 * gst-launch-1.0 isoreelvolumesrc location='cache/fluid_data_%04d.vdb' ! isoreelenc ! isoreelmux ! filesink
 * location=splash.isr gst-launch-1.0 isoreelvolumesrc location=ct.nii.gz iso=300,320,340 ! isoreelenc !
 * isoreelmux ! filesink location=ct.isr
 * ]|
 */
#include "volume_src.h"

#include <gst/base/gstpushsrc.h>
#include <isoreel/io/volume_reader.h>

#include <cmath>
#include <numeric>
#include <vector>

#include "frame_meta.h"
#include "numbers.h"
#include "volume_caps.h"

namespace isoreel::gst {
namespace {

// What `open` found: a sequence and when its frames are.
struct VolumeList {
  std::unique_ptr<io::VolumeSequence> volumes;
  std::vector<double> isovalues;  // of a single volume that is given once for each; else empty
  VolumeFormat format;
  TimeBase base;                    // of times
  std::vector<std::int64_t> times;  // one more than frames: the end
  std::shared_ptr<Volume> only;     // the single volume

  std::size_t frames() const { return times.size() - 1; }
  GstClockTime start(std::size_t frame) const { return toClockTime(times[frame], base); }
};

struct Settings {
  std::vector<std::string> locations;
  io::VolumeOptions options;
  std::string isovalues;
  gint rate = 0, per = 1;  // frames a second
};

struct State {
  Settings settings;
  VolumeList list;
  std::size_t next = 0;
};

struct Element {
  GstPushSrc parent;
  State* state;
};
struct ElementClass {
  GstPushSrcClass parent;
};

Element* self(gpointer element) { return static_cast<Element*>(element); }

// Times as the files say, if all do and they rise from 0 or later, in the coarsest unit that holds them to
// the nanosecond, as the command line has it; else at a constant rate.
void findTimes(VolumeList& list, const Settings& settings, std::size_t frames) {
  std::vector<std::int64_t> ticks;
  std::int64_t common = GST_SECOND;
  const bool fixed = settings.rate > 0 || list.volumes->size() != frames || frames < 2;
  for (std::size_t i = 0; i < frames && !fixed; ++i) {
    const std::optional<double> time = list.volumes->time(i);
    if (!time || !(*time >= 0) || *time > 1e9) break;
    ticks.push_back(std::llround(*time * GST_SECOND));
    if (i > 0 && ticks[i] <= ticks[i - 1]) break;
    common = std::gcd(common, ticks.back());
  }
  if (!fixed && ticks.size() == frames && (frames < 2 || ticks[frames - 1] > ticks[frames - 2])) {
    ticks.push_back(2 * ticks[frames - 1] - ticks[frames - 2]);
    list.base = {1, static_cast<std::uint32_t>(GST_SECOND / common)};
    for (const std::int64_t tick : ticks) list.times.push_back(tick / common);
    list.format.time_base = list.base;
    return;
  }
  list.base = settings.rate > 0 ? TimeBase{static_cast<std::uint32_t>(settings.per),
                                           static_cast<std::uint32_t>(settings.rate)}
                                : TimeBase{1, 25};
  list.times.resize(frames + 1);
  std::iota(list.times.begin(), list.times.end(), std::int64_t{0});
  list.format.frame = list.base;
}

Result<VolumeList> openList(const Settings& settings) {
  if (settings.locations.empty()) return {ErrorCode::kInvalidArgument, "location: is not set"};
  VolumeList list;
  ISOREEL_ASSIGN(list.volumes, io::openVolumes(settings.locations, settings.options));
  std::size_t frames = list.volumes->size();
  if (!settings.isovalues.empty()) {
    ISOREEL_ASSIGN(list.isovalues, numbersIn("iso", settings.isovalues));
    if (list.isovalues.size() == 1) list.isovalues.assign(frames, list.isovalues[0]);
    if (frames == 1) frames = list.isovalues.size();
    if (list.isovalues.size() != frames) {
      return {ErrorCode::kInvalidArgument,
              "iso: " + std::to_string(list.isovalues.size()) + " values for " + std::to_string(frames) +
                  " volumes: give one, one each, or several for a single volume"};
    }
  }
  list.format.grid = list.volumes->grid();
  list.format.order = std::endian::native;
  list.format.level_set = list.volumes->levelSet();
  findTimes(list, settings, frames);
  return list;
}

gboolean start(GstBaseSrc* source) {
  State& state = *self(source)->state;
  GST_OBJECT_LOCK(source);
  const Settings settings = state.settings;
  GST_OBJECT_UNLOCK(source);
  Result<VolumeList> list = openList(settings);
  if (!list) {
    postError(GST_ELEMENT(source), list.status());
    return FALSE;
  }
  state.list = *std::move(list);
  state.next = 0;
  source->segment.duration = state.list.start(state.list.frames());
  GstCaps* caps = volumeCaps(state.list.format);
  const gboolean done = gst_base_src_set_caps(source, caps);
  gst_caps_unref(caps);
  return done;
}

gboolean stop(GstBaseSrc* source) {
  self(source)->state->list = {};
  return TRUE;
}

gboolean negotiate(GstBaseSrc*) { return TRUE; }  // start() said what there is

gboolean isSeekable(GstBaseSrc*) { return TRUE; }

// To the frame that is shown at the segment's start.
gboolean doSeek(GstBaseSrc* source, GstSegment* segment) {
  State& state = *self(source)->state;
  if (segment->rate < 0) return FALSE;
  std::size_t frame = 0;
  while (frame + 1 < state.list.frames() && state.list.start(frame + 1) <= segment->start) ++frame;
  state.next = frame;
  segment->position = state.list.start(frame);
  return TRUE;
}

gboolean query(GstBaseSrc* source, GstQuery* request) {
  const VolumeList& list = self(source)->state->list;
  if (GST_QUERY_TYPE(request) == GST_QUERY_DURATION && list.volumes) {
    GstFormat format = GST_FORMAT_UNDEFINED;
    gst_query_parse_duration(request, &format, nullptr);
    if (format == GST_FORMAT_TIME || format == GST_FORMAT_DEFAULT) {
      const auto frames = static_cast<gint64>(list.frames());
      gst_query_set_duration(request, format,
                             format == GST_FORMAT_DEFAULT
                                 ? frames
                                 : static_cast<gint64>(list.start(list.frames()) - list.start(0)));
      return TRUE;
    }
  }
  return parentClass<GstBaseSrcClass>(source)->query(source, request);
}

Result<Volume> read(VolumeList& list, std::size_t frame) {
  if (list.only) return *list.only;
  const bool single = list.volumes->size() == 1;
  ISOREEL_ASSIGN(Volume volume, list.volumes->read(single ? 0 : frame));
  if (single) list.only = std::make_shared<Volume>(volume);
  return volume;
}

GstFlowReturn create(GstPushSrc* source, GstBuffer** buffer) {
  State& state = *self(source)->state;
  VolumeList& list = state.list;
  const std::size_t frame = state.next;
  const GstSegment& segment = GST_BASE_SRC(source)->segment;
  if (frame >= list.frames() || (segment.stop != GST_CLOCK_TIME_NONE && list.start(frame) >= segment.stop))
    return GST_FLOW_EOS;
  const Result<Volume> volume = read(list, frame);
  if (!volume) {
    postError(GST_ELEMENT(source), volume.status());
    return GST_FLOW_ERROR;
  }
  *buffer = bufferOf(*volume);
  GST_BUFFER_PTS(*buffer) = list.start(frame);
  GST_BUFFER_DURATION(*buffer) = list.start(frame + 1) - list.start(frame);
  GST_BUFFER_OFFSET(*buffer) = frame;
  GST_BUFFER_OFFSET_END(*buffer) = frame + 1;
  if (!list.isovalues.empty()) addIsovalue(*buffer, list.isovalues[frame]);
  ++state.next;
  return GST_FLOW_OK;
}

enum Property { kLocation = 1, kLocations, kArray, kIso, kFps };

void setProperty(GObject* object, guint id, const GValue* value, GParamSpec* spec) {
  Settings& settings = self(object)->state->settings;
  const auto text = [&] {
    return std::string(g_value_get_string(value) != nullptr ? g_value_get_string(value) : "");
  };
  GST_OBJECT_LOCK(object);
  switch (id) {
    case kLocation:
      settings.locations.clear();
      if (!text().empty()) settings.locations.push_back(text());
      break;
    case kLocations:
      settings.locations.clear();
      if (auto* const* names = static_cast<gchar**>(g_value_get_boxed(value))) {
        for (; *names != nullptr; ++names) settings.locations.emplace_back(*names);
      }
      break;
    case kArray:
      settings.options.array = text();
      break;
    case kIso:
      settings.isovalues = text();
      break;
    case kFps:
      settings.rate = gst_value_get_fraction_numerator(value);
      settings.per = gst_value_get_fraction_denominator(value);
      break;
    default:
      G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
  }
  GST_OBJECT_UNLOCK(object);
}

void getProperty(GObject* object, guint id, GValue* value, GParamSpec* spec) {
  const Settings& settings = self(object)->state->settings;
  GST_OBJECT_LOCK(object);
  switch (id) {
    case kLocation:
      g_value_set_string(value, settings.locations.empty() ? nullptr : settings.locations.front().c_str());
      break;
    case kLocations: {
      auto** names = g_new0(gchar*, settings.locations.size() + 1);
      for (std::size_t i = 0; i < settings.locations.size(); ++i)
        names[i] = g_strdup(settings.locations[i].c_str());
      g_value_take_boxed(value, names);
      break;
    }
    case kArray:
      g_value_set_string(value, settings.options.array.c_str());
      break;
    case kIso:
      g_value_set_string(value, settings.isovalues.c_str());
      break;
    case kFps:
      gst_value_set_fraction(value, settings.rate, settings.per);
      break;
    default:
      G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
  }
  GST_OBJECT_UNLOCK(object);
}

void initClass(ElementClass* klass) {
  auto* object = G_OBJECT_CLASS(klass);
  object->set_property = setProperty;
  object->get_property = getProperty;
  object->finalize = finalizeElement<Element>;
  const auto flags =
      static_cast<GParamFlags>(G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS | GST_PARAM_MUTABLE_READY);
  g_object_class_install_property(
      object, kLocation,
      g_param_spec_string(
          "location", "Location",
          "A volume file, a 4-D file, a folder, or a pattern such as frame_%04d.vdb or frame_*.vdb", nullptr,
          flags));
  g_object_class_install_property(
      object, kLocations,
      g_param_spec_boxed("locations", "Locations", "Several of these in order, instead of location",
                         G_TYPE_STRV, flags));
  g_object_class_install_property(
      object, kArray,
      g_param_spec_string(
          "array", "Array",
          "The array (VTI) or grid (OpenVDB) to read in files that hold several; none: the only "
          "scalar one, or OpenVDB's only level set",
          "", flags));
  g_object_class_install_property(
      object, kIso,
      g_param_spec_string(
          "iso", "Isovalues",
          "Isovalue for the encoder: V, or V,V,... with one for each volume, or several for a single "
          "volume, which is then a frame for each; none: the encoder knows",
          "", flags));
  g_object_class_install_property(
      object, kFps,
      gst_param_spec_fraction("fps", "Frames a second", "0: the times in the files, or else 25", 0, 1,
                              G_MAXINT, 1, 0, 1, flags));

  auto* element = GST_ELEMENT_CLASS(klass);
  gst_element_class_set_static_metadata(element, "Isoreel volume source", "Source/File",
                                        "Reads volumes (OpenVDB, NRRD, NIfTI, MetaImage, VTI, raw + JSON)",
                                        "Isoreel");
  addTemplate(element, "src", GST_PAD_SRC, GST_PAD_ALWAYS, kVolumeCaps);
  auto* source = GST_BASE_SRC_CLASS(klass);
  source->start = start;
  source->stop = stop;
  source->negotiate = negotiate;
  source->is_seekable = isSeekable;
  source->do_seek = doSeek;
  source->query = query;
  GST_PUSH_SRC_CLASS(klass)->create = create;
}

void init(Element* element) {
  element->state = new State;
  gst_base_src_set_format(GST_BASE_SRC(element), GST_FORMAT_TIME);
}

}  // namespace

bool registerVolumeSource(GstPlugin* plugin) {
  const GType type =
      elementType<Element, ElementClass>(GST_TYPE_PUSH_SRC, "GstIsoreelVolumeSrc", initClass, init);
  return gst_element_register(plugin, "isoreelvolumesrc", GST_RANK_NONE, type) != FALSE;
}

}  // namespace isoreel::gst
