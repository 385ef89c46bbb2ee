// SPDX-License-Identifier: BSD-3-Clause
#include "made.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <stdexcept>
#include <thread>

namespace isoreel::made {
namespace {

// Sum of uniform numbers, since the standard leaves its normal distribution's algorithm open.
double nearlyNormal(std::mt19937_64& random) {
  double sum = 0;
  for (int i = 0; i < 12; ++i) sum += static_cast<double>(random() >> 11) * 0x1p-53;
  return sum - 6;
}

std::uint64_t naiveMorton(const std::array<std::uint32_t, 3>& at) {
  std::uint64_t code = 0;
  for (std::uint32_t bit = 0; bit < 16; ++bit) {
    for (std::uint32_t axis = 0; axis < 3; ++axis)
      code |= std::uint64_t{at[axis] >> bit & 1} << (3 * bit + axis);
  }
  return code;
}

}  // namespace

Grid gridOf(std::uint32_t nx, std::uint32_t ny, std::uint32_t nz) {
  Grid grid;
  grid.nodes = {nx, ny, nz};
  return grid;
}

Volume sampled(const Grid& grid, const Field& field) {
  std::vector<float> samples;
  samples.reserve(grid.nodeCount());
  for (std::uint32_t z = 0; z < grid.nodes[2]; ++z) {
    for (std::uint32_t y = 0; y < grid.nodes[1]; ++y) {
      for (std::uint32_t x = 0; x < grid.nodes[0]; ++x) samples.push_back(static_cast<float>(field(x, y, z)));
    }
  }
  return Volume::own(grid, std::move(samples));
}

Field sphere(double x, double y, double z, double radius) {
  return [=](double px, double py, double pz) { return std::hypot(px - x, py - y, pz - z) - radius; };
}

Field torus(double x, double y, double z, double radius, double tube) {
  return [=](double px, double py, double pz) {
    return std::hypot(std::hypot(px - x, py - y) - radius, pz - z) - tube;
  };
}

Field clamped(Field field, double limit) {
  return [=](double x, double y, double z) { return std::clamp(field(x, y, z), -limit, limit); };
}

Volume noise(const Grid& grid, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  return sampled(grid, [&](double, double, double) { return nearlyNormal(random); });
}

namespace {

double gyroid(double x, double y, double z) {
  const double k = 2 * std::numbers::pi / 12;
  return std::sin(k * x) * std::cos(k * y) + std::sin(k * y) * std::cos(k * z) +
         std::sin(k * z) * std::cos(k * x);
}

}  // namespace

Made large(double shift) {
  return {"large", sampled(gridOf(40, 36, 38), [shift](double x, double y, double z) {
            return gyroid(x + shift, y, z + shift / 2);
          })};
}

const std::vector<Made>& all() {
  static const std::vector<Made> made = [] {
    const auto touching = [](double x, double y, double z) {
      return std::min(sphere(9, 10, 10, 6)(x, y, z), sphere(21, 10, 10, 6)(x, y, z));
    };
    const auto droplets = [](double x, double y, double z) {
      return std::min(
          {sphere(20.2, 31.7, 30.1, 12.3)(x, y, z), sphere(44.6, 30.3, 40.9, 9.7)(x, y, z), z - 11.37});
    };
    const Field half = sphere(0, 16.3, 16.1, 9.6);
    std::vector<Made> list;
    const auto add = [&](const char* name, Volume volume, double isovalue = 0,
                         Inside inside = Inside::kBelow) {
      list.push_back({name, std::move(volume), isovalue, inside});
    };
    add("sphere", sampled(gridOf(33, 33, 33), sphere(16.2, 15.9, 16.4, 11.3)));
    add("sphere_cut", sampled(gridOf(20, 33, 7), sphere(9.1, 16.5, 3.2, 8.7)));
    add("half_sphere", sampled(gridOf(33, 33, 33), half));
    add("torus", sampled(gridOf(40, 41, 20), torus(19.7, 20.2, 9.6, 12.4, 4.7)));
    add("gyroid", sampled(gridOf(30, 21, 26), gyroid));
    add("gyroid_above", sampled(gridOf(30, 21, 26), gyroid), 0.3, Inside::kAbove);
    add("touching_spheres", sampled(gridOf(31, 21, 21), touching));
    add("two_spheres", sampled(gridOf(40, 20, 20), [](double x, double y, double z) {
          return std::min(sphere(9, 10, 10, 6.3)(x, y, z), sphere(29, 10, 10, 7.2)(x, y, z));
        }));
    add("level_set", sampled(gridOf(65, 65, 65), clamped(droplets, 3)));
    add("plane_on_nodes", sampled(gridOf(20, 33, 7), [](double, double, double z) { return z - 3; }));
    add("tilted_plane",
        sampled(gridOf(20, 33, 7), [](double x, double y, double z) { return 0.3 * x + 0.2 * y + z - 9; }));
    add("noise_2x2x2", noise(gridOf(2, 2, 2), 4));
    add("noise_2x5x9", noise(gridOf(2, 5, 9), 5));
    add("noise_3x2x100", noise(gridOf(3, 2, 100), 6));
    add("noise_20x33x7", noise(gridOf(20, 33, 7), 7));
    add("noise_17", noise(gridOf(17, 17, 17), 8));
    add("sparse_noise", noise(gridOf(40, 37, 35), 9), -3.0);
    add("dense_noise_above", noise(gridOf(40, 37, 35), 10), -3.0, Inside::kAbove);
    add("specks", sampled(gridOf(65, 40, 50), [](double x, double y, double z) {
          const bool speck = (x == 3 && y == 5 && z == 7) || (x == 64 && y == 39 && z == 49) ||
                             (x == 0 && y == 20 && z == 49);
          return speck ? -1.0 : 1.0;
        }));
    // Two cells that each have one sheet, which crosses the face between them twice (spec codec 5.5).
    add("turned_face", sampled(gridOf(6, 5, 5), [](double x, double y, double z) {
          const bool square = y >= 1 && y <= 2 && z >= 1 && z <= 2;
          const bool inside = square && (x == 1 || (x == 2 && y == z) || (x == 3 && y <= z));
          return (inside ? -1 : 1) * (1 + (7 * x + 3 * y + 5 * z) / 64);
        }));
    add("empty", sampled(gridOf(12, 9, 14), [](double, double, double) { return 1.0; }));
    add("all_inside", sampled(gridOf(12, 9, 14), [](double, double, double) { return -1.0; }));
    return list;
  }();
  return made;
}

const Made& named(const std::string& name) {
  for (const Made& made : all()) {
    if (made.name == name) return made;
  }
  throw std::invalid_argument("no made volume " + name);
}

EncoderSettings settings(const Made& made, std::uint32_t step) {
  EncoderSettings result;
  result.configuration.profile = Profile::kClassic;
  result.configuration.grid = made.volume.grid;
  result.configuration.inside = made.inside;
  result.configuration.step = step;
  return result;
}

namespace {

Packet encodedWith(const Made& made, const EncoderSettings& with) {
  auto encoder = Encoder::create(with);
  if (!encoder) throw std::runtime_error(encoder.error().message);
  FrameTiming timing;
  timing.isovalue = made.isovalue;
  auto packet = encoder->encode(made.volume, timing);
  if (!packet) throw std::runtime_error(packet.error().message);
  return *std::move(packet);
}

}  // namespace

Packet encoded(const Made& made, std::uint32_t step) { return encodedWith(made, settings(made, step)); }

Surface extracted(const Made& made, CellVertices vertices, VertexPlacement placement) {
  auto surface = extractSurface(made.volume, made.isovalue, made.inside, placement, NonFinite::kRefuse,
                                serialFor, vertices);
  EXPECT_TRUE(surface.ok()) << surface.status().message();
  return *std::move(surface);
}

Packet encodedMain(const Made& made, std::uint32_t step, const HeightSettings& heights) {
  EncoderSettings with = settings(made, step);
  with.configuration.profile = Profile::kMain;
  with.heights = heights;
  return encodedWith(made, with);
}

std::uint32_t depthOf(const Grid& grid) {
  const std::uint32_t cells = std::max({grid.nodes[0], grid.nodes[1], grid.nodes[2]}) - 1;
  std::uint32_t depth = 0;
  while ((1u << depth) < cells) ++depth;
  return depth;
}

Reference reference(const Made& made, std::uint32_t level) {
  const Grid& grid = made.volume.grid;
  Reference result;
  result.shift = depthOf(grid) - level;
  const std::uint32_t size = 1u << result.shift;
  std::array<std::uint32_t, 3> last{};
  for (std::size_t k = 0; k < 3; ++k) {
    last[k] = (grid.nodes[k] - 1) / size;
    result.cells_in_grid[k] = (grid.nodes[k] - 1 + size - 1) / size;
  }
  const auto sign = [&](std::uint32_t x, std::uint32_t y, std::uint32_t z) {
    return isInside(
        made.volume.at(std::min(x, last[0]) * size, std::min(y, last[1]) * size, std::min(z, last[2]) * size),
        made.isovalue, made.inside);
  };
  for (std::uint32_t z = 0; z < result.cells_in_grid[2]; ++z) {
    for (std::uint32_t y = 0; y < result.cells_in_grid[1]; ++y) {
      for (std::uint32_t x = 0; x < result.cells_in_grid[0]; ++x) {
        std::uint32_t corners = 0;
        for (std::uint32_t j = 0; j < 8; ++j)
          corners |= std::uint32_t{sign(x + (j & 1), y + (j >> 1 & 1), z + (j >> 2))} << j;
        if (corners != 0 && corners != 255)
          result.cells.push_back({{x, y, z}, static_cast<std::uint8_t>(corners)});
      }
    }
  }
  std::sort(result.cells.begin(), result.cells.end(), [](const ReferenceCell& a, const ReferenceCell& b) {
    return naiveMorton(a.at) < naiveMorton(b.at);
  });
  std::map<std::array<std::uint32_t, 3>, std::uint32_t> number;
  for (std::uint32_t i = 0; i < result.cells.size(); ++i) number[result.cells[i].at] = i;
  for (const ReferenceCell& cell : result.cells) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
      const bool low = cell.corners & 1, high = cell.corners >> (1u << axis) & 1;
      if (low == high || cell.at[u] == 0 || cell.at[v] == 0) continue;
      std::array<std::uint32_t, 3> back_u = cell.at, back_v = cell.at, back_uv = cell.at;
      --back_u[u], --back_uv[u], --back_v[v], --back_uv[v];
      Quad quad{number.at(cell.at), number.at(back_u), number.at(back_uv), number.at(back_v)};
      if (!low) std::swap(quad[1], quad[3]);
      result.quads.push_back(quad);
    }
  }
  return result;
}

bool isClosed(const Reference& reference, const std::vector<Quad>& quads) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> balance;
  for (const Quad& quad : quads) {
    for (std::size_t k = 0; k < 4; ++k) {
      const std::uint32_t a = quad[k], b = quad[(k + 1) % 4];
      balance[std::minmax(a, b)] += a < b ? 1 : -1;
    }
  }
  for (const auto& [edge, count] : balance) {
    if (count == 0) continue;
    // The edge crosses the face between two cells; one at the border has a side of the face there.
    const auto& a = reference.cells[edge.first].at;
    const auto& b = reference.cells[edge.second].at;
    bool at_border = false;
    for (std::size_t k = 0; k < 3; ++k)
      at_border |= a[k] == b[k] && (a[k] == 0 || a[k] + 1 == reference.cells_in_grid[k]);
    if (!at_border) return false;
  }
  return true;
}

double rmsToSphere(const Surface& surface, const Vec3d& centre, double radius) {
  double squares = 0, count = 0;
  for (const Triangle& t : surface.triangles()) {
    Vec3d way{-centre[0], -centre[1], -centre[2]};
    for (const std::uint32_t i : t) {
      for (std::size_t k = 0; k < 3; ++k) way[k] += surface.world(i)[k] / 3;
    }
    const double error = std::hypot(way[0], way[1], way[2]) - radius;
    squares += error * error;
    ++count;
  }
  return std::sqrt(squares / count);
}

double enclosedVolume(const Surface& surface) {
  double six_times = 0;
  for (const Triangle& t : surface.triangles()) {
    const Vec3d a = surface.world(t[0]), b = surface.world(t[1]), c = surface.world(t[2]);
    six_times += a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                 a[2] * (b[0] * c[1] - b[1] * c[0]);
  }
  return six_times / 6;
}

void threadedFor(std::size_t count, const std::function<void(std::size_t)>& body) {
  std::atomic<std::size_t> next{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < 3; ++i) {
    threads.emplace_back([&] {
      for (std::size_t mine = next++; mine < count; mine = next++) body(count - 1 - mine);
    });
  }
  for (std::thread& thread : threads) thread.join();
}

}  // namespace isoreel::made
