// SPDX-License-Identifier: BSD-3-Clause
// Made volumes for the tests of the codec, and a plain reference of what their surfaces must be: no bricks,
// no bit tricks, nothing shared with the code under test but its public types.
#pragma once

#include <isoreel/codec/decoder.h>
#include <isoreel/codec/encoder.h>

#include <functional>
#include <random>
#include <string>
#include <vector>

namespace isoreel::made {

/// Thirty-two random bits at a time, the same on every machine.
class Random {
 public:
  explicit Random(std::uint32_t seed) : engine_(seed) {}
  std::uint32_t operator()() { return static_cast<std::uint32_t>(engine_()); }

 private:
  std::mt19937 engine_;
};

/// A scalar of grid coordinates, in cells.
using Field = std::function<double(double x, double y, double z)>;

struct Made {
  std::string name;
  Volume volume;
  double isovalue = 0;
  Inside inside = Inside::kBelow;
};

Grid gridOf(std::uint32_t nx, std::uint32_t ny, std::uint32_t nz);
Volume sampled(const Grid& grid, const Field& field);
Field sphere(double x, double y, double z, double radius);
/// A torus around the z axis through (x, y, z).
Field torus(double x, double y, double z, double radius, double tube);
Field clamped(Field field, double limit);
/// Normally distributed samples, the same on every machine.
Volume noise(const Grid& grid, std::uint64_t seed);

/// One of each kind of surface and of grid. Small enough to go through all of them in every property.
const std::vector<Made>& all();
/// As large as tests get: enough cells for the threads of a frame to have some each.
Made large(double shift = 0);
/// The one of that name.
const Made& named(const std::string& name);

EncoderSettings settings(const Made& made, std::uint32_t step = kCell / 16);
/// Encoded as frame 0; a failure ends the test with its message.
Packet encoded(const Made& made, std::uint32_t step = kCell / 16);
/// The same in profile main.
Packet encodedMain(const Made& made, std::uint32_t step = kCell / 16, const HeightSettings& heights = {});
/// What the extractor gives.
Surface extracted(const Made& made, CellVertices vertices = CellVertices::kOne,
                  VertexPlacement placement = VertexPlacement::kQef);

/// A cell of an octree level.
struct ReferenceCell {
  std::array<std::uint32_t, 3> at{};
  std::uint8_t corners = 0;
};

/// The active cells of an octree level, in Morton order, by the definitions of spec codec 4.1.
struct Reference {
  std::uint32_t shift = 0;  // log2 of the size of a cell
  std::array<std::uint32_t, 3> cells_in_grid{};
  std::vector<ReferenceCell> cells;
  std::vector<Quad> quads;  // spec codec 5.3
};
std::uint32_t depthOf(const Grid& grid);
Reference reference(const Made& made, std::uint32_t level);

/// Whether each directed edge of the quads runs as often as its reverse, edges at the grid's border excepted.
bool isClosed(const Reference& reference, const std::vector<Quad>& quads);
/// Root mean square distance of the triangles' centroids from a sphere, in the world.
double rmsToSphere(const Surface& surface, const Vec3d& centre, double radius);
/// The volume enclosed by a closed surface, by the divergence theorem over its triangles; world units.
double enclosedVolume(const Surface& surface);

/// Threads of its own for each call: tests that nothing depends on the order.
void threadedFor(std::size_t count, const std::function<void(std::size_t)>& body);

}  // namespace isoreel::made
