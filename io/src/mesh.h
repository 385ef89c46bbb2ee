// SPDX-License-Identifier: BSD-3-Clause
// One function for each mesh format: the bytes of its file.
#pragma once

#include <isoreel/io/mesh_writer.h>

#include <array>
#include <string>
#include <vector>

namespace isoreel::io {

/// A surface as other programs take it: single precision, world coordinates, triangles. It may be empty.
struct Mesh {
  std::vector<std::array<float, 3>> positions;
  std::vector<std::array<float, 3>> normals;  // as many as positions, or none
  std::vector<Triangle> triangles;
};

using MeshEncoder = Result<std::string>(const Mesh& mesh, const MeshOptions& options);

MeshEncoder plyOf;  // mesh_ply.cc
MeshEncoder objOf;  // mesh_obj.cc
MeshEncoder stlOf;  // mesh_stl.cc
MeshEncoder glbOf;  // mesh_glb.cc
MeshEncoder vtpOf;  // mesh_vtp.cc

}  // namespace isoreel::io
