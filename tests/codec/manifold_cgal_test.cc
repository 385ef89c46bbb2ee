// SPDX-License-Identifier: BSD-3-Clause
// The meshes of profile main before another judge: CGAL's test for polygon meshes. The one unit with its
// headers.
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <gtest/gtest.h>
#include <isoreel/inspect/manifold.h>

#include "made.h"

namespace isoreel {
namespace {

TEST(Manifold, SaysCgalToo) {
  for (const made::Made& m : made::all()) {
    if (std::ranges::min(m.volume.grid.nodes) < 3) continue;
    for (const bool sheets : {true, false}) {
      HeightSettings heights;
      heights.sheets = sheets;
      const auto surface = Decoder().decode(made::encodedMain(m, kCell / 16, heights).data);
      ASSERT_TRUE(surface.ok()) << m.name;
      const bool expected = inspect::manifoldness(surface->quads, surface->vertices.size()).faults == 0;
      EXPECT_TRUE(expected || !sheets) << m.name;
      EXPECT_EQ(CGAL::Polygon_mesh_processing::is_polygon_soup_a_polygon_mesh(surface->quads), expected)
          << m.name;
      EXPECT_EQ(CGAL::Polygon_mesh_processing::is_polygon_soup_a_polygon_mesh(surface->triangles()), expected)
          << m.name;
    }
  }
}

}  // namespace
}  // namespace isoreel
