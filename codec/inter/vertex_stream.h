// SPDX-License-Identifier: BSD-3-Clause
// The vertices of a P packet, each from the moved previous surface where that is near (spec codec 8.6
// to 8.8).
#pragma once

#include <optional>

#include "inter/coded_neighbours.h"
#include "inter/prediction.h"

namespace isoreel {

/// Models of the residuals of predicted vertices: by component, by how large errors are around, and by
/// confidence.
class PredictedModels {
 public:
  static constexpr std::size_t kSizes = 8;
  ResidualModels& at(std::size_t component, std::size_t size, std::uint8_t confidence) {
    return models_[(component * kSizes + size) * kConfidences + confidence];
  }
  void reset() { std::fill(models_.begin(), models_.end(), ResidualModels{}); }
  /// Memory beyond the object itself.
  std::uint64_t bytes() const { return models_.size() * sizeof(ResidualModels); }

 private:
  std::vector<ResidualModels> models_ = std::vector<ResidualModels>(3 * kSizes * kConfidences);
};

/// The vectors of one active cell after the other, in their order.
class CellMotion {
 public:
  explicit CellMotion(const MotionField& motion) : motion_(motion) {}

  /// Nothing in blocks that do not move.
  std::optional<std::array<std::int32_t, 3>> at(std::uint32_t i, const Cell& cell) {
    while (block_ < motion_.blocks().size() &&
           i >= motion_.blocks()[block_].first + motion_.blocks()[block_].count) {
      ++block_;
      vectors_.reset();
    }
    const Block& block = motion_.blocks()[block_];
    if (!block.moves) return std::nullopt;
    if (!vectors_) vectors_.emplace(motion_, block);
    return vectors_->at(cell);
  }

 private:
  const MotionField& motion_;
  std::size_t block_ = 0;
  std::optional<MotionField::Interpolation> vectors_;  // of the block at hand
};

/// The moved surface in one active cell after the other, in their order.
class MovedPlanes {
 public:
  MovedPlanes(const ReferenceField& field, const MotionField& motion, std::span<const Cell> cells)
      : field_(field), motion_(motion), cells_(cells) {}

  MovedPlane operator()(std::uint32_t i) {
    const auto motion = motion_.at(i, cells_[i]);
    return motion ? planeInCell(field_, cells_[i], *motion) : MovedPlane{};
  }

 private:
  ReferenceField::Cursor field_;
  CellMotion motion_;
  std::span<const Cell> cells_;
};

/// Fills heights.moved, in profile main (spec codec 11.9).
inline void moveHeights(const ReferenceField& field, const MotionField& motion, std::span<const Cell> cells,
                        HeightFrame& heights, const ParallelFor& parallel = serialFor) {
  clearFor(heights.moved, cells.size());
  heights.moved.resize(cells.size());
  const std::vector<Surroundings::Run>& runs = heights.around.runs;
  parallel(runs.size(), [&](std::size_t n) {
    ReferenceField::Cursor cursor(field);
    CellMotion vectors(motion);
    for (std::uint32_t i = runs[n].first; i < runs[n].end; ++i) {
      if (const auto vector = vectors.at(i, cells[i])) {
        heights.moved[i] =
            movedHeight(cursor, cells[i], heights.predicted.points[i], heights.predicted.normals[i], *vector);
      }
    }
  });
}

/// What an encoder chooses; the decoder's says nothing.
struct NoChoice {
  static std::int32_t residual(std::uint32_t, std::size_t, std::int32_t) { return 0; }
};

/// Puts or gets the vertices; fills `decoded` with them, in their cells. planes(i) gives the MovedPlane of
/// cell i, choice.residual(i, component, expected) an encoder's residual for the component along an axis of
/// the local frame, 1/16384 of a cell.
template <class Coder, class Planes, class Choice>
void codePredictedVertices(Coder& coder, VertexModels& unpredicted, PredictedModels& predicted,
                           const PredictionHeader& header, std::span<const Cell> cells,
                           const CellIndex& index, const ResidualSteps& steps, Planes& planes, Choice& choice,
                           std::vector<std::array<std::int32_t, 3>>& decoded) {
  CodedNeighbours neighbours(index, decoded);
  for (std::uint32_t i = 0; i < cells.size(); ++i) {
    const Cell& cell = cells[i];
    const LocalFrame& frame = kLocalFrames[cell.corners];
    const MovedPlane plane = planes(i);
    std::array<std::int64_t, 3> offsets{};
    if (!plane.known) {
      for (std::size_t c = 0; c < 3; ++c) {
        offsets[c] =
            std::int64_t{codeResidual(coder, unpredicted.at(c, cell.corners), choice.residual(i, c, 0))} *
            (c == 0 ? steps.normal : steps.tangential);
      }
      decoded[i] = reconstruct(frame, offsets);
      neighbours.skip(i);
      continue;
    }
    const PredictionHeader::Weights& weights = header.weights[plane.confidence];
    const CodedNeighbours::Means around = neighbours.around(i, cell, frame);
    const auto size = static_cast<std::size_t>(std::min(7, 3 * around.magnitude / (2 * steps.normal)));
    for (std::size_t c = 1; c < 3; ++c) {
      const std::int32_t expected = (weights.tangential * plane.tangents[c - 1]) >> 6;
      offsets[c] = expected + std::int64_t{codeResidual(coder, predicted.at(c, size, plane.confidence),
                                                        choice.residual(i, c, expected))} *
                                  steps.tangential;
    }
    const std::int32_t surface = plane.offset(frame, offsets);
    const std::int32_t expected =
        (weights.normal * surface + weights.error * around.error + weights.height * around.height) >> 6;
    offsets[0] = expected + dequantise(header,
                                       codeResidual(coder, predicted.at(0, size, plane.confidence),
                                                    choice.residual(i, 0, expected)),
                                       steps.normal);
    decoded[i] = reconstruct(frame, offsets);
    neighbours.set(i, static_cast<std::int32_t>(offsets[0]) - surface);
  }
}

}  // namespace isoreel
