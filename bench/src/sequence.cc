// SPDX-License-Identifier: BSD-3-Clause
#include "sequence.h"

#include <isoreel/io/volume_reader.h>

#include <cmath>

#include "measure.h"
#include "parallel.h"

namespace isoreel::bench {
namespace {

double contrastOf(const Frame& frame) {
  const Grid& grid = frame.volume.grid;
  std::vector<double> differences;
  for (std::uint32_t z = 0; z < grid.nodes[2]; ++z) {
    for (std::uint32_t y = 0; y < grid.nodes[1]; ++y) {
      for (std::uint32_t x = 1; x < grid.nodes[0]; ++x) {
        const float a = frame.volume.at(x - 1, y, z), b = frame.volume.at(x, y, z);
        if (isInside(a, frame.isovalue, frame.inside) == isInside(b, frame.isovalue, frame.inside)) continue;
        const double difference = std::abs(static_cast<double>(a) - static_cast<double>(b));
        if (std::isfinite(difference)) differences.push_back(difference);
      }
    }
  }
  return differences.empty() ? 1 : median(std::move(differences));
}

}  // namespace

std::size_t Sequence::vertices() const {
  std::size_t count = 0;
  for (const Frame& frame : frames) count += frame.extracted.points.size();
  return count;
}

Result<Sequence> loadSequence(const Json& set) {
  ISOREEL_ASSIGN(const auto volumes, io::openVolumes(set.at("inputs").get<std::vector<std::string>>(),
                                                     {.array = set.value("grid", "")}));
  auto isovalues = set.value("isovalues", std::vector<double>{});
  if (isovalues.empty() && !volumes->levelSet())
    return {ErrorCode::kInvalidArgument, volumes->name(0) + ": is no level set, so isovalues are needed"};
  if (isovalues.empty()) isovalues = {0};
  if (isovalues.size() == 1) isovalues.assign(volumes->size(), isovalues[0]);
  if (isovalues.size() != volumes->size() && volumes->size() != 1)
    return {ErrorCode::kInvalidArgument,
            volumes->name(0) + ": as many isovalues as volumes, or one of either"};

  Sequence sequence;
  const bool below = set.value("inside", volumes->levelSet() ? "below" : "above") == "below";
  sequence.configuration.inside = below ? Inside::kBelow : Inside::kAbove;
  sequence.configuration.grid = volumes->grid();
  Volume volume;
  for (std::size_t i = 0; i < isovalues.size(); ++i) {
    const std::size_t number = volumes->size() == 1 ? 0 : i;
    if (i == 0 || number != 0) {
      ISOREEL_ASSIGN(volume, volumes->read(number));
    }
    Frame frame{volume, number, isovalues[i], sequence.configuration.inside, {}};
    const auto surface = extractSurface(volume, frame.isovalue, frame.inside, VertexPlacement::kQef,
                                        NonFinite::kRefuse, parallelFor);
    if (!surface) return surface.status().at(volumes->name(number));
    frame.extracted = inspect::meshOf(*surface);
    if (!frame.extracted.triangles.empty()) sequence.frames.push_back(std::move(frame));
  }
  if (sequence.frames.empty()) return {ErrorCode::kNotFound, volumes->name(0) + ": no frame has a surface"};
  sequence.contrast = contrastOf(sequence.frames[0]);
  return sequence;
}

}  // namespace isoreel::bench
