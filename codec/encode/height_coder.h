// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "encode/frame_coder.h"
#include "extract/volume_field.h"
#include "intra/height_stream.h"

namespace isoreel {

/// Codes a frame by itself in profile main (spec codec 4 and 11). `field`: for which heights are chosen;
/// null: for the frame's vertices. `heights` keeps its memory from frame to frame.
Result<CodedFrame> codeIntraHeights(const FrameInput& frame, const VolumeField* field, std::uint32_t tools,
                                    const HeightSettings& choices, const ParallelFor& parallel,
                                    HeightFrame& heights);

}  // namespace isoreel
