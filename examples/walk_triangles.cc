// SPDX-License-Identifier: BSD-3-Clause
// Opens an .isr file and walks the triangles of every frame: prints the area of each, in world units squared.
#include <isoreel/codec/player.h>
#include <isoreel/container/reader.h>

#include <cmath>
#include <cstdio>

namespace {

double triangleArea(const isoreel::Vec3d& a, const isoreel::Vec3d& b, const isoreel::Vec3d& c) {
  const isoreel::Vec3d u{b[0] - a[0], b[1] - a[1], b[2] - a[2]};
  const isoreel::Vec3d v{c[0] - a[0], c[1] - a[1], c[2] - a[2]};
  return 0.5 * std::hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]);
}

int fail(const isoreel::Error& error) {
  std::fprintf(stderr, "%s\n", error.message.c_str());
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return std::fprintf(stderr, "usage: walk_triangles FILE.isr\n"), 2;

  auto reader = isoreel::Reader::open(argv[1]);
  if (!reader) return fail(reader.error());

  isoreel::Player player(**reader);
  for (std::uint64_t i = 0; i < player.frameCount(); ++i) {
    auto surface = player.frame(i);
    if (!surface) return fail(surface.error());

    double area = 0;
    for (const auto& [a, b, c] : surface->triangles()) {
      area += triangleArea(surface->world(a), surface->world(b), surface->world(c));
    }
    std::printf("frame %llu: area %.9g\n", static_cast<unsigned long long>(i), area);
  }
  return 0;
}
