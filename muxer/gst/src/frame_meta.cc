// SPDX-License-Identifier: BSD-3-Clause
#include "frame_meta.h"

#include <type_traits>

namespace isoreel::gst {
namespace {

// A GstMeta that holds a plain value, under a name of its own.
template <class Value>
struct ValueMeta {
  static_assert(std::is_trivially_copyable_v<Value>);
  GstMeta meta;
  Value value;

  static gboolean init(GstMeta* meta, gpointer, GstBuffer*) {
    reinterpret_cast<ValueMeta*>(meta)->value = Value{};
    return TRUE;
  }
  // Copies of a buffer keep it; parts of one do not.
  static gboolean transform(GstBuffer* to, GstMeta* meta, GstBuffer*, GQuark type, gpointer data) {
    if (!GST_META_TRANSFORM_IS_COPY(type) || static_cast<GstMetaTransformCopy*>(data)->region) return FALSE;
    auto* copy = gst_buffer_add_meta(to, meta->info, nullptr);
    reinterpret_cast<ValueMeta*>(copy)->value = reinterpret_cast<ValueMeta*>(meta)->value;
    return TRUE;
  }
  static const GstMetaInfo* registered(const char* api, const char* implementation) {
    static const gchar* no_tags[] = {nullptr};
    const GType type = gst_meta_api_type_register(api, no_tags);
    return gst_meta_register(type, implementation, sizeof(ValueMeta), init, nullptr, transform);
  }
};

using HeaderMeta = ValueMeta<FrameHeader>;
using IsovalueMeta = ValueMeta<double>;

const GstMetaInfo* headerInfo() {
  static const GstMetaInfo* info = HeaderMeta::registered("GstIsoreelFrameMetaAPI", "GstIsoreelFrameMeta");
  return info;
}

const GstMetaInfo* isovalueInfo() {
  static const GstMetaInfo* info =
      IsovalueMeta::registered("GstIsoreelIsovalueMetaAPI", "GstIsoreelIsovalueMeta");
  return info;
}

}  // namespace

void addFrameHeader(GstBuffer* buffer, const FrameHeader& header) {
  reinterpret_cast<HeaderMeta*>(gst_buffer_add_meta(buffer, headerInfo(), nullptr))->value = header;
}

const FrameHeader* frameHeader(GstBuffer* buffer) {
  GstMeta* meta = gst_buffer_get_meta(buffer, headerInfo()->api);
  return meta != nullptr ? &reinterpret_cast<HeaderMeta*>(meta)->value : nullptr;
}

void addIsovalue(GstBuffer* buffer, double isovalue) {
  reinterpret_cast<IsovalueMeta*>(gst_buffer_add_meta(buffer, isovalueInfo(), nullptr))->value = isovalue;
}

const double* isovalue(GstBuffer* buffer) {
  GstMeta* meta = gst_buffer_get_meta(buffer, isovalueInfo()->api);
  return meta != nullptr ? &reinterpret_cast<IsovalueMeta*>(meta)->value : nullptr;
}

}  // namespace isoreel::gst
