// SPDX-License-Identifier: BSD-3-Clause
#include "volume_caps.h"

#include <cstring>
#include <vector>

namespace isoreel::gst {
namespace {

struct FormatRow {
  const char* name;
  io::ScalarType type;
  std::endian order;
};

constexpr FormatRow kFormats[] = {
    {"F32LE", io::ScalarType::kFloat32, std::endian::little},
    {"F32BE", io::ScalarType::kFloat32, std::endian::big},
    {"F64LE", io::ScalarType::kFloat64, std::endian::little},
    {"F64BE", io::ScalarType::kFloat64, std::endian::big},
    {"U8", io::ScalarType::kUint8, std::endian::little},
    {"S8", io::ScalarType::kInt8, std::endian::little},
    {"U16LE", io::ScalarType::kUint16, std::endian::little},
    {"U16BE", io::ScalarType::kUint16, std::endian::big},
    {"S16LE", io::ScalarType::kInt16, std::endian::little},
    {"S16BE", io::ScalarType::kInt16, std::endian::big},
    {"U32LE", io::ScalarType::kUint32, std::endian::little},
    {"U32BE", io::ScalarType::kUint32, std::endian::big},
    {"S32LE", io::ScalarType::kInt32, std::endian::little},
    {"S32BE", io::ScalarType::kInt32, std::endian::big},
};

void setArray(GstStructure* structure, const char* field, std::span<const double> values) {
  GValue array = G_VALUE_INIT, element = G_VALUE_INIT;
  gst_value_array_init(&array, static_cast<guint>(values.size()));
  g_value_init(&element, G_TYPE_DOUBLE);
  for (const double value : values) {
    g_value_set_double(&element, value);
    gst_value_array_append_value(&array, &element);
  }
  gst_structure_take_value(structure, field, &array);
}

// Leaves `values` as they are when the field is not there. Numbers of any type count: people write <1,1,2>.
Status getArray(const GstStructure* structure, const char* field, std::span<double> values) {
  const GValue* array = gst_structure_get_value(structure, field);
  if (array == nullptr) return {};
  Status bad(ErrorCode::kInvalidArgument, std::string("caps: ") + field + " is not an array of " +
                                              std::to_string(values.size()) + " numbers");
  if (!GST_VALUE_HOLDS_ARRAY(array) || gst_value_array_get_size(array) != values.size()) return bad;
  for (std::size_t i = 0; i < values.size(); ++i) {
    GValue number = G_VALUE_INIT;
    g_value_init(&number, G_TYPE_DOUBLE);
    if (!g_value_transform(gst_value_array_get_value(array, static_cast<guint>(i)), &number)) return bad;
    values[i] = g_value_get_double(&number);
  }
  return {};
}

std::optional<TimeBase> fraction(const GstStructure* structure, const char* field) {
  gint numerator = 0, denominator = 0;
  if (!gst_structure_get_fraction(structure, field, &numerator, &denominator)) return {};
  if (numerator <= 0 || denominator <= 0) return {};
  return TimeBase{static_cast<std::uint32_t>(numerator), static_cast<std::uint32_t>(denominator)};
}

bool fitsCaps(const TimeBase& base) { return base.numerator <= G_MAXINT && base.denominator <= G_MAXINT; }

}  // namespace

GstCaps* volumeCaps(const VolumeFormat& format) {
  const char* name = "";
  for (const FormatRow& row : kFormats) {
    if (row.type == format.type && (row.order == format.order || io::scalarBytes(row.type) == 1))
      name = row.name;
  }
  const auto& nodes = format.grid.nodes;
  GstCaps* caps =
      gst_caps_new_simple("application/x-volume", "format", G_TYPE_STRING, name, "width", G_TYPE_INT,
                          static_cast<gint>(nodes[0]), "height", G_TYPE_INT, static_cast<gint>(nodes[1]),
                          "depth", G_TYPE_INT, static_cast<gint>(nodes[2]), nullptr);
  GstStructure* structure = gst_caps_get_structure(caps, 0);
  setArray(structure, "spacing", format.grid.spacing);
  setArray(structure, "origin", format.grid.origin);
  if (format.grid.direction != Grid{}.direction) setArray(structure, "direction", format.grid.direction);
  if (format.level_set) gst_structure_set(structure, "level-set", G_TYPE_BOOLEAN, TRUE, nullptr);
  if (format.frame && fitsCaps(*format.frame)) {
    gst_structure_set(structure, "framerate", GST_TYPE_FRACTION, static_cast<gint>(format.frame->denominator),
                      static_cast<gint>(format.frame->numerator), nullptr);
  }
  if (format.time_base && fitsCaps(*format.time_base)) {
    gst_structure_set(structure, "time-base", GST_TYPE_FRACTION,
                      static_cast<gint>(format.time_base->numerator),
                      static_cast<gint>(format.time_base->denominator), nullptr);
  }
  return caps;
}

Result<VolumeFormat> volumeFormat(const GstCaps* caps) {
  const GstStructure* structure = gst_caps_get_structure(caps, 0);
  VolumeFormat format;
  const char* name = gst_structure_get_string(structure, "format");
  const FormatRow* found = nullptr;
  for (const FormatRow& row : kFormats) {
    if (name != nullptr && std::strcmp(row.name, name) == 0) found = &row;
  }
  if (found == nullptr) return {ErrorCode::kInvalidArgument, "caps: there is no sample format of this name"};
  format.type = found->type;
  format.order = found->order;
  const char* sides[] = {"width", "height", "depth"};
  for (std::size_t i = 0; i < 3; ++i) {
    gint nodes = 0;
    if (!gst_structure_get_int(structure, sides[i], &nodes) || nodes < 1)
      return {ErrorCode::kInvalidArgument, std::string("caps: ") + sides[i] + " is missing"};
    format.grid.nodes[i] = static_cast<std::uint32_t>(nodes);
  }
  ISOREEL_TRY(getArray(structure, "spacing", format.grid.spacing));
  ISOREEL_TRY(getArray(structure, "origin", format.grid.origin));
  ISOREEL_TRY(getArray(structure, "direction", format.grid.direction));
  ISOREEL_TRY(checkGrid(format.grid));
  gboolean level_set = FALSE;
  gst_structure_get_boolean(structure, "level-set", &level_set);
  format.level_set = level_set != FALSE;
  if (const auto rate = fraction(structure, "framerate"))
    format.frame = TimeBase{rate->denominator, rate->numerator};
  format.time_base = fraction(structure, "time-base");
  return format;
}

Result<Volume> volumeOf(GstBuffer* buffer, const VolumeFormat& format) {
  const std::size_t nodes = format.grid.nodeCount();
  const std::size_t bytes = gst_buffer_get_size(buffer), wanted = nodes * io::scalarBytes(format.type);
  if (bytes != wanted) {
    return {ErrorCode::kTruncated, "the buffer has " + std::to_string(bytes) +
                                       " bytes, and a volume of these caps " + std::to_string(wanted)};
  }
  struct Mapped {
    GstBuffer* buffer;
    GstMapInfo map;
    Mapped(GstBuffer* from, const GstMapInfo& how) : buffer(gst_buffer_ref(from)), map(how) {}
    Mapped(const Mapped&) = delete;
    Mapped& operator=(const Mapped&) = delete;
    ~Mapped() {
      gst_buffer_unmap(buffer, &map);
      gst_buffer_unref(buffer);
    }
  };
  GstMapInfo map;
  if (!gst_buffer_map(buffer, &map, GST_MAP_READ))
    return {ErrorCode::kIo, "the buffer's memory cannot be read"};
  const auto mapped = std::make_shared<Mapped>(buffer, map);
  const bool as_it_is = format.type == io::ScalarType::kFloat32 && format.order == std::endian::native &&
                        reinterpret_cast<std::uintptr_t>(map.data) % alignof(float) == 0;
  if (as_it_is) return Volume{format.grid, {reinterpret_cast<const float*>(map.data), nodes}, mapped};
  std::vector<float> samples(nodes);
  io::convertScalars(format.type, format.order, map.data, samples);
  return Volume::own(format.grid, std::move(samples));
}

GstBuffer* bufferOf(const Volume& volume) {
  auto* kept = new Volume(volume);
  const auto release = [](gpointer data) { delete static_cast<Volume*>(data); };
  const gsize bytes = volume.samples.size_bytes();
  return gst_buffer_new_wrapped_full(GST_MEMORY_FLAG_READONLY, const_cast<float*>(volume.samples.data()),
                                     bytes, 0, bytes, kept, release);
}

}  // namespace isoreel::gst
