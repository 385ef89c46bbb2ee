// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <iterator>

#include "src/mesh.h"

namespace isoreel::io {

// Assimp's OBJ exporter would join vertices at equal positions, drop and reorder others and always add
// normals, so the mesh read back would not be the one that was decoded. Nine digits bring every float back.
Result<std::string> objOf(const Mesh& mesh, const MeshOptions&) {
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

}  // namespace isoreel::io
