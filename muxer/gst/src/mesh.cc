// SPDX-License-Identifier: BSD-3-Clause
#include "mesh.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <utility>

namespace isoreel::gst {
namespace {

static_assert(std::endian::native == std::endian::little, "kMeshCaps says LE");

// Memory of `bytes` that `fill` has written.
template <class Fill>
GstMemory* filled(GstAllocator* allocator, GstAllocationParams* params, std::size_t bytes, Fill fill) {
  GstMemory* memory = gst_allocator_alloc(allocator, bytes, params);
  GstMapInfo map;
  if (memory == nullptr) return nullptr;
  if (!gst_memory_map(memory, &map, GST_MAP_WRITE)) {
    gst_memory_unref(memory);
    return nullptr;
  }
  fill(map.data);
  gst_memory_unmap(memory, &map);
  return memory;
}

}  // namespace

void setBoundingBox(GstCaps* caps, const inspect::Box& box) {
  if (box.empty()) return;
  GValue list = G_VALUE_INIT, number = G_VALUE_INIT;
  gst_value_array_init(&list, 6);
  g_value_init(&number, G_TYPE_DOUBLE);
  for (const Vec3d& corner : {box.min, box.max}) {
    for (const double x : corner) {
      g_value_set_double(&number, x);
      gst_value_array_append_value(&list, &number);
    }
  }
  gst_caps_set_value(caps, "bounding-box", &list);
  g_value_unset(&list);
}

inspect::Box boundingBoxOf(GstCaps* caps) {
  inspect::Box box;
  const GValue* list = gst_structure_get_value(gst_caps_get_structure(caps, 0), "bounding-box");
  if (list == nullptr || !GST_VALUE_HOLDS_ARRAY(list) || gst_value_array_get_size(list) != 6) return box;
  std::array<double, 6> numbers{};
  for (guint i = 0; i < 6; ++i) {
    const GValue* number = gst_value_array_get_value(list, i);
    if (!G_VALUE_HOLDS_DOUBLE(number)) return box;
    numbers[i] = g_value_get_double(number);
    if (!std::isfinite(numbers[i])) return box;
  }
  box.add({numbers[0], numbers[1], numbers[2]});
  box.add({numbers[3], numbers[4], numbers[5]});
  return box;
}

void registerSurfaceMeta() {
  static const gchar* no_tags[] = {nullptr};
  gst_meta_register_custom(kSurfaceMeta, no_tags, nullptr, nullptr, nullptr);
}

void addSurfaceFacts(GstBuffer* buffer, const SurfaceFacts& facts) {
  GstStructure* fields = gst_custom_meta_get_structure(gst_buffer_add_custom_meta(buffer, kSurfaceMeta));
  gst_structure_set(fields, "frame", G_TYPE_UINT64, guint64{facts.frame}, "isovalue", G_TYPE_DOUBLE,
                    facts.isovalue, "surface-hash", G_TYPE_UINT64, guint64{facts.surface_hash}, "vertices",
                    G_TYPE_UINT, guint{facts.vertices}, "faces", G_TYPE_UINT, guint{facts.faces}, "level",
                    G_TYPE_UINT, guint{facts.level}, "depth", G_TYPE_UINT, guint{facts.depth}, nullptr);
}

std::optional<SurfaceFacts> surfaceFacts(GstBuffer* buffer) {
  GstCustomMeta* meta = gst_buffer_get_custom_meta(buffer, kSurfaceMeta);
  if (meta == nullptr) return std::nullopt;
  guint64 frame = 0, hash = 0;
  guint vertices = 0, faces = 0, level = 0, depth = 0;
  gdouble isovalue = 0;
  gst_structure_get(gst_custom_meta_get_structure(meta), "frame", G_TYPE_UINT64, &frame, "isovalue",
                    G_TYPE_DOUBLE, &isovalue, "surface-hash", G_TYPE_UINT64, &hash, "vertices", G_TYPE_UINT,
                    &vertices, "faces", G_TYPE_UINT, &faces, "level", G_TYPE_UINT, &level, "depth",
                    G_TYPE_UINT, &depth, nullptr);
  return SurfaceFacts{frame, isovalue, hash, vertices, faces, level, depth};
}

GstBuffer* meshBuffer(const Surface& surface, GstAllocator* allocator, GstAllocationParams* params) {
  const std::size_t count = surface.vertices.size();
  GstMemory* points = filled(allocator, params, count * 3 * sizeof(float), [&](guint8* out) {
    for (std::uint32_t i = 0; i < count; ++i) {
      const Vec3d p = surface.world(i);
      const std::array<float, 3> point{static_cast<float>(p[0]), static_cast<float>(p[1]),
                                       static_cast<float>(p[2])};
      std::memcpy(out + i * sizeof point, &point, sizeof point);
    }
  });
  if (points == nullptr) return nullptr;
  GstBuffer* buffer = gst_buffer_new();
  gst_buffer_append_memory(buffer, points);
  const std::vector<Triangle> triangles = surface.triangles();
  const std::size_t bytes = triangles.size() * sizeof(Triangle);
  GstMemory* indices = filled(allocator, params, bytes, [&](guint8* out) {
    if (bytes > 0) std::memcpy(out, triangles.data(), bytes);
  });
  if (indices == nullptr) {
    gst_buffer_unref(buffer);
    return nullptr;
  }
  gst_buffer_append_memory(buffer, indices);
  return buffer;
}

MappedMesh::MappedMesh(MappedMesh&& other) noexcept
    : maps_(std::exchange(other.maps_, {})), points_(other.points_), triangles_(other.triangles_) {}

MappedMesh::~MappedMesh() {
  for (GstMapInfo& map : maps_) {
    if (map.memory != nullptr) gst_memory_unmap(map.memory, &map);
  }
}

Result<MappedMesh> MappedMesh::map(GstBuffer* buffer) {
  const guint memories = gst_buffer_n_memory(buffer);
  if (memories != 2) {
    return {ErrorCode::kBadData, "mesh: a buffer of " + std::to_string(memories) +
                                     " memories, where positions and triangles are expected"};
  }
  MappedMesh mesh;
  for (guint i = 0; i < 2; ++i) {
    GstMapInfo map;
    if (!gst_memory_map(gst_buffer_peek_memory(buffer, i), &map, GST_MAP_READ))
      return {ErrorCode::kIo, "mesh: its memory cannot be read"};
    mesh.maps_[i] = map;
  }
  const GstMapInfo &points = mesh.maps_[0], &triangles = mesh.maps_[1];
  if (points.size % sizeof(std::array<float, 3>) != 0 || triangles.size % sizeof(Triangle) != 0)
    return {ErrorCode::kBadData, "mesh: memories that are not whole positions and whole triangles"};
  if (std::bit_cast<std::uintptr_t>(points.data) % alignof(float) != 0 ||
      std::bit_cast<std::uintptr_t>(triangles.data) % alignof(std::uint32_t) != 0)
    return {ErrorCode::kBadData, "mesh: memories that do not begin at a multiple of 4 bytes"};
  mesh.points_ = {reinterpret_cast<const std::array<float, 3>*>(points.data),
                  points.size / sizeof(std::array<float, 3>)};
  mesh.triangles_ = {reinterpret_cast<const Triangle*>(triangles.data), triangles.size / sizeof(Triangle)};
  ISOREEL_TRY(mesh.check());
  return mesh;
}

Status MappedMesh::check() const {
  for (const Triangle& triangle : triangles_) {
    for (const std::uint32_t i : triangle) {
      if (i >= points_.size()) {
        return {ErrorCode::kBadData, "mesh: a triangle names vertex " + std::to_string(i) + " of " +
                                         std::to_string(points_.size())};
      }
    }
  }
  for (const auto& point : points_) {
    for (const float x : point) {
      if (!std::isfinite(x)) return {ErrorCode::kBadData, "mesh: a position is not finite"};
    }
  }
  return {};
}

}  // namespace isoreel::gst
