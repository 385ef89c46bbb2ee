// SPDX-License-Identifier: BSD-3-Clause
#include "common.h"

namespace isoreel::gst {
namespace {

struct Domain {
  GQuark domain;
  gint code;
};

Domain domainOf(ErrorCode code) {
  switch (code) {
    case ErrorCode::kIo:
      return {GST_RESOURCE_ERROR, GST_RESOURCE_ERROR_READ};
    case ErrorCode::kNotFound:
      return {GST_RESOURCE_ERROR, GST_RESOURCE_ERROR_NOT_FOUND};
    case ErrorCode::kInvalidArgument:
      return {GST_LIBRARY_ERROR, GST_LIBRARY_ERROR_SETTINGS};
    case ErrorCode::kUnsupported:
      return {GST_STREAM_ERROR, GST_STREAM_ERROR_NOT_IMPLEMENTED};
    case ErrorCode::kBadData:
    case ErrorCode::kTruncated:
    case ErrorCode::kLimit:
      break;
  }
  return {GST_STREAM_ERROR, GST_STREAM_ERROR_DECODE};
}

void post(GstElement* element, GstMessageType type, const Status& status, const std::string& place) {
  const Status placed = place.empty() ? status : status.at(place);
  const auto [domain, code] = domainOf(status.error().code);
  gst_element_message_full(element, type, domain, code, g_strdup(placed.error().message.c_str()), nullptr,
                           __FILE__, GST_FUNCTION, __LINE__);
}

}  // namespace

void postError(GstElement* element, const Status& status, const std::string& place) {
  post(element, GST_MESSAGE_ERROR, status, place);
}

void postWarning(GstElement* element, const Status& status, const std::string& place) {
  post(element, GST_MESSAGE_WARNING, status, place);
}

GstPad* newPad(gpointer element, const char* from_template, const char* name) {
  GstPadTemplate* pad_template =
      gst_element_class_get_pad_template(GST_ELEMENT_GET_CLASS(element), from_template);
  return gst_pad_new_from_template(pad_template, name != nullptr ? name : from_template);
}

void addTemplate(GstElementClass* klass, const char* name, GstPadDirection direction, GstPadPresence presence,
                 const char* caps) {
  GstCaps* parsed = gst_caps_from_string(caps);
  gst_element_class_add_pad_template(klass, gst_pad_template_new(name, direction, presence, parsed));
  gst_caps_unref(parsed);
}

GstBuffer* bufferOf(Bytes bytes) {
  auto* kept = new Bytes(std::move(bytes));
  const auto release = [](gpointer data) { delete static_cast<Bytes*>(data); };
  return gst_buffer_new_wrapped_full(GST_MEMORY_FLAG_READONLY, kept->data(), kept->size(), 0, kept->size(),
                                     kept, release);
}

Bytes bytesOf(GstBuffer* buffer) {
  Bytes bytes(gst_buffer_get_size(buffer));
  gst_buffer_extract(buffer, 0, bytes.data(), bytes.size());
  return bytes;
}

GstClockTime toClockTime(std::int64_t ticks, const TimeBase& base) {
  if (ticks < 0) return GST_CLOCK_TIME_NONE;
  return gst_util_uint64_scale_round(static_cast<guint64>(ticks), std::uint64_t{base.numerator} * GST_SECOND,
                                     base.denominator);
}

std::int64_t toTicks(GstClockTime time, const TimeBase& base) {
  return static_cast<std::int64_t>(
      gst_util_uint64_scale_round(time, base.denominator, std::uint64_t{base.numerator} * GST_SECOND));
}

}  // namespace isoreel::gst
