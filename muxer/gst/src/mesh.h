// SPDX-License-Identifier: BSD-3-Clause
// model/x-triangle-mesh: what the decoder gives, and what the renderer and scripts take.
#pragma once

#include <isoreel/codec/surface.h>
#include <isoreel/inspect/render.h>

#include <optional>
#include <span>

#include "common.h"

namespace isoreel::gst {

/// A surface a buffer, of two memories: positions (x, y and z of each vertex as 32-bit floats, in the world),
/// then triangles (three 32-bit indices each, counter-clockwise seen from outside). A surface without
/// triangles is two empty memories. Fields: vertex-format, index-format; bounding-box (array of 6 doubles:
/// least x, y and z, then greatest) where the box of the whole sequence is known; framerate where it is
/// known.
inline constexpr char kMeshCaps[] =
    "model/x-triangle-mesh, vertex-format = (string) F32LE, index-format = (string) U32LE";

/// The field bounding-box, of packets and meshes: an empty box is not written; a missing or wrong field is
/// empty.
void setBoundingBox(GstCaps* caps, const inspect::Box& box);
inspect::Box boundingBoxOf(GstCaps* caps);

/// The GstCustomMeta on meshes and on pictures of them. Fields of its structure: frame (guint64, from 0, in
/// its file), isovalue (gdouble), surface-hash (guint64: of the full surface, spec codec 7), vertices and
/// faces (guint: of the full surface, faces are quads), level and depth (guint: the octree level that was
/// decoded and the deepest; the surface is full where they are equal).
inline constexpr char kSurfaceMeta[] = "IsoreelSurface";

/// Registers the meta. Once, before others use it.
void registerSurfaceMeta();

struct SurfaceFacts {
  std::uint64_t frame = 0;
  double isovalue = 0;
  std::uint64_t surface_hash = 0;
  std::uint32_t vertices = 0;
  std::uint32_t faces = 0;
  std::uint32_t level = 0;
  std::uint32_t depth = 0;
};
void addSurfaceFacts(GstBuffer* buffer, const SurfaceFacts& facts);
/// Nothing where a buffer has no such meta.
std::optional<SurfaceFacts> surfaceFacts(GstBuffer* buffer);

/// The surface as a mesh. `allocator` may be null, the default one. Null when there is no memory.
GstBuffer* meshBuffer(const Surface& surface, GstAllocator* allocator, GstAllocationParams* params);

/// A mesh buffer mapped for reading, as long as it lives.
class MappedMesh {
 public:
  /// kBadData when it is not what kMeshCaps says: number and sizes of memories, an index without a vertex, a
  /// position that is not finite.
  static Result<MappedMesh> map(GstBuffer* buffer);
  MappedMesh(MappedMesh&& other) noexcept;
  ~MappedMesh();

  std::span<const std::array<float, 3>> points() const { return points_; }
  std::span<const Triangle> triangles() const { return triangles_; }

 private:
  MappedMesh() = default;
  Status check() const;
  std::array<GstMapInfo, 2> maps_{};  // without a memory: not mapped
  std::span<const std::array<float, 3>> points_;
  std::span<const Triangle> triangles_;
};

}  // namespace isoreel::gst
