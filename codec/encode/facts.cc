// SPDX-License-Identifier: BSD-3-Clause
#include "encode/facts.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

#include "lattice/sheets.h"
#include "lattice/triangulate.h"

namespace isoreel {
namespace {

double surfaceArea(const Surface& surface) {
  double area = 0;
  forEachTriangle(surface, [&](const Triangle&, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    area += std::sqrt(squaredLength(cross(minus(b, a), minus(c, a)))) / 2;
  });
  return area;
}

/// World volume of one cell.
double cellVolume(const Grid& grid) {
  return std::abs(determinant(grid)) * grid.spacing[0] * grid.spacing[1] * grid.spacing[2];
}

/// How much more is inside than if every sign-changing edge were crossed in its middle, in cells: an edge's
/// crossing is the mean of the vertices around it, and the three axes are averaged. Each cell has a quarter
/// of its edges, at the border too, where fewer cells share an edge of which less counts.
double insideCorrection(const Surface& surface, std::span<const Cell> cells) {
  double sum = 0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const std::array<std::int32_t, 3> base{cells[i].x, cells[i].y, cells[i].z};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      int balance = 0;  // edges whose low end is inside, minus those whose high end is
      for (std::uint32_t corner = 0; corner < 8; ++corner) {
        if (corner >> axis & 1) continue;
        balance += (cells[i].corners >> corner & 1) - (cells[i].corners >> (corner | 1u << axis) & 1);
      }
      sum += balance * (static_cast<double>(surface.vertices[i][axis] - base[axis] * kCell) / kCell - 0.5);
    }
  }
  return sum / 12;
}

std::uint32_t root(std::vector<std::uint32_t>& parents, std::uint32_t i) {
  while (parents[i] != i) i = parents[i] = parents[parents[i]];
  return i;
}

}  // namespace

void measureSurface(const Surface& surface, std::span<const Cell> cells, double inside_cells,
                    FrameHeader& header) {
  header.vertices = static_cast<std::uint32_t>(surface.vertices.size());
  header.faces = static_cast<std::uint32_t>(surface.quads.size());
  header.area = surfaceArea(surface);
  header.volume = (inside_cells + insideCorrection(surface, cells)) * cellVolume(surface.grid);
  header.surface_hash = surfaceHash(surface);

  // Edges of the mesh join cells that share a face: bit a + 3 n of a vertex marks its edge towards sheet n of
  // the cell one lower along a.
  std::vector<std::uint16_t> edges(surface.vertices.size(), 0);
  std::vector<bool> used(surface.vertices.size(), false);
  std::vector<std::uint32_t> parents(surface.vertices.size());
  std::iota(parents.begin(), parents.end(), 0u);
  for (const Quad& quad : surface.quads) {
    for (std::size_t k = 0; k < 4; ++k) {
      const std::uint32_t a = quad[k], b = quad[(k + 1) % 4];
      std::size_t bit = cells[a].x != cells[b].x ? 0 : cells[a].y != cells[b].y ? 1 : 2;
      const auto [low, high] = std::minmax(a, b);  // Morton order: the higher cell comes later
      for (std::uint32_t i = low; i > 0 && sameCell(cells[i - 1], cells[low]); --i) bit += 3;
      edges[high] = static_cast<std::uint16_t>(edges[high] | 1u << bit);
      used[a] = true;
      if (k < 3) parents[root(parents, a)] = root(parents, b);
    }
  }
  header.components = 0;
  header.euler = static_cast<std::int64_t>(surface.quads.size());
  bool first = true;
  for (std::uint32_t i = 0; i < used.size(); ++i) {
    if (!used[i]) continue;
    header.components += parents[i] == i;
    header.euler += 1 - std::popcount(edges[i]);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::uint32_t position = static_cast<std::uint32_t>(surface.vertices[i][axis]);
      header.box_min[axis] = first ? position : std::min(header.box_min[axis], position);
      header.box_max[axis] = first ? position : std::max(header.box_max[axis], position);
    }
    first = false;
  }
}

}  // namespace isoreel
