// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/codec/surface.h>

#include <filesystem>
#include <string>
#include <vector>

namespace isoreel::io {

struct MeshOptions {
  bool normals = false;  // per-vertex normals, in formats that hold them
};

/// Writes the triangles of `surface` in world coordinates to `path`, by its extension: .ply (binary
/// little-endian) or .obj. Written under a temporary name in the same folder and renamed, so nothing partial
/// stays under `path`. Errors: kUnsupported (extension), kIo.
Status writeMesh(const Surface& surface, const std::filesystem::path& path, const MeshOptions& options = {});

/// The extensions this build writes, with dots.
std::vector<std::string> meshExtensions();

}  // namespace isoreel::io
