// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/io/mesh_writer.h>

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <iterator>

#include "src/atomic_file.h"
#include "src/mesh.h"

namespace isoreel::io {
namespace {

Mesh meshOf(const Surface& surface, bool normals) {
  Mesh mesh;
  mesh.positions.reserve(surface.vertices.size());
  for (const GridPosition& vertex : surface.vertices) {
    const Vec3d p = surface.grid.world(vertex);
    mesh.positions.push_back({static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])});
  }
  if (normals) mesh.normals = surface.normals();
  mesh.triangles = surface.triangles();
  return mesh;
}

struct MeshFormat {
  std::string_view extension;
  MeshEncoder* encode;
};

constexpr MeshFormat kFormats[] = {
    {".ply", plyOf}, {".obj", objOf}, {".stl", stlOf}, {".glb", glbOf}, {".vtp", vtpOf}};

}  // namespace

Status writeMesh(const Surface& surface, const std::filesystem::path& path, const MeshOptions& options) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); });
  const auto* format = std::find_if(std::begin(kFormats), std::end(kFormats),
                                    [&](const MeshFormat& known) { return known.extension == extension; });
  try {
    if (format == std::end(kFormats)) {
      return {ErrorCode::kUnsupported, fmt::format("{}: \"{}\" is none of {}", path.string(), extension,
                                                   fmt::join(meshExtensions(), " "))};
    }
    const Result<std::string> content = format->encode(meshOf(surface, options.normals), options);
    if (!content.ok()) return content.status().at(path.string());
    return writeWhole(path, *content);
  } catch (const std::exception& error) {
    return {ErrorCode::kIo, fmt::format("{}: {}", path.string(), error.what())};
  }
}

std::vector<std::string> meshExtensions() {
  std::vector<std::string> result;
  for (const MeshFormat& format : kFormats) result.emplace_back(format.extension);
  return result;
}

}  // namespace isoreel::io
