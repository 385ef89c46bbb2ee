// SPDX-License-Identifier: BSD-3-Clause
/**
 * SECTION:element-isoreelrender
 *
 * Draws triangle meshes (`model/x-triangle-mesh`, as isoreeldec gives them) by ray casting, at the size and
 * pixel shape that the next element asks for, 640 x 480 if it does not care. The camera's properties can be
 * controlled (gst_object_add_control_binding()), and the mouse turns and magnifies: drag, wheel. The camera
 * looks at the box of the whole sequence where the caps tell it (bounding-box, six numbers), else at that of
 * the first surface.
 *
 * When pictures come late, drafts are drawn, without ambient light and with a ray a pixel; only when that
 * does not help the decoder is asked for less.
 *
 * ## Example
 * |[
 * gst-launch-1.0 filesrc location=splash.isr ! isoreeldemux ! isoreeldec ! isoreelrender azimuth=60
 * overlay=true ! video/x-raw,width=1280,height=720 ! videoconvert ! x264enc ! mp4mux ! filesink
 * location=splash.mp4
 * ]|
 */
#include "render.h"

#include <gst/base/gstbasetransform.h>
#include <gst/video/video.h>
#include <isoreel/inspect/render.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <new>

#include "lateness.h"
#include "mesh.h"
#include "navigation.h"

namespace isoreel::gst {
namespace {

enum Property : guint {
  kAzimuth = 16,
  kElevation,
  kFieldOfView,
  kZoom,
  kTurning,
  kSamples,
  kAmbient,
  kSmooth,
  kWireframe,
  kOverlay,
  kDrafts
};

struct Settings {
  inspect::Camera camera{.turning = true};
  gint samples = 4;
  gboolean ambient = TRUE, smooth = TRUE, wireframe = FALSE, overlay = FALSE, drafts = TRUE;
};

struct State {
  // Behind the object's lock.
  Settings settings;
  Lateness lateness;
  Drag drag;
  GstVideoInfo info{};

  inspect::Box box;  // the streaming thread's: what the camera looks at; empty: not known yet
};

struct Element {
  GstBaseTransform parent;
  State* state;
};
struct ElementClass {
  GstBaseTransformClass parent;
};

Element* self(gpointer element) { return static_cast<Element*>(element); }

// Pictures follow each other as meshes do.
GstCaps* transformCaps(GstBaseTransform*, GstPadDirection direction, GstCaps* caps, GstCaps* filter) {
  GstCaps* result = gst_caps_from_string(direction == GST_PAD_SINK ? kPictureCaps : kMeshCaps);
  const GValue* rate = gst_caps_get_size(caps) == 1
                           ? gst_structure_get_value(gst_caps_get_structure(caps, 0), "framerate")
                           : nullptr;
  if (direction == GST_PAD_SINK && rate != nullptr) gst_caps_set_value(result, "framerate", rate);
  if (filter == nullptr) return result;
  GstCaps* both = gst_caps_intersect_full(filter, result, GST_CAPS_INTERSECT_FIRST);
  gst_caps_unref(result);
  return both;
}

// What the next element leaves open: square pixels, 480 lines, as wide as makes it 4:3.
GstCaps* fixateCaps(GstBaseTransform*, GstPadDirection, GstCaps*, GstCaps* caps) {
  caps = gst_caps_make_writable(gst_caps_truncate(caps));
  GstStructure* fields = gst_caps_get_structure(caps, 0);
  if (gst_structure_has_field(fields, "pixel-aspect-ratio"))
    gst_structure_fixate_field_nearest_fraction(fields, "pixel-aspect-ratio", 1, 1);
  gint x = 1, y = 1, width = 0;
  gst_structure_get_fraction(fields, "pixel-aspect-ratio", &x, &y);
  const double wide = 4.0 / 3 * y / std::max(x, 1);  // pixels in a row for each line
  if (gst_structure_get_int(fields, "width", &width)) {
    gst_structure_fixate_field_nearest_int(fields, "height", std::max(static_cast<gint>(width / wide), 1));
  } else {
    gint height = 480;
    gst_structure_fixate_field_nearest_int(fields, "height", height);
    gst_structure_get_int(fields, "height", &height);
    gst_structure_fixate_field_nearest_int(fields, "width",
                                           static_cast<gint>(std::lround(std::min(height * wide, 16384.0))));
  }
  gst_structure_fixate_field_nearest_fraction(fields, "framerate", 0, 1);
  return gst_caps_fixate(caps);
}

gboolean setCaps(GstBaseTransform* base, GstCaps* meshes, GstCaps* pictures) {
  State& state = *self(base)->state;
  GstVideoInfo info;
  if (!gst_video_info_from_caps(&info, pictures)) return FALSE;
  GST_OBJECT_LOCK(base);
  state.info = info;
  GST_OBJECT_UNLOCK(base);
  if (const inspect::Box box = boundingBoxOf(meshes); !box.empty()) state.box = box;
  return TRUE;
}

gboolean transformSize(GstBaseTransform*, GstPadDirection direction, GstCaps*, gsize, GstCaps* pictures,
                       gsize* size) {
  GstVideoInfo info;
  if (direction != GST_PAD_SINK || !gst_video_info_from_caps(&info, pictures)) return FALSE;
  *size = info.size;
  return TRUE;
}

// Which frame a picture is of stays known.
gboolean transformMeta(GstBaseTransform* base, GstBuffer* to, GstMeta* meta, GstBuffer* from) {
  if (gst_meta_info_is_custom(meta->info) &&
      gst_custom_meta_has_name(reinterpret_cast<GstCustomMeta*>(meta), kSurfaceMeta))
    return TRUE;
  return parentClass<GstBaseTransformClass>(base)->transform_meta(base, to, meta, from);
}

/// Brings controlled properties to the time of the buffer.
void beforeTransform(GstBaseTransform* base, GstBuffer* buffer) {
  const GstClockTime time =
      gst_segment_to_stream_time(&base->segment, base->segment.format, GST_BUFFER_PTS(buffer));
  if (!GST_CLOCK_TIME_IS_VALID(time)) return;
  gst_object_sync_values(GST_OBJECT(base), time);
  // isoreelvideodec's, too, which come here: a bin's are brought to a time by nobody else.
  GstObject* bin = gst_object_get_parent(GST_OBJECT(base));
  if (bin == nullptr) return;
  if (g_object_class_find_property(G_OBJECT_GET_CLASS(bin), "azimuth") != nullptr)
    gst_object_sync_values(bin, time);
  gst_object_unref(bin);
}

std::string captionOf(GstBuffer* buffer, GstClockTime time) {
  std::string text;
  if (const auto facts = surfaceFacts(buffer)) text = "frame " + std::to_string(facts->frame);
  if (!GST_CLOCK_TIME_IS_VALID(time)) return text;
  char seconds[48];
  std::snprintf(seconds, sizeof seconds, "%s%.3f s", text.empty() ? "" : "   ",
                static_cast<double>(time) / static_cast<double>(GST_SECOND));
  return text + seconds;
}

inspect::RenderSettings settingsFor(Element* element, GstClockTime running, bool& overlay,
                                    GstVideoInfo& info) {
  State& state = *element->state;
  inspect::RenderSettings result;
  GST_OBJECT_LOCK(element);
  const Settings& settings = state.settings;
  const bool draft =
      settings.drafts && GST_CLOCK_TIME_IS_VALID(running) && state.lateness.degree(running) > 0;
  info = state.info;
  result.camera = settings.camera;
  result.samples = draft ? 1 : settings.samples;
  result.ambient = settings.ambient && !draft;
  result.smooth = settings.smooth;
  result.wireframe = settings.wireframe;
  overlay = settings.overlay;
  GST_OBJECT_UNLOCK(element);
  result.width = GST_VIDEO_INFO_WIDTH(&info);
  result.height = GST_VIDEO_INFO_HEIGHT(&info);
  result.pixel_aspect = static_cast<double>(GST_VIDEO_INFO_PAR_N(&info)) / GST_VIDEO_INFO_PAR_D(&info);
  return result;
}

bool copyTo(GstBuffer* buffer, const GstVideoInfo& info, const inspect::Image& image) {
  GstVideoFrame frame;
  if (!gst_video_frame_map(&frame, &info, buffer, GST_MAP_WRITE)) return false;
  const auto bytes = static_cast<std::size_t>(image.width) * 4;
  auto* row = static_cast<guint8*>(GST_VIDEO_FRAME_PLANE_DATA(&frame, 0));
  for (std::size_t y = 0; y < static_cast<std::size_t>(image.height);
       ++y, row += GST_VIDEO_FRAME_PLANE_STRIDE(&frame, 0))
    std::memcpy(row, &image.pixels[y * bytes], bytes);
  gst_video_frame_unmap(&frame);
  return true;
}

GstFlowReturn transform(GstBaseTransform* base, GstBuffer* in, GstBuffer* out) {
  Element* element = self(base);
  State& state = *element->state;
  const Result<MappedMesh> mesh = MappedMesh::map(in);
  if (!mesh) {
    postError(GST_ELEMENT(base), mesh.status());
    return GST_FLOW_ERROR;
  }
  const inspect::TriangleView triangles{mesh->points(), mesh->triangles()};
  if (state.box.empty()) state.box = inspect::boundingBox(triangles);
  const GstClockTime time = GST_BUFFER_PTS(in);
  bool overlay = false;
  GstVideoInfo info;
  inspect::RenderSettings settings = settingsFor(
      element, gst_segment_to_running_time(&base->segment, base->segment.format, time), overlay, info);
  settings.frame = state.box;
  try {
    inspect::Image image = inspect::render(triangles, settings, [](std::size_t count, const auto& body) {
      tbb::parallel_for(std::size_t{0}, count, body);
    });
    if (overlay) {
      inspect::drawCaption(
          captionOf(in, gst_segment_to_stream_time(&base->segment, base->segment.format, time)), image);
    }
    if (copyTo(out, info, image)) return GST_FLOW_OK;
  } catch (const std::bad_alloc&) {
    GST_DEBUG_OBJECT(base, "Embree found no memory");
  }
  GST_ELEMENT_ERROR(base, RESOURCE, NO_SPACE_LEFT, ("No memory for a picture"), (nullptr));
  return GST_FLOW_ERROR;
}

gboolean sinkEvent(GstBaseTransform* base, GstEvent* event) {
  State& state = *self(base)->state;
  if (GST_EVENT_TYPE(event) == GST_EVENT_FLUSH_STOP) {
    GST_OBJECT_LOCK(base);
    state.lateness = {};
    GST_OBJECT_UNLOCK(base);
  }
  if (GST_EVENT_TYPE(event) == GST_EVENT_STREAM_START) state.box = {};
  return parentClass<GstBaseTransformClass>(base)->sink_event(base, event);
}

/// Whether the event was a mouse's and is dealt with.
bool navigate(Element* element, GstEvent* event) {
  State& state = *element->state;
  GST_OBJECT_LOCK(element);
  const Change change =
      state.drag.handle(event, GST_VIDEO_INFO_WIDTH(&state.info), GST_VIDEO_INFO_HEIGHT(&state.info));
  inspect::Camera& camera = state.settings.camera;
  camera.azimuth = std::remainder(camera.azimuth + change.azimuth, 360);
  camera.elevation = std::clamp(camera.elevation + change.elevation, -90.0, 90.0);
  camera.zoom = std::clamp(camera.zoom * change.zoom, 0.01, 100.0);
  GST_OBJECT_UNLOCK(element);
  for (const char* property : {"azimuth", "elevation", "zoom"}) {
    if (change.any()) g_object_notify(G_OBJECT(element), property);
  }
  return change.handled;
}

gboolean sourceEvent(GstBaseTransform* base, GstEvent* event) {
  State& state = *self(base)->state;
  bool done = false;
  if (GST_EVENT_TYPE(event) == GST_EVENT_NAVIGATION) done = navigate(self(base), event);
  if (GST_EVENT_TYPE(event) == GST_EVENT_QOS) {
    GstClockTimeDiff late = 0;
    GstClockTime time = 0;
    gst_event_parse_qos(event, nullptr, nullptr, &late, &time);
    GST_OBJECT_LOCK(base);
    done = state.settings.drafts && state.lateness.report(time, late, 1);
    GST_OBJECT_UNLOCK(base);
  }
  if (!done) return parentClass<GstBaseTransformClass>(base)->src_event(base, event);
  gst_event_unref(event);
  return TRUE;
}

gboolean start(GstBaseTransform* base) {
  State& state = *self(base)->state;
  state.box = {};
  GST_OBJECT_LOCK(base);
  state.lateness = {};
  state.drag = {};
  GST_OBJECT_UNLOCK(base);
  return TRUE;
}

double* number(Settings& settings, guint id) {
  switch (id) {
    case kAzimuth:
      return &settings.camera.azimuth;
    case kElevation:
      return &settings.camera.elevation;
    case kFieldOfView:
      return &settings.camera.field_of_view;
    case kZoom:
      return &settings.camera.zoom;
    default:
      return nullptr;
  }
}

gboolean* flag(Settings& settings, guint id) {
  switch (id) {
    case kAmbient:
      return &settings.ambient;
    case kSmooth:
      return &settings.smooth;
    case kWireframe:
      return &settings.wireframe;
    case kOverlay:
      return &settings.overlay;
    case kDrafts:
      return &settings.drafts;
    default:
      return nullptr;
  }
}

void setProperty(GObject* object, guint id, const GValue* value, GParamSpec*) {
  Settings& settings = self(object)->state->settings;
  GST_OBJECT_LOCK(object);
  if (double* x = number(settings, id)) *x = g_value_get_double(value);
  if (gboolean* x = flag(settings, id)) *x = g_value_get_boolean(value);
  if (id == kTurning) settings.camera.turning = g_value_get_boolean(value) != FALSE;
  if (id == kSamples) settings.samples = g_value_get_int(value);
  GST_OBJECT_UNLOCK(object);
}

void getProperty(GObject* object, guint id, GValue* value, GParamSpec*) {
  Settings& settings = self(object)->state->settings;
  GST_OBJECT_LOCK(object);
  if (const double* x = number(settings, id)) g_value_set_double(value, *x);
  if (const gboolean* x = flag(settings, id)) g_value_set_boolean(value, *x);
  if (id == kTurning) g_value_set_boolean(value, settings.camera.turning);
  if (id == kSamples) g_value_set_int(value, settings.samples);
  GST_OBJECT_UNLOCK(object);
}

void initClass(ElementClass* klass) {
  GObjectClass* object = G_OBJECT_CLASS(klass);
  object->set_property = setProperty;
  object->get_property = getProperty;
  object->finalize = finalizeElement<Element>;
  installRendererProperties(object);
  GstElementClass* element = GST_ELEMENT_CLASS(klass);
  gst_element_class_set_static_metadata(element, "Isosurface renderer", "Filter/Converter/Video",
                                        "Draws triangle meshes by ray casting", "Isoreel");
  addTemplate(element, "sink", GST_PAD_SINK, GST_PAD_ALWAYS, kMeshCaps);
  addTemplate(element, "src", GST_PAD_SRC, GST_PAD_ALWAYS, kPictureCaps);
  GstBaseTransformClass* base = GST_BASE_TRANSFORM_CLASS(klass);
  base->start = start;
  base->transform_caps = transformCaps;
  base->fixate_caps = fixateCaps;
  base->set_caps = setCaps;
  base->transform_size = transformSize;
  base->transform_meta = transformMeta;
  base->before_transform = beforeTransform;
  base->transform = transform;
  base->sink_event = sinkEvent;
  base->src_event = sourceEvent;
}

void init(Element* element) {
  element->state = new State;
  gst_video_info_init(&element->state->info);
}

}  // namespace

void installRendererProperties(GObjectClass* klass) {
  constexpr auto kFlags = static_cast<GParamFlags>(G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS |
                                                   GST_PARAM_CONTROLLABLE | GST_PARAM_MUTABLE_PLAYING);
  const Settings defaults;
  const auto number = [&](guint id, const char* name, const char* nick, const char* text, double least,
                          double most, double value) {
    g_object_class_install_property(klass, id,
                                    g_param_spec_double(name, nick, text, least, most, value, kFlags));
  };
  const auto flag = [&](guint id, const char* name, const char* nick, const char* text, gboolean value) {
    g_object_class_install_property(klass, id, g_param_spec_boolean(name, nick, text, value, kFlags));
  };
  const inspect::Camera& camera = defaults.camera;
  number(kAzimuth, "azimuth", "Azimuth",
         "Of the camera around the world's z axis, in degrees; 0 looks along y, 90 against x", -360, 360,
         camera.azimuth);
  number(kElevation, "elevation", "Elevation", "Of the camera above the horizon, in degrees", -90, 90,
         camera.elevation);
  number(kFieldOfView, "field-of-view", "Field of view", "Of the picture's shorter side, in degrees", 1, 150,
         camera.field_of_view);
  number(kZoom, "zoom", "Zoom", "Magnifies; at 1 the box fits the picture", 0.01, 100, camera.zoom);
  flag(kTurning, "turning", "Turning",
       "Fit the box turned all the way around its vertical axis, so that azimuth does not change its size",
       camera.turning);
  g_object_class_install_property(
      klass, kSamples,
      g_param_spec_int("samples", "Samples",
                       "Rays a pixel that has an edge in it (rounded to a square number)", 1, 64,
                       defaults.samples, kFlags));
  flag(kAmbient, "ambient", "Ambient light",
       "Light from all of the sky and what keeps it away: most of the time", defaults.ambient);
  flag(kSmooth, "smooth", "Smooth", "Interpolate normals; facets otherwise", defaults.smooth);
  flag(kWireframe, "wireframe", "Wireframe", "Draw the triangles' edges", defaults.wireframe);
  flag(kOverlay, "overlay", "Overlay", "Write the frame's number and time into the picture",
       defaults.overlay);
  flag(kDrafts, "drafts", "Drafts",
       "When pictures come late, draw drafts before the decoder is asked for less", defaults.drafts);
}

GType rendererType() {
  static const GType type =
      elementType<Element, ElementClass>(GST_TYPE_BASE_TRANSFORM, "GstIsoreelRender", initClass, init);
  return type;
}

bool registerRenderer(GstPlugin* plugin) {
  return gst_element_register(plugin, "isoreelrender", GST_RANK_NONE, rendererType());
}

}  // namespace isoreel::gst
