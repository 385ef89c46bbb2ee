// SPDX-License-Identifier: BSD-3-Clause
// One frame as a packet's payload, intra or predicted; the encoder chooses.
#pragma once

#include <isoreel/base/parallel.h>
#include <isoreel/codec/encoder.h>
#include <isoreel/codec/packet_header.h>

#include "extract/sign_bitmap.h"
#include "inter/packet_models.h"
#include "inter/reference.h"

namespace isoreel {

/// What is coded: the signs, and where the extractor put the vertices.
struct FrameInput {
  const Grid& grid;
  const SignBitmap& bitmap;
  std::span<const Cell> active;                           // cells
  std::span<const Cell> cells;                            // the vertices': these, or their sheets
  const CellIndex& index;                                 // of the vertices' cells
  std::span<const std::array<std::int32_t, 3>> vertices;  // in their cells, 1/16384 from corner 0; profile
                                                          // main may find its own when there are none
  ResidualSteps steps;
  Slices slices = {};                // profile main
  ParallelFor parallel = serialFor;  // for slices
};

/// A payload, and what the decoder makes of it.
struct CodedFrame {
  std::vector<Section> sections;
  Bytes payload;
  PacketSizes sizes;                                 // without `other`
  std::vector<std::array<std::int32_t, 3>> decoded;  // in their cells
  PacketModels models;                               // as they are after it

  double bytes() const { return static_cast<double>(payload.size()); }
};

/// Codes the frame by itself (spec codec 4 and 5).
Result<CodedFrame> codeIntra(const FrameInput& frame);

/// Codes the frame from `reference`, going on with `models` (spec codec 4 and 8).
Result<CodedFrame> codePredicted(const FrameInput& frame, const Reference& reference,
                                 const MotionSettings& settings, const PacketModels& models);

}  // namespace isoreel
