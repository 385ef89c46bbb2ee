// SPDX-License-Identifier: BSD-3-Clause
// What all elements of the plugin share: caps, debug category, errors as element messages.
#pragma once

#include <gst/gst.h>
#include <isoreel/base/bytes.h>
#include <isoreel/base/packet.h>
#include <isoreel/base/status.h>

#include <string>

GST_DEBUG_CATEGORY_EXTERN(isoreel_debug);
#define GST_CAT_DEFAULT isoreel_debug

namespace isoreel::gst {

/// A whole `.isr` file as bytes, front to back.
inline constexpr char kFileCaps[] = "application/x-isoreel";

/// Coded frames, a packet a buffer. Fields: codec_data (configuration record), stream-format=packet, width
/// and height (the grid's first two numbers of nodes; they mean nothing, but players want them above 0),
/// framerate where it is constant, bounding-box (mesh.h) where the file's index tells it, time-base (seconds
/// a tick, where it fits). Buffers: PTS and duration; DTS as PTS; DELTA_UNIT on P packets; DECODE_ONLY on
/// packets that are decoded for those behind them and never shown (hidden ones, and those between a key and
/// where a seek went). Going backward, GOPs come last to first, each front to back, its first buffer with
/// DISCONT.
inline constexpr char kPacketCaps[] = "video/x-isoreel, stream-format = (string) packet";

/// The same, and as the demuxers of other containers that carry ISRL (qtdemux, matroskademux) call it: these
/// have no codec_data, and no guarantee of what comes first.
inline constexpr char kAnyPacketCaps[] =
    "video/x-isoreel, stream-format = (string) packet; video/x-gst-fourcc-ISRL; video/x-unknown, fourcc = "
    "(string) "
    "ISRL";

/// Volumes, a grid of samples a buffer, x fastest, no padding. Fields: format, width, height, depth (nodes
/// along x, y, z); and where they are not the defaults spacing and origin (arrays of 3 doubles), direction
/// (9, row by row), level-set (boolean: inside is below 0), framerate.
inline constexpr char kVolumeCaps[] =
    "application/x-volume, format = (string) { F32LE, F32BE, F64LE, F64BE, U8, S8, U16LE, U16BE, S16LE, "
    "S16BE, "
    "U32LE, U32BE, S32LE, S32BE }, width = (int) [ 2, 65536 ], height = (int) [ 2, 65536 ], depth = (int) [ "
    "2, "
    "65536 ]";

/// Posts `status`, which is not OK, as an element's error message: its text is the one that the command line
/// would print. `place` ("frame 17") comes in front when there is one.
void postError(GstElement* element, const Status& status, const std::string& place = "");
/// The same as a warning, for what is survived.
void postWarning(GstElement* element, const Status& status, const std::string& place = "");

/// A type for an element of C++ functions: `Element` starts with its parent's struct, `Class` with its
/// parent's class struct.
template <class Element, class Class>
GType elementType(GType parent, const char* name, void (*init_class)(Class*), void (*init)(Element*)) {
  static void (*class_function)(Class*) = init_class;
  static void (*function)(Element*) = init;
  const GTypeInfo info{
      sizeof(Class),
      nullptr,
      nullptr,
      [](gpointer klass, gpointer) { class_function(static_cast<Class*>(klass)); },
      nullptr,
      nullptr,
      sizeof(Element),
      0,
      [](GTypeInstance* instance, gpointer) { function(reinterpret_cast<Element*>(instance)); },
      nullptr};
  return g_type_register_static(parent, name, &info, GTypeFlags{});
}

/// The class struct that the methods of a final element's parent are in; `Class` is the parent's.
template <class Class>
Class* parentClass(gpointer element) {
  return static_cast<Class*>(g_type_class_peek_parent(G_OBJECT_GET_CLASS(element)));
}

/// For GObjectClass::finalize of an element that owns its `state`.
template <class Element>
void finalizeElement(GObject* object) {
  delete reinterpret_cast<Element*>(object)->state;
  parentClass<GObjectClass>(object)->finalize(object);
}

/// A pad of the element's template of that name, not yet added; called like its template unless `name` says
/// otherwise.
GstPad* newPad(gpointer element, const char* from_template, const char* name = nullptr);

void addTemplate(GstElementClass* klass, const char* name, GstPadDirection direction, GstPadPresence presence,
                 const char* caps);

/// A buffer that owns `bytes`.
GstBuffer* bufferOf(Bytes bytes);
/// A copy of a buffer's content.
Bytes bytesOf(GstBuffer* buffer);

/// Nanoseconds of `ticks`, rounded to the nearest; GST_CLOCK_TIME_NONE below 0.
GstClockTime toClockTime(std::int64_t ticks, const TimeBase& base);
/// The tick nearest to a time: where a tick is longer than a nanosecond, toClockTime() and back is exact.
std::int64_t toTicks(GstClockTime time, const TimeBase& base);

}  // namespace isoreel::gst
