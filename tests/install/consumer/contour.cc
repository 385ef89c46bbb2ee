// SPDX-License-Identifier: BSD-3-Clause
// Reads volumes and writes their surfaces: everything that isoreel::io is linked with is needed.
#include <isoreel/codec/encoder.h>
#include <isoreel/io/mesh_writer.h>
#include <isoreel/io/volume_reader.h>

#include <cstdio>

int main(int argc, char** argv) {
  if (argc < 3) return 2;
  isoreel::Status status;
  auto volumes = isoreel::io::openVolumes({argv[1]});
  if (!volumes) return std::fprintf(stderr, "%s\n", volumes.error().message.c_str()), 1;
  auto volume = (*volumes)->read(0);
  if (!volume) return std::fprintf(stderr, "%s\n", volume.error().message.c_str()), 1;
  auto surface = isoreel::extractSurface(*volume, 0, isoreel::Inside::kBelow);
  if (!surface) return std::fprintf(stderr, "%s\n", surface.error().message.c_str()), 1;
  for (int i = 2; i < argc && status.ok(); ++i) status = isoreel::io::writeMesh(*surface, argv[i]);
  if (!status) return std::fprintf(stderr, "%s\n", status.error().message.c_str()), 1;
  std::printf("%zu quads\n", surface->quads.size());
  return 0;
}
