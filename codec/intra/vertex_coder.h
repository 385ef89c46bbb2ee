// SPDX-License-Identifier: BSD-3-Clause
// Vertices as residuals in the local frame of their cell's signs (spec codec 5; paper, section 2).
#pragma once

#include <isoreel/codec/grid.h>

#include <algorithm>
#include <vector>

#include "entropy/residual.h"
#include "lattice/cell_index.h"
#include "lattice/sign_tables.h"

namespace isoreel {

/// Quantiser steps of the residual, in 1/16384 of a cell.
struct ResidualSteps {
  std::int32_t normal = kCell / 16;
  std::int32_t tangential = kCell / 16;
};

/// Residual along the normal and the two tangents of the local frame, in steps.
using Residual = std::array<std::int32_t, 3>;

/// The vertex inside its cell at `offsets` from that of the local frame, along its normal and tangents:
/// positions 0 to 16384 from the cell's corner 0. All in 1/16384 of a cell, |offset| < 2^31.
inline std::array<std::int32_t, 3> reconstruct(const LocalFrame& frame,
                                               const std::array<std::int64_t, 3>& offsets) {
  std::array<std::int32_t, 3> result{};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::int64_t offset = (offsets[0] * frame.normal[k] + offsets[1] * frame.tangent1[k] +
                                 offsets[2] * frame.tangent2[k] + kCell / 2) >>
                                kPositionBits;
    result[k] = static_cast<std::int32_t>(std::clamp<std::int64_t>(frame.vertex[k] + offset, 0, kCell));
  }
  return result;
}

/// What the tangential elements of a residual stand for; 0 along the normal.
inline std::array<std::int64_t, 3> tangentOffsets(const Residual& residual, const ResidualSteps& steps) {
  return {0, std::int64_t{residual[1]} * steps.tangential, std::int64_t{residual[2]} * steps.tangential};
}

/// The vertex inside its cell that a residual stands for. |residual| <= 65535.
inline std::array<std::int32_t, 3> reconstruct(const LocalFrame& frame, const Residual& residual,
                                               const ResidualSteps& steps) {
  std::array<std::int64_t, 3> offsets = tangentOffsets(residual, steps);
  offsets[0] = std::int64_t{residual[0]} * steps.normal;
  return reconstruct(frame, offsets);
}

/// The models of all residuals of a packet: by component and by the cell's eight signs.
class VertexModels {
 public:
  ResidualModels& at(std::size_t component, std::uint8_t corners) {
    return models_[component * 256 + corners];
  }
  void reset() { std::fill(models_.begin(), models_.end(), ResidualModels{}); }
  /// Memory beyond the object itself.
  std::uint64_t bytes() const { return models_.size() * sizeof(ResidualModels); }

 private:
  std::vector<ResidualModels> models_ = std::vector<ResidualModels>(3 * 256);
};

/// Puts or gets the residual of one active cell.
template <class Coder>
Residual codeVertex(Coder& coder, VertexModels& models, std::uint8_t corners, const Residual& residual) {
  Residual result;
  for (std::size_t component = 0; component < 3; ++component) {
    result[component] = codeResidual(coder, models.at(component, corners), residual[component]);
  }
  return result;
}

}  // namespace isoreel
