// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "inter/moved_signs.h"
#include "inter/vertex_stream.h"
#include "intra/height_models.h"
#include "intra/sign_context.h"

namespace isoreel {

/// Everything that adapts while packets are coded. An I packet starts anew; a P packet goes on with what the
/// packet before it left (spec codec 6.4).
struct PacketModels {
  SignTreeModels signs;
  VertexModels vertices;
  MotionModels motion;
  MovedSignModels moved_signs;
  PredictedModels predicted;
  // Profile main.
  HeightModels heights;
  MotionField blocks;  // of the packet before; none after an I packet

  void reset() {
    signs.reset();
    vertices.reset();
    motion = {};
    moved_signs.reset();
    predicted.reset();
    heights.reset();
    blocks = {};
  }
  /// Memory beyond the object itself.
  std::uint64_t bytes() const { return signs.signs.bytes() + vertices.bytes() + predicted.bytes(); }
};

}  // namespace isoreel
