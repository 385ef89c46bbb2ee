// SPDX-License-Identifier: BSD-3-Clause
// Uses everything that isoreel::decoder offers, so that its whole link line is needed: house.decoder_alone
// looks at it.
#include <isoreel/codec/player.h>
#include <isoreel/container/reader.h>

#include <cstdio>

int main(int argc, char** argv) {
  auto reader = isoreel::Reader::open(argc > 1 ? argv[1] : "-");
  if (!reader.ok()) {
    std::fprintf(stderr, "%s\n", reader.error().message.c_str());
    return 1;
  }
  isoreel::Player player(**reader);
  const auto surface = player.frame(0);
  return surface.ok() && surface->triangles().size() == surface->normals().size() ? 0 : 1;
}
