// SPDX-License-Identifier: BSD-3-Clause
// A vertex for each sheet of a cell: the mesh is a 2-manifold, whatever the signs (spec codec 5.5).
#include "lattice/sheets.h"

#include <gtest/gtest.h>
#include <isoreel/inspect/manifold.h>

#include <bit>
#include <set>

#include "cells.h"
#include "lattice/dual_mesh.h"
#include "lattice/surroundings.h"

namespace isoreel {
namespace {

using inspect::manifoldness;

/// The signs of all nodes of a small grid, and what follows from them.
struct Signs {
  std::array<int, 3> nodes;
  std::vector<bool> inside;

  Signs(int nx, int ny, int nz, bool fill)
      : nodes{nx, ny, nz}, inside(static_cast<std::size_t>(nx * ny * nz), fill) {}
  std::vector<bool>::reference at(int x, int y, int z) {
    return inside[static_cast<std::size_t>(x + nodes[0] * (y + nodes[1] * z))];
  }
  std::vector<Cell> cells() {
    std::vector<Cell> result;
    for (int z = 0; z + 1 < nodes[2]; ++z) {
      for (int y = 0; y + 1 < nodes[1]; ++y) {
        for (int x = 0; x + 1 < nodes[0]; ++x) {
          std::uint32_t corners = 0;
          for (int j = 0; j < 8; ++j)
            corners |= std::uint32_t{at(x + (j & 1), y + (j >> 1 & 1), z + (j >> 2))} << j;
          if (corners != 0 && corners != 255) {
            result.push_back({static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y),
                              static_cast<std::uint16_t>(z), static_cast<std::uint8_t>(corners)});
          }
        }
      }
    }
    made::sortByMortonCode(result);
    return result;
  }
};

std::vector<Cell> sheetsOf(const std::vector<Cell>& cells) {
  CellIndex index;
  index.build(cells);
  return splitSheets(cells, index);
}

CellIndex indexOf(const std::vector<Cell>& sheets) {
  CellIndex index;
  index.build(uniteSheets(sheets));
  index.repeat(sheets);
  return index;
}

std::vector<Quad> quadsOf(const std::vector<Cell>& sheets) { return dualQuads(sheets, indexOf(sheets)); }

/// Edges of a cell that change sign: bit 3 j + axis for that from corner j up along an axis.
std::uint32_t changingEdges(std::uint32_t corners) {
  std::uint32_t edges = 0;
  for (std::uint32_t j = 0; j < 8; ++j) {
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      if ((j >> axis & 1) == 0 && (corners >> j & 1) != (corners >> (j | 1u << axis) & 1))
        edges |= 1u << (3 * j + axis);
    }
  }
  return edges;
}

/// The sets of edges that the surface's curves on the faces of a cell join, by following them from face to
/// face. On an ambiguous face they go around the inside corners, on the face `turned` around the outside
/// ones.
std::set<std::uint32_t> tracedLoops(std::uint32_t corners, std::uint32_t turned) {
  std::vector<std::uint32_t> loops;
  for (std::uint32_t left = changingEdges(corners); left != 0; left &= left - 1)
    loops.push_back(left & (0 - left));
  const auto join = [&](std::uint32_t a, std::uint32_t b) {
    const auto holds = [](std::uint32_t edge) {
      return [edge](std::uint32_t loop) { return (loop & edge) != 0; };
    };
    const auto first = std::find_if(loops.begin(), loops.end(), holds(a)),
               second = std::find_if(loops.begin(), loops.end(), holds(b));
    if (first == second) return;
    *first |= *second;
    loops.erase(second);
  };
  for (std::uint32_t face = 0; face < 6; ++face) {
    const std::uint32_t axis = face / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
    const std::uint32_t base = face % 2 << axis;
    const std::array<std::uint32_t, 4> ring{base, base | 1u << u, base | 1u << u | 1u << v, base | 1u << v};
    const std::array<std::uint32_t, 4> edges{1u << (3 * ring[0] + u), 1u << (3 * ring[1] + v),
                                             1u << (3 * ring[3] + u),
                                             1u << (3 * ring[0] + v)};  // from ring[k] to ring[k + 1]
    std::uint32_t changing = 0;
    for (const std::uint32_t edge : edges) changing |= edge & changingEdges(corners);
    if (std::popcount(changing) == 2) join(changing & (0 - changing), changing & (changing - 1));
    if (std::popcount(changing) != 4) continue;
    for (std::size_t k = 0; k < 4; ++k) {
      if (((corners >> ring[k] & 1) != 0) != (face == turned)) join(edges[(k + 3) % 4], edges[k]);
    }
  }
  return {loops.begin(), loops.end()};
}

TEST(Sheets, AreTheCurvesOnTheFacesOfACell) {
  std::size_t several = 0, turns = 0;
  for (std::uint32_t corners = 1; corners < 255; ++corners) {
    for (const bool alone : {false, true}) {  // in the middle of outside nodes; and a grid of one cell
      const int low = alone ? 0 : 1, side = alone ? 2 : 4;
      Signs signs(side, side, side, false);
      for (int j = 0; j < 8; ++j)
        signs.at(low + (j & 1), low + (j >> 1 & 1), low + (j >> 2)) = (corners >> j & 1) != 0;
      std::set<std::uint32_t> found;
      std::vector<std::uint8_t> order;
      for (const Cell& sheet : sheetsOf(signs.cells())) {
        if (sheet.x != low || sheet.y != low || sheet.z != low) continue;
        found.insert(changingEdges(sheet.corners));
        order.push_back(sheet.corners);
      }
      EXPECT_TRUE(std::is_sorted(order.begin(), order.end()));
      EXPECT_EQ(order.size(), found.size());
      several += found.size() > 1;
      // At the border no face is crossed twice by one curve, if turning it can help.
      bool matches = found == tracedLoops(corners, 6);
      for (std::uint32_t face = 0; face < 6 && alone && !matches; ++face) {
        matches = found == tracedLoops(corners, face) && tracedLoops(corners, 6).size() == 1;
        turns += matches;
      }
      EXPECT_TRUE(matches) << corners;
    }
  }
  EXPECT_GT(several, 100u);
  EXPECT_EQ(turns, 36u);  // 24 configurations with 5 inside corners, 12 with 6
}

TEST(Sheets, GiveTheCellsBack) {
  made::Random random(3);
  for (int trial = 0; trial < 20; ++trial) {
    Signs signs(7, 6, 5, false);
    for (auto&& inside : signs.inside) inside = random() % 2 != 0;
    const std::vector<Cell> cells = signs.cells(), sheets = sheetsOf(cells), again = uniteSheets(sheets);
    EXPECT_GT(sheets.size(), cells.size());
    ASSERT_EQ(again.size(), cells.size());
    for (std::size_t i = 0; i < cells.size(); ++i) {
      EXPECT_TRUE(sameCell(again[i], cells[i]));
      EXPECT_EQ(again[i].corners, cells[i].corners);
    }
    const CellIndex index = indexOf(sheets);
    for (std::uint32_t i = 0; i < sheets.size(); ++i) {
      if (i == 0 || !sameCell(sheets[i - 1], sheets[i])) {
        EXPECT_EQ(index.find(sheets[i].x, sheets[i].y, sheets[i].z), i);
      }
    }
  }
}

// The middle of the grid: two cells with a face in common, in all ways there are.
TEST(Manifold, ForAllSignsOfTwoNeighbours) {
  made::Random random(5);
  for (std::uint32_t pattern = 0; pattern < 4096; ++pattern) {
    for (const int around : {0, 1, 2}) {  // all outside, all inside, or either
      Signs signs(5, 4, 4, around == 1);
      for (std::size_t i = 0; around == 2 && i < signs.inside.size(); ++i)
        signs.inside[i] = random() % 2 != 0;
      for (int j = 0; j < 12; ++j) signs.at(1 + j % 3, 1 + j / 3 % 2, 1 + j / 6) = (pattern >> j & 1) != 0;
      const std::vector<Cell> sheets = sheetsOf(signs.cells());
      const inspect::Manifoldness found = manifoldness(quadsOf(sheets), sheets.size());
      ASSERT_EQ(found.first, "") << pattern << " " << around;
      if (around < 2) {
        ASSERT_EQ(found.border, 0u) << pattern;
      }
    }
  }
}

TEST(Manifold, ForRandomSignsAtBordersToo) {
  made::Random random(7);
  std::size_t without = 0;
  for (int trial = 0; trial < 300; ++trial) {
    Signs signs(3 + trial % 7, 3 + trial / 2 % 5, 3 + trial / 3 % 4, false);
    const auto rarity = static_cast<std::uint32_t>(2 + trial % 3);
    for (auto&& inside : signs.inside) inside = random() % rarity == 0;
    const std::vector<Cell> cells = signs.cells(), sheets = sheetsOf(cells);
    const std::vector<Quad> quads = quadsOf(sheets);
    ASSERT_EQ(manifoldness(quads, sheets.size()).first, "") << trial;
    // Each edge inside the grid that changes sign has its quad, of the four sheets that have the edge.
    const std::vector<Quad> of_cells = quadsOf(cells);
    ASSERT_EQ(quads.size(), of_cells.size());
    without += manifoldness(of_cells, cells.size()).faults > 0;
    for (const Quad& quad : quads) {
      for (std::size_t k = 0; k < 4; ++k) {
        const Cell &a = sheets[quad[k]], &b = sheets[quad[(k + 1) % 4]];
        ASSERT_EQ(std::abs(a.x - b.x) + std::abs(a.y - b.y) + std::abs(a.z - b.z), 1);
      }
    }
  }
  EXPECT_GT(without, 250u);  // and with one vertex a cell, hardly ever
}

// What is across a face is joined to the sheet by an edge of the mesh.
TEST(Surroundings, OfSheetsAreJoined) {
  made::Random random(9);
  Signs signs(9, 9, 9, false);
  for (auto&& inside : signs.inside) inside = random() % 2 != 0;
  const std::vector<Cell> sheets = sheetsOf(signs.cells());
  const CellIndex index = indexOf(sheets);
  Surroundings around;
  around.build(sheets, index);
  ASSERT_EQ(around.runs.size(), 1u);
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const Quad& quad : dualQuads(sheets, index)) {
    for (std::size_t k = 0; k < 4; ++k) {
      edges.emplace(quad[k], quad[(k + 1) % 4]);
      edges.emplace(quad[(k + 1) % 4], quad[k]);
    }
  }
  std::size_t found = 0;
  for (std::uint32_t i = 0; i < sheets.size(); ++i) {
    for (std::size_t face = 0; face < 6; ++face) {
      const std::uint32_t other = around.runs[0].across(i)[face];
      if (other == i) continue;
      const std::array<int, 3> at{sheets[i].x, sheets[i].y, sheets[i].z},
          to{sheets[other].x, sheets[other].y, sheets[other].z};
      // An edge of the mesh, but at the grid's border, where it may have no quads.
      int on_border = 0;
      for (std::size_t k = 0; k < 3; ++k) on_border += at[k] == to[k] && (at[k] == 0 || at[k] == 7);
      EXPECT_TRUE(edges.contains({i, other}) || on_border > 0);
      ++found;
    }
    for (std::uint32_t j = 0; j < 8; ++j) {  // its own corners are the sheet's
      const std::uint32_t place = 21 + (j & 1) + 4 * (j >> 1 & 1) + 16 * (j >> 2);
      EXPECT_EQ(around.signs[i] >> place & 1, sheets[i].corners >> j & 1u);
    }
  }
  EXPECT_GT(found, sheets.size());
  around.link(sheets, index);
  for (std::uint32_t colour = 0; colour < 2; ++colour) {
    Surroundings::Links links(around.runs[0], colour);
    for (const std::uint8_t count : around.runs[0].colours[colour].counts) {
      const std::uint32_t* const own = links.next(count);
      for (std::uint32_t n = 0; n < Surroundings::linkCount(count); ++n) EXPECT_LT(own[n], sheets.size());
    }
  }
}

// Of a surface whose cells touch: two components, each a sphere.
TEST(Sheets, KeepTouchingPartsApart) {
  made::Made m;
  m.name = "touching";
  m.volume.grid = made::gridOf(6, 6, 6);
  std::vector<float> samples(216, 1.0f);
  samples[m.volume.grid.nodeIndex(2, 2, 2)] = samples[m.volume.grid.nodeIndex(3, 3, 2)] = -1;
  m.volume.samples = samples;
  const Packet apart = made::encodedMain(m);
  EXPECT_EQ(apart.header.components, 2u);
  EXPECT_EQ(apart.header.euler, 4);
  HeightSettings without;
  without.sheets = false;
  const Packet joined = made::encodedMain(m, kCell / 16, without);
  EXPECT_EQ(joined.header.components, 1u);
  EXPECT_EQ(apart.header.vertices, joined.header.vertices + 2);
  Decoder decoder;
  for (const Packet* packet : {&apart, &joined}) {
    const auto surface = decoder.decode(packet->data);
    ASSERT_TRUE(surface.ok()) << surface.status().message();
    const std::size_t faults = manifoldness(surface->quads, surface->vertices.size()).faults;
    EXPECT_EQ(faults, packet == &apart ? 0u : 2u) << "the cells in which the parts touch";
    EXPECT_EQ(decoder.cells().size(), surface->vertices.size());
  }
}

TEST(Manifold, AtEveryLevelOfAPacket) {
  for (const made::Made& m : made::all()) {
    const auto& nodes = m.volume.grid.nodes;
    if (*std::min_element(nodes.begin(), nodes.end()) < 3) continue;
    const Bytes packet = made::encodedMain(m).data;
    for (std::uint32_t level = 1; level <= made::depthOf(m.volume.grid); ++level) {
      DecodeOptions options;
      options.level = level;
      const auto surface = Decoder().decode(packet, options);
      ASSERT_TRUE(surface.ok()) << m.name << ": " << surface.status().message();
      EXPECT_EQ(manifoldness(surface->quads, surface->vertices.size()).first, "")
          << m.name << ", level " << level;
    }
    const auto surface = Decoder().decode(packet);
    EXPECT_TRUE(checkClosed(*surface).ok()) << m.name;
  }
}

}  // namespace
}  // namespace isoreel
