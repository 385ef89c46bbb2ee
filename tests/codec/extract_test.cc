// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "extract/octree.h"
#include "extract/sign_bitmap.h"
#include "lattice/cell_index.h"
#include "made.h"

namespace isoreel {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

using made::extracted;

/// Cells of the vertices by the reference, each vertex checked to lie in its own.
void expectVerticesInCells(const made::Reference& reference, const std::vector<GridPosition>& vertices) {
  ASSERT_EQ(vertices.size(), reference.cells.size());
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int32_t base = static_cast<std::int32_t>(reference.cells[i].at[k]) * kCell;
      ASSERT_GE(vertices[i][k], base);
      ASSERT_LE(vertices[i][k], base + kCell);
    }
  }
}

TEST(SignBitmap, AgreesWithTheSamples) {
  for (const made::Made& m : made::all()) {
    SCOPED_TRACE(m.name);
    const auto& n = m.volume.grid.nodes;
    const auto bitmap =
        SignBitmap::make(m.volume, m.isovalue, m.inside, NonFinite::kRefuse, made::threadedFor);
    ASSERT_TRUE(bitmap.ok());
    double inside_cells = 0;
    for (std::uint32_t z = 0; z < n[2]; ++z) {
      for (std::uint32_t y = 0; y < n[1]; ++y) {
        for (std::uint32_t x = 0; x < n[0]; ++x) {
          const bool inside = isInside(m.volume.at(x, y, z), m.isovalue, m.inside);
          ASSERT_EQ(bitmap->at(x, y, z), inside);
          const auto part = [](std::uint32_t i, std::uint32_t count) {
            return i == 0 || i + 1 == count ? 0.5 : 1.0;
          };
          if (inside) inside_cells += part(x, n[0]) * part(y, n[1]) * part(z, n[2]);
        }
      }
    }
    EXPECT_NEAR(bitmap->insideCells(), inside_cells, 1e-6);
    const std::vector<Cell> cells = bitmap->activeCells(made::threadedFor);
    const made::Reference reference = made::reference(m, made::depthOf(m.volume.grid));
    ASSERT_EQ(cells.size(), reference.cells.size());
    for (std::size_t i = 0; i < cells.size(); ++i) {
      ASSERT_EQ((std::array<std::uint32_t, 3>{cells[i].x, cells[i].y, cells[i].z}), reference.cells[i].at);
      ASSERT_EQ(cells[i].corners, reference.cells[i].corners);
    }
  }
}

TEST(SignBitmap, HandlesRowsAroundTheWordSize) {
  for (const std::uint32_t width : {2u, 63u, 64u, 65u, 66u, 127u, 128u, 129u}) {
    made::Made m{"row", made::noise(made::gridOf(width, 3, 2), width), 0, Inside::kAbove};
    const auto bitmap = SignBitmap::make(m.volume, 0, m.inside, NonFinite::kRefuse, serialFor);
    ASSERT_TRUE(bitmap.ok());
    EXPECT_EQ(bitmap->activeCells(serialFor).size(),
              made::reference(m, made::depthOf(m.volume.grid)).cells.size())
        << width;
  }
}

TEST(Extract, MeshIsThatOfTheReference) {
  for (const made::Made& m : made::all()) {
    SCOPED_TRACE(m.name);
    const made::Reference reference = made::reference(m, made::depthOf(m.volume.grid));
    for (const VertexPlacement placement : {VertexPlacement::kQef, VertexPlacement::kCentroid}) {
      const Surface surface = extracted(m, CellVertices::kOne, placement);
      expectVerticesInCells(reference, surface.vertices);
      EXPECT_EQ(surface.quads, reference.quads);
    }
  }
}

TEST(Extract, MeshOfSheetsIsThatOfProfileMain) {
  for (const made::Made& m : made::all()) {
    SCOPED_TRACE(m.name);
    const Surface cells = extracted(m), sheets = extracted(m, CellVertices::kOnePerSheet);
    Decoder decoder;
    const auto decoded = decoder.decode(made::encodedMain(m).data);
    ASSERT_TRUE(decoded.ok());
    EXPECT_EQ(sheets.quads, decoded->quads);
    ASSERT_EQ(sheets.vertices.size(), decoder.cells().size());
    std::size_t cell = 0;  // of the sheet
    for (std::size_t i = 0; i < sheets.vertices.size(); ++i) {
      const Cell& here = decoder.cells()[i];
      const bool first = i == 0 || !sameCell(decoder.cells()[i - 1], here);
      const bool alone =
          first && (i + 1 == sheets.vertices.size() || !sameCell(here, decoder.cells()[i + 1]));
      cell += first && i > 0 ? 1u : 0u;
      const std::array<std::int32_t, 3> corner{here.x, here.y, here.z};
      for (std::size_t k = 0; k < 3; ++k) {
        ASSERT_GE(sheets.vertices[i][k], corner[k] * kCell);
        ASSERT_LE(sheets.vertices[i][k], (corner[k] + 1) * kCell);
      }
      if (alone) {
        ASSERT_EQ(sheets.vertices[i], cells.vertices[cell]);
      }
    }
  }
}

TEST(Extract, VerticesOfASphereLieOnIt) {
  const made::Made& m = made::named("sphere");
  for (const VertexPlacement placement : {VertexPlacement::kQef, VertexPlacement::kCentroid}) {
    for (const GridPosition& p : extracted(m, CellVertices::kOne, placement).vertices) {
      const double r =
          std::hypot(p[0] / double{kCell} - 16.2, p[1] / double{kCell} - 15.9, p[2] / double{kCell} - 16.4);
      ASSERT_NEAR(r, 11.3, placement == VertexPlacement::kQef ? 0.06 : 0.12);
    }
  }
}

/// A field that is the largest of the distances to some planes of the axes: a corner of a box.
made::Made corner(int planes) {
  return {"corner", made::sampled(made::gridOf(17, 17, 17), [planes](double x, double y, double z) {
            double value = x - 8.3;
            if (planes > 1) value = std::max(value, y - 8.4);
            if (planes > 2) value = std::max(value, z - 8.6);
            return value;
          })};
}

TEST(Qef, ReproducesPlanesOfRankOne) {
  for (const GridPosition& p : extracted(corner(1)).vertices) ASSERT_NEAR(p[0] / double{kCell}, 8.3, 1e-3);
}

TEST(Qef, MovesTowardsSharpEdgesAndCorners) {
  // Central differences blur the gradient over a cell, so that a feature between nodes can't be hit exactly:
  // but the planes must pull the vertex towards it from where the mass point is.
  for (const int planes : {2, 3}) {
    const made::Made m = corner(planes);
    const Surface qef = extracted(m), centroid = extracted(m, CellVertices::kOne, VertexPlacement::kCentroid);
    std::size_t features = 0;
    const std::array<double, 3> target{8.3, 8.4, 8.6};
    for (std::size_t i = 0; i < qef.vertices.size(); ++i) {
      bool on_feature = true;
      double qef_distance = 0, centroid_distance = 0;
      for (std::size_t k = 0; k < static_cast<std::size_t>(planes); ++k) {
        on_feature &= centroid.vertices[i][k] >= 8 * kCell && centroid.vertices[i][k] <= 9 * kCell;
        qef_distance = std::max(qef_distance, std::abs(qef.vertices[i][k] / double{kCell} - target[k]));
        centroid_distance =
            std::max(centroid_distance, std::abs(centroid.vertices[i][k] / double{kCell} - target[k]));
      }
      if (!on_feature) continue;
      ++features;
      EXPECT_LT(qef_distance, centroid_distance) << planes << " planes";
    }
    EXPECT_EQ(features, planes == 2 ? 16u : 1u);
  }
}

TEST(Extract, SampleEqualToTheIsovalueIsOutsideAndTheVertexAtTheNode) {
  // Inside below: nodes at z = 3 are outside, so the plane passes exactly through them.
  const made::Made& m = made::named("plane_on_nodes");
  for (const GridPosition& p : extracted(m).vertices) ASSERT_EQ(p[2], 3 * kCell);
  EXPECT_FALSE(isInside(1.5f, 1.5, Inside::kBelow));
  EXPECT_FALSE(isInside(1.5f, 1.5, Inside::kAbove));
  // Samples above the plane are inside under the other rule: the same plane from the other side.
  made::Made above = m;
  above.inside = Inside::kAbove;
  for (const GridPosition& p : extracted(above).vertices) ASSERT_EQ(p[2], 3 * kCell);
}

TEST(Extract, NamesTheFirstSampleThatIsNotFinite) {
  const auto error = [](std::initializer_list<std::pair<std::size_t, float>> bad) {
    const Grid grid = made::gridOf(5, 4, 3);
    std::vector<float> samples(grid.nodeCount(), -1.0f);
    for (const auto& [at, value] : bad) samples[at] = value;
    const auto result = extractSurface(Volume::own(grid, std::move(samples)), 0, Inside::kBelow,
                                       VertexPlacement::kQef, NonFinite::kRefuse, made::threadedFor);
    return result.ok() ? std::string("none") : result.error().message;
  };
  EXPECT_EQ(error({}), "none");
  EXPECT_NE(
      error({{7, kNan}, {2 + 5 * (3 + 4 * 2), kInfinity}}).find("sample at node (2, 1, 0) is not a number"),
      std::string::npos);
  EXPECT_NE(error({{2 + 5 * (3 + 4 * 2), kInfinity}}).find("node (2, 3, 2) is +infinity"), std::string::npos);
  EXPECT_NE(error({{59, kNan}, {21, -kInfinity}, {22, kNan}}).find("node (1, 0, 1) is -infinity"),
            std::string::npos);
}

TEST(Extract, SamplesThatAreNotFiniteCanBeOutside) {
  made::Made m = made::named("sphere");
  std::vector<float> samples(m.volume.samples.begin(), m.volume.samples.end());
  const std::size_t centre = m.volume.grid.nodeIndex(16, 16, 16);
  for (const float value : {kNan, kInfinity, -kInfinity}) {
    samples[centre] = value;
    m.volume = Volume::own(m.volume.grid, samples);
    const auto surface = extractSurface(m.volume, 0, Inside::kBelow, VertexPlacement::kCentroid,
                                        NonFinite::kOutside, serialFor, CellVertices::kOne);
    ASSERT_TRUE(surface.ok());
    const made::Reference reference = made::reference(m, 6 - 1);
    expectVerticesInCells(reference, surface->vertices);
    EXPECT_TRUE(made::isClosed(reference, surface->quads));
    // The hole around the sample: half-way to each neighbour, so its eight vertices lie a sixth from the
    // centre.
    std::size_t around = 0;
    for (const GridPosition& p : surface->vertices) {
      double largest = 0;
      for (const std::int32_t x : p) largest = std::max(largest, std::abs(x / double{kCell} - 16));
      if (largest > 1) continue;
      ++around;
      EXPECT_NEAR(largest, 1.0 / 6, 1e-3);
    }
    EXPECT_EQ(around, 8u);
  }
}

TEST(Extract, RefusesGridsThatBreakTheRules) {
  Grid grid = made::gridOf(1, 2, 2);
  EXPECT_FALSE(extractSurface(Volume::own(grid, {0, 0, 0, 0}), 0, Inside::kBelow).ok());
  grid = made::gridOf(2, 2, 2);
  grid.spacing[1] = 0;
  EXPECT_FALSE(checkGrid(grid).ok());
  grid.spacing[1] = kInfinity;
  EXPECT_FALSE(checkGrid(grid).ok());
  grid.spacing[1] = 1;
  grid.direction[4] = kNan;
  EXPECT_FALSE(checkGrid(grid).ok());
  grid.direction[4] = 1;
  grid.nodes[2] = kMaxNodes + 1;
  EXPECT_FALSE(checkGrid(grid).ok());
  grid.nodes[2] = kMaxNodes;
  EXPECT_TRUE(checkGrid(grid).ok());
}

TEST(SparseOctree, HoldsTheCellsAboveTheActiveOnes) {
  const made::Made& m = made::named("noise_20x33x7");
  const auto bitmap = SignBitmap::make(m.volume, m.isovalue, m.inside, NonFinite::kRefuse, serialFor);
  ASSERT_TRUE(bitmap.ok());
  const std::vector<Cell> cells = bitmap->activeCells(serialFor);
  const SparseOctree octree(cells, 5);
  EXPECT_EQ(octree.level(0), std::vector<std::uint64_t>{0});
  for (std::uint32_t level = 1; level <= 5; ++level) {
    const auto& codes = octree.level(level);
    EXPECT_TRUE(std::is_sorted(codes.begin(), codes.end()));
    for (const std::uint64_t code : codes) {
      EXPECT_TRUE(
          std::binary_search(octree.level(level - 1).begin(), octree.level(level - 1).end(), code >> 3));
    }
  }
  EXPECT_EQ(octree.level(5).size(), cells.size());
}

}  // namespace
}  // namespace isoreel
