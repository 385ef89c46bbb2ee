// SPDX-License-Identifier: BSD-3-Clause
// The vertices of a P packet: tangential components of all, then normal ones, predicted where they can be
// (spec codec 8.4 to 8.6).
#pragma once

#include "inter/packet_models.h"

namespace isoreel {

/// Puts or gets the tangential residuals, elements 1 and 2.
template <class Coder>
void codeTangents(Coder& coder, VertexModels& models, std::span<const Cell> cells,
                  std::vector<Residual>& residuals) {
  for (std::size_t i = 0; i < cells.size(); ++i) {
    for (const std::size_t component : {1u, 2u}) {
      residuals[i][component] =
          codeResidual(coder, models.at(component, cells[i].corners), residuals[i][component]);
    }
  }
}

/// What the moved previous surface says of each vertex; needs element 1 and 2 of the residuals.
std::vector<SurfacePrediction> predictVertices(const Reference& reference, const MotionField& motion,
                                               std::span<const Cell> cells,
                                               const std::vector<Residual>& residuals,
                                               const ResidualSteps& steps);

/// Puts or gets the normal components; fills `decoded` with the vertices in their cells. An encoder's
/// choose(i, expected) gives the residual to put.
template <class Coder, class Choose>
void codeNormals(Coder& coder, PacketModels& models, const PredictionHeader& header,
                 std::span<const Cell> cells, const CellIndex& index, const std::vector<Residual>& residuals,
                 const std::vector<SurfacePrediction>& predictions, const ResidualSteps& steps, Choose choose,
                 std::vector<std::array<std::int32_t, 3>>& decoded) {
  Decoded neighbours(cells, index);
  for (std::uint32_t i = 0; i < cells.size(); ++i) {
    const SurfacePrediction& surface = predictions[i];
    std::array<std::int64_t, 3> offsets = tangentOffsets(residuals[i], steps);
    std::int32_t error = Decoded::kNone;
    if (surface.offset == SurfacePrediction::kNone) {
      offsets[0] = std::int64_t{codeResidual(coder, models.vertices.at(0, cells[i].corners), choose(i, 0))} *
                   steps.normal;
    } else {
      const CodedNeighbours around = neighbours.around(i);
      const std::int32_t expected = expectedOffset(header, surface, around);
      const std::int32_t residual =
          codeResidual(coder, models.predicted.at(around.magnitude, steps.normal, surface.confidence),
                       choose(i, expected));
      offsets[0] = expected + dequantise(header, residual, steps.normal);
      error = static_cast<std::int32_t>(offsets[0]) - surface.offset;
    }
    decoded[i] = reconstruct(kLocalFrames[cells[i].corners], offsets);
    neighbours.set(i, decoded[i], error);
  }
}

}  // namespace isoreel
