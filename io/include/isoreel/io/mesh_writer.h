// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/codec/surface.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace isoreel::io {

struct MeshOptions {
  bool normals = false;           // a normal for each vertex, in formats that hold them: all but STL
  std::optional<double> seconds;  // the frame's time, in formats that hold it: VTP (field data TimeValue)
};

/// Writes the triangles of `surface` in world coordinates (single precision) to `path`, by its extension:
///
///   .ply  binary little-endian
///   .obj  text
///   .stl  binary; three corners and a facet normal for each triangle
///   .glb  binary glTF 2.0; a vertex without a triangle gets the normal (0, 0, 1)
///   .vtp  VTK's XML poly data, compressed by zlib
///
/// Apart from STL, which has no vertices of its own, all of them hold every vertex of the surface in its
/// order. A surface without triangles is a valid file without triangles. Written under a temporary name in
/// the same folder and renamed, so nothing partial stays under `path`. Errors: kUnsupported (extension),
/// kLimit (above the 4 GiB of a GLB), kIo.
Status writeMesh(const Surface& surface, const std::filesystem::path& path, const MeshOptions& options = {});

/// The extensions this build writes, with dots.
std::vector<std::string> meshExtensions();

/// A mesh file of a series, and when it is shown.
struct SeriesFrame {
  double seconds = 0;
  std::filesystem::path file;
};

/// Writes ParaView's collection (.pvd) of `frames`, whose times must rise, to `index`. Times are written with
/// as many digits as bring the same double back, files relative to the folder of `index`. Nothing partial
/// stays under `index`. Errors: kIo.
Status writeSeries(const std::vector<SeriesFrame>& frames, const std::filesystem::path& index);

}  // namespace isoreel::io
