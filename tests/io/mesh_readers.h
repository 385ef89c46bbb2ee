// SPDX-License-Identifier: BSD-3-Clause
// Mesh files read back by something that did not write them.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace isoreel::io {

/// As it lies in the file.
struct ReadMesh {
  std::vector<std::array<float, 3>> positions;
  std::vector<std::array<float, 3>> normals;  // of vertices; of an STL file, of the facet, three times
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::optional<double> seconds;
};

/// By the extension of `file`: PLY, STL and GLB by Assimp, OBJ by hand, VTP by pugixml and zlib. A failed
/// expectation and an empty mesh when it is not readable.
ReadMesh readMesh(const std::string& file);

}  // namespace isoreel::io
