// SPDX-License-Identifier: BSD-3-Clause
// PLY by Assimp: the one format of ours whose exporter leaves vertices, triangles and normals as they are.
#include <assimp/scene.h>
#include <fmt/format.h>

#include <algorithm>
#include <assimp/Exporter.hpp>
#include <memory>

#include "src/mesh.h"

namespace isoreel::io {
namespace {

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

}  // namespace

Result<std::string> plyOf(const Mesh& mesh, const MeshOptions& options) {
  if (mesh.triangles.empty()) return emptyPly(options.normals);
  const auto scene = sceneOf(mesh);
  Assimp::Exporter exporter;
  const aiExportDataBlob* blob = exporter.ExportToBlob(scene.get(), "plyb", 0u);
  if (blob == nullptr)
    return {ErrorCode::kIo, fmt::format("Assimp cannot export it: {}", exporter.GetErrorString())};
  return std::string(static_cast<const char*>(blob->data), blob->size);
}

}  // namespace isoreel::io
