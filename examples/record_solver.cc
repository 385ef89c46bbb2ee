// SPDX-License-Identifier: BSD-3-Clause
// A solver that keeps its surface as it runs: each step's level set goes from memory into an .isr file.
#include <isoreel/codec/encoder.h>
#include <isoreel/container/writer.h>

#include <cmath>
#include <cstdio>

namespace {

// Stands for a solver: signed distance to a ball that rises and swells, in metres.
std::vector<float> solverStep(const isoreel::Grid& grid, double seconds) {
  std::vector<float> phi(grid.nodeCount());
  for (std::uint32_t z = 0; z < grid.nodes[2]; ++z) {
    for (std::uint32_t y = 0; y < grid.nodes[1]; ++y) {
      for (std::uint32_t x = 0; x < grid.nodes[0]; ++x) {
        const auto [wx, wy, wz] = grid.world(isoreel::Vec3d{double(x), double(y), double(z)});
        const double distance = std::hypot(wx - 0.5, wy - 0.5, wz - 0.3 - seconds);
        phi[grid.nodeIndex(x, y, z)] = static_cast<float>(distance - 0.2 - 0.2 * seconds);
      }
    }
  }
  return phi;
}

int fail(const isoreel::Error& error) {
  std::fprintf(stderr, "%s\n", error.message.c_str());
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return std::fprintf(stderr, "usage: record_solver OUT.isr\n"), 2;

  isoreel::EncoderSettings settings;
  isoreel::Configuration& configuration = settings.configuration;
  configuration.inside = isoreel::Inside::kBelow;  // of a level set
  configuration.grid.nodes = {33, 33, 33};
  configuration.grid.spacing = {1.0 / 32, 1.0 / 32, 1.0 / 32};
  configuration.time_base = {1, 1000};  // milliseconds

  auto encoder = isoreel::Encoder::create(settings);
  if (!encoder) return fail(encoder.error());

  isoreel::WriterSettings file;
  file.time_base = configuration.time_base;
  file.configuration = encoder->configurationRecord();
  auto writer = isoreel::Writer::create(argv[1], file);
  if (!writer) return fail(writer.error());

  for (std::uint64_t i = 0; i < 10; ++i) {
    const std::int64_t milliseconds = static_cast<std::int64_t>(40 * i);
    auto volume = isoreel::Volume::own(
        configuration.grid, solverStep(configuration.grid, static_cast<double>(milliseconds) / 1000));
    auto packet = encoder->encode(volume, {.number = i, .time = milliseconds, .duration = 40});
    if (!packet) return fail(packet.error());
    if (auto status = (*writer)->write(*packet); !status) return fail(status.error());
  }
  if (auto status = (*writer)->finish(); !status) return fail(status.error());
  return 0;
}
