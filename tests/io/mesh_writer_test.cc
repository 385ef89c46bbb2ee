// SPDX-License-Identifier: BSD-3-Clause
// Meshes written, and read back.
#include <isoreel/io/mesh_writer.h>

#include <sys/resource.h>

#include <cmath>
#include <csignal>
#include <nlohmann/json.hpp>
#include <pugixml.hpp>

#include "mesh_readers.h"
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
  bool is(const char* extension) const { return std::string(GetParam()) == extension; }
};

using Vector = std::array<float, 3>;

Vector position(const Surface& surface, std::uint32_t vertex) {
  const Vec3d p = surface.world(vertex);
  return {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])};
}

// A facet's normal points the way its corners turn, and has length one unless the facet has no area.
void expectFacetNormal(const Vector& normal, const Vector& a, const Vector& b, const Vector& c) {
  const Vec3d u{b[0] - a[0], b[1] - a[1], b[2] - a[2]}, v{c[0] - a[0], c[1] - a[1], c[2] - a[2]};
  const Vec3d n{u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
  const double length = std::hypot(n[0], n[1], n[2]);
  for (std::size_t axis = 0; axis < 3 && length > 0; ++axis)
    ASSERT_NEAR(normal[axis], n[axis] / length, 1e-3);
}

// The same triangles in their order and with their orientation, floats as they were.
void expectSameMesh(const Surface& surface, const std::string& file, bool normals) {
  const bool facets = file.ends_with(".stl");
  const ReadMesh mesh = readMesh(file);
  const auto triangles = surface.triangles();
  ASSERT_EQ(mesh.triangles.size(), triangles.size());
  ASSERT_EQ(mesh.normals.size(), facets || normals ? mesh.positions.size() : 0);
  const auto vertex_normals = surface.normals();
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const auto [a, b, c] = triangles[t];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t i = mesh.triangles[t][k];
      ASSERT_LT(i, mesh.positions.size());
      ASSERT_EQ(mesh.positions[i], position(surface, triangles[t][k])) << "triangle " << t;
      if (normals && !facets) {
        ASSERT_EQ(mesh.normals[i], vertex_normals[triangles[t][k]]);
      }
    }
    if (facets)
      expectFacetNormal(mesh.normals[mesh.triangles[t][0]], position(surface, a), position(surface, b),
                        position(surface, c));
  }
}

TEST_P(MeshWriter, ComesBackBitForBit) {
  for (const bool normals : {false, true}) {
    for (const Surface& surface : {twoQuads(), sheet(30), sheet(230)}) {
      const Status status = writeMesh(surface, file(), {.normals = normals, .seconds = {}});
      ASSERT_TRUE(status.ok()) << status.message();
      ASSERT_NO_FATAL_FAILURE(expectSameMesh(surface, file(), normals));
      EXPECT_EQ(files(), 1u);
    }
  }
}

// A grid in micrometres, given in metres: nothing is joined because it lies near.
TEST_P(MeshWriter, SmallUnitsComeBackBitForBit) {
  Surface surface = sheet(30);
  surface.grid.spacing = {1e-6, 1e-6, 1e-6};
  ASSERT_TRUE(writeMesh(surface, file()).ok());
  expectSameMesh(surface, file(), false);
}

// Vertices that importers join or drop are in the file all the same, once each and in order.
TEST_P(MeshWriter, KeepsEveryVertex) {
  ASSERT_TRUE(writeMesh(twoQuads(), file()).ok());
  const std::string text = content(std::string("mesh") + GetParam());
  if (is(".ply")) {
    EXPECT_NE(text.find("element vertex 8\n"), std::string::npos);
    EXPECT_NE(text.find("element face 4\n"), std::string::npos);
    const std::size_t header = text.find("end_header\n") + 11;
    EXPECT_EQ(text.size(), header + 8 * 12 + 4 * 13);
  } else if (is(".obj")) {
    std::size_t vertices = 0;
    for (std::size_t i = text.find("v "); i != std::string::npos; i = text.find("\nv ", i + 1)) ++vertices;
    EXPECT_EQ(vertices, 8u);
    EXPECT_EQ(text.find("vn "), std::string::npos);
  } else if (!is(".stl")) {
    const ReadMesh mesh = readMesh(file());
    ASSERT_EQ(mesh.positions.size(), 8u);
    for (std::uint32_t i = 0; i < 8; ++i) EXPECT_EQ(mesh.positions[i], position(twoQuads(), i));
  }
}

TEST_P(MeshWriter, EmptySurfaceIsAValidFile) {
  for (const bool normals : {false, true}) {
    const Status status = writeMesh(Surface(), file(), {.normals = normals, .seconds = 0.5});
    ASSERT_TRUE(status.ok()) << status.message();
    const std::string text = content(std::string("mesh") + GetParam());
    ASSERT_FALSE(text.empty());
    if (is(".ply")) {
      EXPECT_TRUE(text.starts_with("ply\nformat binary_little_endian 1.0\nelement vertex 0\n"));
      EXPECT_TRUE(text.ends_with("end_header\n"));
    } else if (is(".glb")) {  // a scene with a node that has no mesh: arrays of glTF must not be empty
      ASSERT_EQ(text.size() % 4, 0u);
      const auto document = nlohmann::json::parse(text.substr(20));
      EXPECT_EQ(document["nodes"].size(), 1u);
      EXPECT_FALSE(document.contains("meshes") || document.contains("buffers") ||
                   document.contains("accessors"));
    } else if (is(".stl")) {  // Assimp does not read one
      EXPECT_EQ(text, "isoreel" + std::string(77, '\0'));
    } else if (!is(".obj")) {
      const ReadMesh mesh = readMesh(file());
      EXPECT_TRUE(mesh.positions.empty() && mesh.triangles.empty() && mesh.normals.empty());
      EXPECT_EQ(mesh.seconds, 0.5);
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

INSTANTIATE_TEST_SUITE_P(Formats, MeshWriter, testing::Values(".ply", ".obj", ".stl", ".glb", ".vtp"),
                         [](const auto& extension) { return std::string(extension.param + 1); });

TEST_F(IoTest, GlbIsWellFormed) {
  Surface surface = twoQuads();
  surface.vertices[7] = {3, 4 * kCell, 5};  // the one without a triangle still counts for the bounds
  ASSERT_TRUE(writeMesh(surface, path("mesh.glb"), {.normals = true, .seconds = {}}).ok());
  const std::string text = content("mesh.glb");
  const auto word = [&](std::size_t at) {
    std::uint32_t value = 0;
    std::memcpy(&value, text.data() + at, sizeof value);
    return value;
  };
  EXPECT_TRUE(text.starts_with("glTF"));
  EXPECT_EQ(word(4), 2u);
  EXPECT_EQ(word(8), text.size());
  const std::uint32_t json = word(12);
  EXPECT_EQ(json % 4, 0u);
  EXPECT_EQ(text.substr(16, 4), "JSON");
  EXPECT_EQ(word(20 + json), text.size() - 28 - json);
  EXPECT_EQ(text.substr(24 + json, 4), std::string("BIN\0", 4));
  const auto document = nlohmann::json::parse(text.substr(20, json));
  EXPECT_EQ(document["buffers"][0]["byteLength"], text.size() - 28 - json);
  const auto& positions = document["accessors"][0];
  EXPECT_EQ(positions["count"], 8);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    float low = position(surface, 0)[axis], high = low;
    for (std::uint32_t i = 0; i < 8; ++i) {
      low = std::min(low, position(surface, i)[axis]);
      high = std::max(high, position(surface, i)[axis]);
    }
    EXPECT_EQ(positions["min"][axis].get<float>(), low);
    EXPECT_EQ(positions["max"][axis].get<float>(), high);
  }
  for (const Vector& n : readMesh(path("mesh.glb")).normals)
    EXPECT_NEAR(std::hypot(n[0], n[1], n[2]), 1, 1e-6);
}

TEST_F(IoTest, TimesComeBackExact) {
  std::vector<SeriesFrame> frames;
  for (const double seconds : {-1.0 / 3, 0.0, 1e-9, 1001.0 / 30000, 0.1 + 0.2, 123456789.012345678}) {
    const std::string file = path("a&\"<b>_" + std::to_string(frames.size()) + ".vtp");
    ASSERT_TRUE(writeMesh(twoQuads(), file, {.normals = false, .seconds = seconds}).ok());
    EXPECT_EQ(readMesh(file).seconds, seconds);
    frames.push_back({seconds, file});
  }
  ASSERT_TRUE(writeMesh(twoQuads(), path("timeless.vtp")).ok());
  EXPECT_EQ(readMesh(path("timeless.vtp")).seconds, std::nullopt);
  ASSERT_TRUE(writeSeries(frames, path("all.pvd")).ok());
  pugi::xml_document document;
  ASSERT_TRUE(document.load_file(path("all.pvd").c_str()));
  std::size_t i = 0;
  for (const auto& entry : document.child("VTKFile").child("Collection")) {
    ASSERT_LT(i, frames.size());
    EXPECT_EQ(std::stod(entry.attribute("timestep").value()), frames[i].seconds);
    EXPECT_EQ(path(entry.attribute("file").value()), frames[i].file);
    ++i;
  }
  EXPECT_EQ(i, frames.size());
}

TEST_F(IoTest, SeriesNamesFilesFromItsOwnFolder) {
  const auto files_of = [&](const std::string& index, const std::string& file) {
    EXPECT_TRUE(writeSeries({{0, file}}, index).ok());
    pugi::xml_document document;
    EXPECT_TRUE(document.load_file(index.c_str()));
    return std::string(
        document.child("VTKFile").child("Collection").child("DataSet").attribute("file").value());
  };
  EXPECT_EQ(files_of(path("a.pvd"), path("sub/0.vtp")), "sub/0.vtp");
  std::filesystem::current_path(folder_);
  EXPECT_EQ(files_of("a.pvd", "0.vtp"), "0.vtp");
  EXPECT_EQ(files_of("./b.pvd", "./0.vtp"), "0.vtp");
  std::filesystem::current_path("/");
  const Status status = writeSeries({}, path("none/a.pvd"));
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kIo);
  EXPECT_TRUE(contains(status.error().message, path("none/a.pvd")));
}

TEST_F(IoTest, UnknownMeshExtension) {
  for (const char* name : {"mesh.stp", "mesh", "mesh.ply.gz"}) {
    const Status status = writeMesh(twoQuads(), path(name));
    ASSERT_FALSE(status.ok());
    EXPECT_EQ(status.error().code, ErrorCode::kUnsupported);
    EXPECT_TRUE(contains(status.error().message, path(name)));
  }
  EXPECT_EQ(files(), 0u);
  EXPECT_TRUE(writeMesh(twoQuads(), path("MESH.PLY")).ok());
  EXPECT_EQ(meshExtensions(), (std::vector<std::string>{".ply", ".obj", ".stl", ".glb", ".vtp"}));
}

}  // namespace
}  // namespace isoreel::io
