// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>

#include "encode/frame_coder.h"
#include "extract/surface_fit.h"

namespace isoreel {

/// Codes one frame in profile main (spec codec 4 and 11).
class HeightCoder {
 public:
  /// `field`: the volume's; null: it is gone, and heights are those of the frame's vertices. `tools`: of the
  /// record. `heights` keeps its memory from frame to frame. All must outlive it.
  HeightCoder(const FrameInput& frame, const VolumeField* field, std::uint32_t tools,
              const HeightSettings& settings, const ParallelFor& parallel, HeightFrame& heights);

  /// By itself.
  Result<CodedFrame> codeIntra();
  /// From `reference`, going on with `models`.
  Result<CodedFrame> codePredicted(const Reference& reference, const MotionSettings& settings,
                                   const PacketModels& models);
  /// The frame's, for good: nothing is coded afterwards.
  std::vector<Quad> takeQuads() { return std::move(quads_); }

 private:
  Status codeVertices(CodedFrame& coded);

  FrameInput frame_;
  std::uint32_t tools_;
  HeightSettings settings_;
  HeightFrame& heights_;
  std::vector<Quad> quads_;
  std::unique_ptr<FitTarget> target_;
  std::optional<SurfaceFit> fit_;
  std::vector<float> wanted_;                          // heights, in cells
  std::vector<std::array<std::int32_t, 3>> vertices_;  // at these, where the frame has none
};

}  // namespace isoreel
