// SPDX-License-Identifier: BSD-3-Clause
// Prediction of a vertex from the moved previous surface, and the coding of what is left (spec codec 8.6 and
// 8.8; paper, sections 4.3 and 4.4).
#pragma once

#include <isoreel/base/syntax.h>

#include "inter/motion_field.h"
#include "inter/reference_field.h"
#include "intra/height_stream.h"
#include "intra/vertex_coder.h"

namespace isoreel {

/// How far to trust a prediction: by how many of the cell's corners the moved surface has on the wrong side,
/// and how much it bends there.
inline constexpr std::size_t kConfidences = 16;

/// What a P packet says of its motion: the head of its motion section in profile main (spec codec 11.8).
struct MotionHeader {
  static constexpr const char* kName = "motion header";
  static constexpr const char* kSpec = "codec 11.8";

  std::uint32_t block_log2 = 3;
  std::uint32_t vector_step = kCell / 8;

  template <class V>
  void fields(V& v) {
    v.varint("block size", block_log2, 2, 5);
    v.varint("vector step", vector_step, kCell / 64, kCell);
  }
};

/// The same in profile classic, with what it says of its prediction (spec codec 8.1).
struct PredictionHeader : MotionHeader {
  static constexpr const char* kName = "prediction header";
  static constexpr const char* kSpec = "codec 8.1";

  struct Weights {
    std::uint8_t tangential = 0;  // of the moved surface's offsets along the tangents
    std::uint8_t normal = 0;      // of that along the normal
    std::uint8_t error = 0;       // of its error at the neighbours
    std::uint8_t height = 0;      // of the neighbours' height
  };

  /// By confidence, in 1/64.
  std::array<Weights, kConfidences> weights{};
  /// What residuals of 1, 2 and 3 steps stand for, in 1/64 of a step; larger ones follow the third.
  std::array<std::uint8_t, 3> levels{64, 128, 192};

  template <class V>
  void fields(V& v) {
    MotionHeader::fields(v);
    for (Weights& confidence : weights) {
      v.fixed("tangential weight", confidence.tangential, 0, 128);
      v.fixed("normal weight", confidence.normal, 0, 128);
      v.fixed("error weight", confidence.error, 0, 128);
      v.fixed("height weight", confidence.height, 0, 128);
    }
    for (auto& level : levels) v.fixed("level", level, 1, 255);
  }
};

/// The moved previous surface inside a cell, as a plane: its signed distance is distance + slope · (place -
/// frame vertex), outside positive.
struct MovedPlane {
  bool known = false;                   // false: the surface is not near enough
  std::uint8_t confidence = 0;          // 0 best, below kConfidences
  std::int32_t distance = 0;            // at the vertex of the cell's local frame, 1/16384 of a cell
  std::array<std::int32_t, 3> slope{};  // 1/16384
  std::array<std::int32_t, 2>
      tangents{};  // where it would put the vertex, along the frame's tangents, 1/16384 of a cell

  /// How far along the normal of `frame` the plane is from the frame's vertex moved by the tangential
  /// elements of `offsets`, 1/16384 of a cell; not above a cell.
  std::int32_t offset(const LocalFrame& frame, const std::array<std::int64_t, 3>& offsets) const;
};

/// Where the moved surface crosses the normal through a cell's predicted point (spec codec 11.9). `motion`:
/// as below.
MovedHeight movedHeight(ReferenceField::Cursor& field, const Cell& cell, const Lanes& point,
                        const Lanes& normal, const std::array<std::int32_t, 3>& motion);

/// `motion`: from the cell to the previous surface, 1/16384 of a cell.
MovedPlane planeInCell(ReferenceField::Cursor& field, const Cell& cell,
                       const std::array<std::int32_t, 3>& motion);

/// What a residual of the predicted stream stands for, 1/16384 of a cell.
inline std::int32_t dequantise(const PredictionHeader& header, std::int32_t residual, std::int32_t step) {
  const std::int32_t magnitude = std::abs(residual);
  if (magnitude == 0) return 0;
  const std::int32_t level = header.levels[static_cast<std::size_t>(std::min(magnitude, 3) - 1)];
  const std::int32_t offset = ((level * step) >> 6) + std::max(magnitude - 3, 0) * step;
  return residual < 0 ? -offset : offset;
}

}  // namespace isoreel
