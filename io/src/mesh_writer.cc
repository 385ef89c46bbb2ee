// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/io/mesh_writer.h>

#include <assimp/scene.h>
#include <fmt/format.h>

#include <algorithm>
#include <assimp/Exporter.hpp>
#include <cctype>
#include <iterator>

#include "src/atomic_file.h"

namespace isoreel::io {
namespace {

struct Mesh {
  std::vector<std::array<float, 3>> positions;  // world
  std::vector<std::array<float, 3>> normals;    // as many as positions, or none
  std::vector<Triangle> triangles;
};

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

aiVector3D* vectors(const std::vector<std::array<float, 3>>& values) {
  auto* result = new aiVector3D[values.size()];
  std::transform(values.begin(), values.end(), result,
                 [](const auto& v) { return aiVector3D(v[0], v[1], v[2]); });
  return result;
}

// Assimp's scene owns what is new here.
std::unique_ptr<aiScene> sceneOf(const Mesh& mesh) {
  auto scene = std::make_unique<aiScene>();
  scene->mRootNode = new aiNode;
  scene->mRootNode->mMeshes = new unsigned[1]{0};
  scene->mRootNode->mNumMeshes = 1;
  scene->mMaterials = new aiMaterial* [1] { new aiMaterial };
  scene->mNumMaterials = 1;
  auto* out = new aiMesh;
  scene->mMeshes = new aiMesh* [1] { out };
  scene->mNumMeshes = 1;
  out->mPrimitiveTypes = aiPrimitiveType_TRIANGLE;
  out->mNumVertices = static_cast<unsigned>(mesh.positions.size());
  out->mVertices = vectors(mesh.positions);
  if (!mesh.normals.empty()) out->mNormals = vectors(mesh.normals);
  out->mNumFaces = static_cast<unsigned>(mesh.triangles.size());
  out->mFaces = new aiFace[mesh.triangles.size()];
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Triangle& triangle = mesh.triangles[i];
    out->mFaces[i].mNumIndices = 3;
    out->mFaces[i].mIndices = new unsigned[3]{triangle[0], triangle[1], triangle[2]};
  }
  return scene;
}

// Assimp refuses a scene without faces, but the frames of a sequence may be empty: then the header is all
// there is.
std::string emptyPly(bool normals) {
  return fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty "
      "float z\n{}"
      "element face 0\nproperty list uchar int vertex_index\nend_header\n",
      normals ? "property float nx\nproperty float ny\nproperty float nz\n" : "");
}

Result<std::string> plyOf(const Mesh& mesh, bool normals) {
  if (mesh.triangles.empty()) return emptyPly(normals);
  const auto scene = sceneOf(mesh);
  Assimp::Exporter exporter;
  const aiExportDataBlob* blob = exporter.ExportToBlob(scene.get(), "plyb", 0u);
  if (blob == nullptr)
    return {ErrorCode::kIo, fmt::format("Assimp cannot export it: {}", exporter.GetErrorString())};
  return std::string(static_cast<const char*>(blob->data), blob->size);
}

// Assimp's OBJ exporter would join vertices at equal positions, drop and reorder others and always add
// normals, so the mesh read back would not be the one that was decoded. Nine digits bring every float back.
Result<std::string> objOf(const Mesh& mesh, bool) {
  std::string text;
  auto out = std::back_inserter(text);
  for (const auto& p : mesh.positions) fmt::format_to(out, "v {:.9g} {:.9g} {:.9g}\n", p[0], p[1], p[2]);
  for (const auto& n : mesh.normals) fmt::format_to(out, "vn {:.9g} {:.9g} {:.9g}\n", n[0], n[1], n[2]);
  for (const Triangle& t : mesh.triangles) {
    if (mesh.normals.empty()) {
      fmt::format_to(out, "f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
    } else {
      fmt::format_to(out, "f {0}//{0} {1}//{1} {2}//{2}\n", t[0] + 1, t[1] + 1, t[2] + 1);
    }
  }
  return text.empty() ? "# no surface in this frame\n" : text;
}

struct MeshFormat {
  std::string_view extension;
  Result<std::string> (*encode)(const Mesh& mesh, bool normals);
};

constexpr MeshFormat kFormats[] = {{".ply", plyOf}, {".obj", objOf}};

}  // namespace

Status writeMesh(const Surface& surface, const std::filesystem::path& path, const MeshOptions& options) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); });
  const auto* format = std::find_if(std::begin(kFormats), std::end(kFormats),
                                    [&](const MeshFormat& known) { return known.extension == extension; });
  if (format == std::end(kFormats)) {
    return {ErrorCode::kUnsupported, fmt::format("{}: \"{}\" is not .ply or .obj", path.string(), extension)};
  }
  try {
    const Result<std::string> content = format->encode(meshOf(surface, options.normals), options.normals);
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
