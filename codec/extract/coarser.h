// SPDX-License-Identifier: BSD-3-Clause
// A lattice coarser than the volume's, in the same box. Encoder only; floating point.
#pragma once

#include <isoreel/base/parallel.h>
#include <isoreel/codec/volume.h>

namespace isoreel {

/// Along each axis, nodes of `finer` from one node of `coarser` to the next. Both have their first and their
/// last nodes at the same places.
inline Vec3d cellsPerCell(const Grid& finer, const Grid& coarser) {
  Vec3d result;
  for (std::size_t k = 0; k < 3; ++k)
    result[k] = static_cast<double>(finer.nodes[k] - 1) / (coarser.nodes[k] - 1);
  return result;
}

/// The trilinear interpolant of `volume` at the nodes of `grid`, which is in the same box. Next to a sample
/// that is not finite, nodes are not finite either, but those that lie on another sample.
Volume resampled(const Volume& volume, const Grid& grid, const ParallelFor& parallel);

}  // namespace isoreel
