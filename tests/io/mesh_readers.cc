// SPDX-License-Identifier: BSD-3-Clause
#include "mesh_readers.h"

#include <assimp/scene.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <assimp/Importer.hpp>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <pugixml.hpp>
#include <sstream>

namespace isoreel::io {
namespace {

using Vector = std::array<float, 3>;

std::string contentOf(const std::string& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

template <class Value>
Value valueAt(const std::string& bytes, std::size_t at) {
  Value value{};
  if (at + sizeof value > bytes.size()) {
    ADD_FAILURE() << "ends before byte " << at + sizeof value;
  } else {
    std::memcpy(&value, bytes.data() + at, sizeof value);
  }
  return value;
}

ReadMesh readByAssimp(const std::string& file) {
  ReadMesh result;
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(file, 0u);
  if (scene == nullptr || scene->mNumMeshes != 1) {
    ADD_FAILURE() << file << ": " << importer.GetErrorString();
    return result;
  }
  const aiMesh& mesh = *scene->mMeshes[0];
  const auto vector = [](const aiVector3D& v) { return Vector{v.x, v.y, v.z}; };
  for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
    result.positions.push_back(vector(mesh.mVertices[i]));
    if (mesh.HasNormals()) result.normals.push_back(vector(mesh.mNormals[i]));
  }
  for (unsigned i = 0; i < mesh.mNumFaces; ++i) {
    EXPECT_EQ(mesh.mFaces[i].mNumIndices, 3u);
    const unsigned* corner = mesh.mFaces[i].mIndices;
    result.triangles.push_back({corner[0], corner[1], corner[2]});
  }
  return result;
}

// Assimp reads some numbers a digit off.
ReadMesh readObj(const std::string& file) {
  ReadMesh result;
  std::istringstream lines(contentOf(file));
  for (std::string line; std::getline(lines, line);) {
    char* rest = line.data() + line.find(' ');
    if (line.starts_with("v ") || line.starts_with("vn ")) {
      Vector value{};
      for (float& component : value) component = std::strtof(rest, &rest);
      (line.starts_with("vn ") ? result.normals : result.positions).push_back(value);
    } else if (line.starts_with("f ")) {
      std::array<std::uint32_t, 3> corners{};
      for (std::uint32_t& corner : corners) {
        const unsigned long index = std::strtoul(rest, &rest, 10);
        corner = static_cast<std::uint32_t>(index - 1);
        if (result.normals.empty()) continue;
        EXPECT_TRUE(std::string_view(rest).starts_with("//"));
        EXPECT_EQ(std::strtoul(rest + 2, &rest, 10), index);
      }
      result.triangles.push_back(corners);
    }
  }
  return result;
}

/// The values of an appended array, which fill `values` exactly.
template <class Value>
void inflateArray(const pugi::xml_node& array, const char* type, const std::string& appended,
                  std::vector<Value>& values) {
  EXPECT_STREQ(array.attribute("format").value(), "appended");
  EXPECT_STREQ(array.attribute("type").value(), type);
  const std::size_t offset = array.attribute("offset").as_ullong();
  const auto blocks = valueAt<std::uint64_t>(appended, offset);
  const auto block_bytes = valueAt<std::uint64_t>(appended, offset + 8);
  const auto last_bytes = valueAt<std::uint64_t>(appended, offset + 16);
  std::string raw(values.size() * sizeof(Value), '\0');
  std::size_t at = offset + 24 + 8 * blocks, done = 0;
  for (std::uint64_t i = 0; i < blocks; ++i) {
    const auto packed = valueAt<std::uint64_t>(appended, offset + 24 + 8 * i);
    const std::uint64_t expected = i + 1 < blocks || last_bytes == 0 ? block_bytes : last_bytes;
    ASSERT_LE(at + packed, appended.size());
    ASSERT_LE(done + expected, raw.size());
    uLongf size = raw.size() - done;
    ASSERT_EQ(uncompress(reinterpret_cast<Bytef*>(raw.data()) + done, &size,
                         reinterpret_cast<const Bytef*>(appended.data()) + at, packed),
              Z_OK);
    ASSERT_EQ(size, expected);
    at += packed;
    done += size;
  }
  ASSERT_EQ(done, raw.size());
  if (!raw.empty()) std::memcpy(values.data(), raw.data(), raw.size());
}

ReadMesh readVtp(const std::string& file) {
  ReadMesh result;
  const std::string text = contentOf(file), mark = "<AppendedData encoding=\"raw\">\n_";
  const std::size_t start = text.find(mark), end = text.rfind("\n</AppendedData>");
  pugi::xml_document document;
  if (start == std::string::npos || end == std::string::npos ||
      !document.load_string((text.substr(0, start + mark.size()) + text.substr(end)).c_str())) {
    ADD_FAILURE() << file << ": is no VTP file with appended data";
    return result;
  }
  const std::string appended = text.substr(start + mark.size(), end - start - mark.size());
  const pugi::xml_node root = document.child("VTKFile"), data = root.child("PolyData"),
                       piece = data.child("Piece");
  EXPECT_STREQ(root.attribute("type").value(), "PolyData");
  EXPECT_STREQ(root.attribute("byte_order").value(), "LittleEndian");
  EXPECT_STREQ(root.attribute("header_type").value(), "UInt64");
  EXPECT_STREQ(root.attribute("compressor").value(), "vtkZLibDataCompressor");
  if (const auto time = data.child("FieldData").child("DataArray")) {
    EXPECT_STREQ(time.attribute("Name").value(), "TimeValue");
    result.seconds = std::stod(time.text().get());
  }
  result.positions.resize(piece.attribute("NumberOfPoints").as_ullong());
  result.triangles.resize(piece.attribute("NumberOfPolys").as_ullong());
  inflateArray(piece.child("Points").child("DataArray"), "Float32", appended, result.positions);
  if (const auto normals = piece.child("PointData").child("DataArray")) {
    EXPECT_STREQ(piece.child("PointData").attribute("Normals").value(), normals.attribute("Name").value());
    result.normals.resize(result.positions.size());
    inflateArray(normals, "Float32", appended, result.normals);
  }
  const auto named = [&](const char* name) {
    return piece.child("Polys").find_child_by_attribute("DataArray", "Name", name);
  };
  std::vector<std::uint32_t> ends(result.triangles.size());
  inflateArray(named("connectivity"), "Int32", appended, result.triangles);
  inflateArray(named("offsets"), "Int32", appended, ends);
  for (std::size_t i = 0; i < ends.size(); ++i) EXPECT_EQ(ends[i], 3 * (i + 1));
  return result;
}

}  // namespace

ReadMesh readMesh(const std::string& file) {
  const std::string extension = std::filesystem::path(file).extension();
  if (extension == ".obj") return readObj(file);
  if (extension == ".vtp") return readVtp(file);
  return readByAssimp(file);
}

}  // namespace isoreel::io
