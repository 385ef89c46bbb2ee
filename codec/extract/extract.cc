// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/codec/encoder.h>

#include "extract/dual_contouring.h"
#include "extract/sign_bitmap.h"
#include "lattice/dual_mesh.h"
#include "lattice/sheets.h"

namespace isoreel {

Result<Surface> extractSurface(const Volume& volume, double isovalue, Inside inside,
                               VertexPlacement placement, NonFinite non_finite, const ParallelFor& parallel,
                               CellVertices vertices) {
  ISOREEL_TRY(checkGrid(volume.grid));
  ISOREEL_ASSIGN(const SignBitmap bitmap, SignBitmap::make(volume, isovalue, inside, non_finite, parallel));
  std::vector<Cell> cells = bitmap.activeCells(parallel);
  CellIndex index;
  index.build(cells);
  if (vertices == CellVertices::kOnePerSheet) cells = splitSheets(std::move(cells), index);
  Surface surface;
  surface.grid = volume.grid;
  surface.vertices = placeVertices(volume, isovalue, cells, placement, parallel);
  toGridPositions(cells, surface.vertices);
  surface.quads = dualQuads(cells, index);
  return surface;
}

}  // namespace isoreel
