// SPDX-License-Identifier: BSD-3-Clause
// Binary glTF 2.0 (Khronos, glTF 2.0 specification, 3.6 and 4): a JSON chunk that describes a binary chunk.
// Assimp's exporter always joins vertices less than 1e-5 apart, whatever their unit: a mesh of a grid in
// micrometres comes out changed.
#include <fmt/format.h>

#include <bit>
#include <limits>
#include <nlohmann/json.hpp>

#include "src/mesh.h"

namespace isoreel::io {
namespace {

using nlohmann::ordered_json;
using Vectors = std::vector<std::array<float, 3>>;

static_assert(std::endian::native == std::endian::little, "arrays are written as they lie in memory");

constexpr int kFloat = 5126, kUnsignedInt = 5125;                  // component types
constexpr int kArrayBuffer = 34962, kElementArrayBuffer = 34963;   // what buffer views are for
constexpr std::uint32_t kMagic = 0x46546c67, kVersion = 2;         // "glTF"
constexpr std::uint32_t kJson = 0x4e4f534a, kBinary = 0x004e4942;  // "JSON", "BIN"

void appendWord(std::string& out, std::uint32_t value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// The document and the bytes it speaks of.
struct Glb {
  ordered_json document = ordered_json::parse(
      R"({"asset": {"version": "2.0", "generator": "isoreel"}, "scene": 0, "scenes": [{"nodes": [0]}],
          "nodes": [{"name": "surface"}]})");
  std::string binary;

  /// Adds values of three components each, as an array of `count` elements; gives the accessor.
  template <class Value>
  ordered_json& add(const std::vector<Value>& values, int target, int component, const char* type,
                    std::size_t count) {
    const std::size_t bytes = values.size() * sizeof(Value);
    document["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", binary.size()}, {"byteLength", bytes}, {"target", target}});
    document["accessors"].push_back({{"bufferView", document["bufferViews"].size() - 1},
                                     {"componentType", component},
                                     {"count", count},
                                     {"type", type}});
    binary.append(reinterpret_cast<const char*>(values.data()), bytes);
    return document["accessors"].back();
  }
};

// The specification asks for the bounds of positions.
void addBounds(ordered_json& accessor, const Vectors& positions) {
  auto low = positions.front(), high = positions.front();
  for (const auto& p : positions) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], p[axis]);
      high[axis] = std::max(high[axis], p[axis]);
    }
  }
  accessor["min"] = low;
  accessor["max"] = high;
}

// It also asks for normals of length one, which a vertex without a triangle does not have.
Vectors unitNormals(Vectors normals) {
  for (auto& n : normals) {
    if (n == std::array<float, 3>{0, 0, 0}) n = {0, 0, 1};
  }
  return normals;
}

}  // namespace

Result<std::string> glbOf(const Mesh& mesh, const MeshOptions&) {
  const std::uint64_t bytes =
      12 * (std::uint64_t{mesh.positions.size()} + mesh.normals.size() + mesh.triangles.size());
  if (bytes > std::numeric_limits<std::uint32_t>::max() - 4096) {
    return {ErrorCode::kLimit, fmt::format("{} bytes do not fit a GLB file, which ends at 4 GiB", bytes)};
  }
  Glb glb;
  if (!mesh.triangles.empty()) {
    ordered_json primitive;
    addBounds(glb.add(mesh.positions, kArrayBuffer, kFloat, "VEC3", mesh.positions.size()), mesh.positions);
    primitive["attributes"]["POSITION"] = 0;
    if (!mesh.normals.empty()) {
      glb.add(unitNormals(mesh.normals), kArrayBuffer, kFloat, "VEC3", mesh.normals.size());
      primitive["attributes"]["NORMAL"] = 1;
    }
    glb.add(mesh.triangles, kElementArrayBuffer, kUnsignedInt, "SCALAR", 3 * mesh.triangles.size());
    primitive["indices"] = glb.document["accessors"].size() - 1;
    glb.document["nodes"][0]["mesh"] = 0;
    glb.document["meshes"][0] = {{"name", "surface"}, {"primitives", ordered_json::array({primitive})}};
    glb.document["buffers"][0]["byteLength"] = glb.binary.size();
  }
  std::string json = glb.document.dump();
  json.resize((json.size() + 3) / 4 * 4, ' ');

  const auto size = [](const std::string& chunk) { return static_cast<std::uint32_t>(chunk.size()); };
  std::string file;
  appendWord(file, kMagic);
  appendWord(file, kVersion);
  appendWord(file, 12 + 8 + size(json) + (glb.binary.empty() ? 0 : 8 + size(glb.binary)));
  appendWord(file, size(json));
  appendWord(file, kJson);
  file += json;
  if (!glb.binary.empty()) {
    appendWord(file, size(glb.binary));
    appendWord(file, kBinary);
    file += glb.binary;
  }
  return file;
}

}  // namespace isoreel::io
