// SPDX-License-Identifier: BSD-3-Clause
// Meshes written, and read back by Assimp.
#include <isoreel/io/mesh_writer.h>

#include <assimp/scene.h>
#include <sys/resource.h>

#include <assimp/Importer.hpp>
#include <csignal>

#include "support.h"

namespace isoreel::io {
namespace {

// Two quads at odd places in a turned grid; a vertex without a face, and two vertices at one position.
Surface twoQuads() {
  Surface surface;
  surface.grid.nodes = {8, 8, 8};
  surface.grid.origin = {0.1, -20.7, 1.0 / 3};
  surface.grid.spacing = {0.3, 0.7, 1.1};
  surface.grid.direction = {0, -1, 0, 1, 0, 0, 0, 0, 1};
  surface.vertices = {{1, 2, 3},           {kCell, 77, 4000},      {kCell, kCell, 5001}, {9, kCell + 1, 6007},
                      {2 * kCell, 50, 12}, {2 * kCell, kCell, 13}, {kCell, kCell, 5001}, {50, 60, 70}};
  surface.quads = {{0, 1, 2, 3}, {1, 4, 5, 6}};
  return surface;
}

// A sheet of side² quads.
Surface sheet(std::uint32_t side) {
  Surface surface;
  surface.grid.nodes = {side + 2, side + 2, 4};
  for (std::uint32_t y = 0; y <= side; ++y) {
    for (std::uint32_t x = 0; x <= side; ++x) {
      surface.vertices.push_back({static_cast<int>(x) * kCell, static_cast<int>(y) * kCell,
                                  static_cast<int>((x * 7 + y * 13) % 999)});
    }
  }
  for (std::uint32_t y = 0; y < side; ++y) {
    for (std::uint32_t x = 0; x < side; ++x) {
      const std::uint32_t i = y * (side + 1) + x;
      surface.quads.push_back({i, i + 1, i + side + 2, i + side + 1});
    }
  }
  return surface;
}

class MeshWriter : public IoTest, public testing::WithParamInterface<const char*> {
 protected:
  std::string file() const { return path(std::string("mesh") + GetParam()); }
};

void expectSameMesh(const Surface& surface, const std::string& file, bool normals) {
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(file, 0u);
  ASSERT_NE(scene, nullptr) << importer.GetErrorString();
  ASSERT_EQ(scene->mNumMeshes, 1u);
  const aiMesh& mesh = *scene->mMeshes[0];
  const auto triangles = surface.triangles();
  ASSERT_EQ(mesh.mNumFaces, triangles.size());
  EXPECT_EQ(mesh.HasNormals(), normals);
  const auto expectedNormals = surface.normals();
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    ASSERT_EQ(mesh.mFaces[t].mNumIndices, 3u);
    for (unsigned k = 0; k < 3; ++k) {
      const unsigned i = mesh.mFaces[t].mIndices[k];
      const Vec3d expected = surface.world(triangles[t][k]);
      for (unsigned axis = 0; axis < 3; ++axis) {
        ASSERT_EQ(mesh.mVertices[i][axis], static_cast<float>(expected[axis])) << "triangle " << t;
        if (normals) {
          ASSERT_EQ(mesh.mNormals[i][axis], expectedNormals[triangles[t][k]][axis]);
        }
      }
    }
  }
}

TEST_P(MeshWriter, ComesBackBitForBit) {
  for (const bool normals : {false, true}) {
    for (const Surface& surface : {twoQuads(), sheet(30)}) {
      const Status status = writeMesh(surface, file(), {normals});
      ASSERT_TRUE(status.ok()) << status.message();
      ASSERT_NO_FATAL_FAILURE(expectSameMesh(surface, file(), normals));
      EXPECT_EQ(files(), 1u);
    }
  }
}

// Vertices that importers join or drop are in the file all the same, once each and in order.
TEST_P(MeshWriter, KeepsEveryVertex) {
  ASSERT_TRUE(writeMesh(twoQuads(), file()).ok());
  const std::string text = content(std::string("mesh") + GetParam());
  if (std::string(GetParam()) == ".ply") {
    EXPECT_NE(text.find("element vertex 8\n"), std::string::npos);
    EXPECT_NE(text.find("element face 4\n"), std::string::npos);
    const std::size_t header = text.find("end_header\n") + 11;
    EXPECT_EQ(text.size(), header + 8 * 12 + 4 * 13);
  } else {
    std::size_t vertices = 0;
    for (std::size_t i = text.find("v "); i != std::string::npos; i = text.find("\nv ", i + 1)) ++vertices;
    EXPECT_EQ(vertices, 8u);
    EXPECT_EQ(text.find("vn "), std::string::npos);
  }
}

TEST_P(MeshWriter, EmptySurfaceIsAValidFile) {
  for (const bool normals : {false, true}) {
    const Status status = writeMesh(Surface(), file(), {normals});
    ASSERT_TRUE(status.ok()) << status.message();
    const std::string text = content(std::string("mesh") + GetParam());
    ASSERT_FALSE(text.empty());
    if (std::string(GetParam()) == ".ply") {
      EXPECT_TRUE(text.starts_with("ply\nformat binary_little_endian 1.0\nelement vertex 0\n"));
      EXPECT_TRUE(text.ends_with("end_header\n"));
    }
  }
}

TEST_P(MeshWriter, OverwritesWhole) {
  ASSERT_TRUE(writeMesh(sheet(30), file()).ok());
  ASSERT_TRUE(writeMesh(twoQuads(), file()).ok());
  expectSameMesh(twoQuads(), file(), false);
}

TEST_P(MeshWriter, MissingFolderAndFolderInTheWay) {
  const Status missing = writeMesh(twoQuads(), path(std::string("none/mesh") + GetParam()));
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.error().code, ErrorCode::kIo);
  EXPECT_TRUE(contains(missing.error().message, path("none/mesh")));
  std::filesystem::create_directory(file());
  const Status status = writeMesh(twoQuads(), file());
  ASSERT_FALSE(status.ok());
  EXPECT_TRUE(contains(status.error().message, file()));
  EXPECT_EQ(files(), 1u);
}

// A limit on file size fails in the middle of writing, as a full disk does: the old file stays, nothing else.
TEST_P(MeshWriter, FullDiskLeavesTheOldFile) {
  ASSERT_TRUE(writeMesh(twoQuads(), file()).ok());
  rlimit before = {};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit small = before;
  small.rlim_cur = 1000;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  const Status status = writeMesh(sheet(30), file());
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, handler);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kIo);
  EXPECT_TRUE(contains(status.error().message, file()));
  EXPECT_EQ(files(), 1u);
  expectSameMesh(twoQuads(), file(), false);
}

INSTANTIATE_TEST_SUITE_P(Formats, MeshWriter, testing::Values(".ply", ".obj"),
                         [](const auto& extension) { return std::string(extension.param + 1); });

TEST_F(IoTest, UnknownMeshExtension) {
  for (const char* name : {"mesh.stl", "mesh", "mesh.ply.gz"}) {
    const Status status = writeMesh(twoQuads(), path(name));
    ASSERT_FALSE(status.ok());
    EXPECT_EQ(status.error().code, ErrorCode::kUnsupported);
    EXPECT_TRUE(contains(status.error().message, path(name)));
  }
  EXPECT_EQ(files(), 0u);
  EXPECT_TRUE(writeMesh(twoQuads(), path("MESH.PLY")).ok());
  EXPECT_EQ(meshExtensions(), (std::vector<std::string>{".ply", ".obj"}));
}

}  // namespace
}  // namespace isoreel::io
