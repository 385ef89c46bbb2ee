// SPDX-License-Identifier: BSD-3-Clause
// Prediction of a vertex's normal component from the moved previous surface, and the coding of what is left
// (spec codec 8.4 to 8.6; paper, sections 4.3 and 4.4).
#pragma once

#include <isoreel/base/syntax.h>

#include "inter/motion_field.h"
#include "inter/reference.h"
#include "intra/vertex_coder.h"

namespace isoreel {

/// How far to trust a prediction: by how many of the cell's corners the moved surface has on the wrong side,
/// and how much the planes that make it disagree.
inline constexpr std::size_t kConfidences = 16;

/// What a P packet says of its prediction: the head of its motion section (spec codec 8.1).
struct PredictionHeader {
  static constexpr const char* kName = "prediction header";
  static constexpr const char* kSpec = "codec 8.1";

  std::uint32_t block_log2 = 3;
  std::uint32_t vector_step = kCell / 8;
  /// By confidence, in 1/64: of the moved surface's offset, of its error at neighbours, and of the
  /// neighbours' height.
  std::array<std::array<std::uint8_t, 3>, kConfidences> weights{};
  /// What residuals of 1, 2 and 3 steps stand for, in 1/64 of a step; larger ones follow the third.
  std::array<std::uint8_t, 3> levels{64, 128, 192};

  template <class V>
  void fields(V& v) {
    v.varint("block size", block_log2, 2, 5);
    v.varint("vector step", vector_step, kCell / 64, kCell);
    for (auto& confidence : weights) {
      for (auto& w : confidence) v.fixed("weight", w, 0, 128);
    }
    for (auto& level : levels) v.fixed("level", level, 1, 255);
  }
};

/// The moved previous surface's offset along the normal of a cell's local frame.
struct SurfacePrediction {
  static constexpr std::int32_t kNone = std::numeric_limits<std::int32_t>::min();
  std::int32_t offset = kNone;  // 1/16384 of a cell; kNone: the surface is not near enough
  std::uint8_t confidence = 0;  // 0 best, below kConfidences
};

/// From the planes around the vertex moved by `motion`. `in_cell`: the vertex with its tangential components
/// decoded and no normal one, 1/16384 from the cell's corner 0.
SurfacePrediction predictFromSurface(const Reference& reference, Neighbours& neighbours, const Cell& cell,
                                     const std::array<std::int32_t, 3>& in_cell,
                                     const std::array<std::int32_t, 3>& motion);

/// What the neighbours coded before say of a vertex. In 1/16384 of a cell.
struct CodedNeighbours {
  std::int32_t error = 0;  // mean of what the moved surface left, where it predicted
  std::int32_t magnitude = kCell / 10;
  std::int32_t height = 0;  // mean, above the local frame's vertex along its normal
};

/// The vertices of a frame while they are decoded, in order.
class Decoded {
 public:
  static constexpr std::int32_t kNone = std::numeric_limits<std::int32_t>::min();

  /// `cells` and `index` must outlive it.
  Decoded(std::span<const Cell> cells, const CellIndex& index)
      : cells_(cells), neighbours_(index), vertices_(cells.size()) {}
  /// `in_cell`: the vertex; `error`: its normal component less the moved surface's, or kNone.
  void set(std::uint32_t i, const std::array<std::int32_t, 3>& in_cell, std::int32_t error);
  CodedNeighbours around(std::uint32_t i);

 private:
  struct Vertex {
    std::array<std::int32_t, 3> position{};  // in the grid
    std::int32_t error = 0;
  };
  std::span<const Cell> cells_;
  Neighbours neighbours_;
  std::vector<Vertex> vertices_;
};

/// Models of the normal component where it is predicted: by how large errors are around, and confidence.
class InterModels {
 public:
  ResidualModels& at(std::int32_t magnitude, std::int32_t step, std::uint8_t confidence) {
    const std::int64_t size = std::int64_t{3} * magnitude / (2 * std::int64_t{step});
    return models_[static_cast<std::size_t>(std::min<std::int64_t>(size, 7)) * kConfidences + confidence];
  }
  void reset() { std::fill(models_.begin(), models_.end(), ResidualModels{}); }

 private:
  std::vector<ResidualModels> models_ = std::vector<ResidualModels>(8 * kConfidences);
};

/// The offset that the prediction expects, 1/16384 of a cell.
inline std::int32_t expectedOffset(const PredictionHeader& header, const SurfacePrediction& surface,
                                   const CodedNeighbours& around) {
  const auto& weights = header.weights[surface.confidence];
  return (weights[0] * surface.offset + weights[1] * around.error + weights[2] * around.height) >> 6;
}

/// What a residual of the predicted stream stands for, 1/16384 of a cell.
inline std::int32_t dequantise(const PredictionHeader& header, std::int32_t residual, std::int32_t step) {
  const std::int32_t magnitude = std::abs(residual);
  if (magnitude == 0) return 0;
  const std::int32_t level = header.levels[static_cast<std::size_t>(std::min(magnitude, 3) - 1)];
  const std::int32_t offset = ((level * step) >> 6) + std::max(magnitude - 3, 0) * step;
  return residual < 0 ? -offset : offset;
}

}  // namespace isoreel
