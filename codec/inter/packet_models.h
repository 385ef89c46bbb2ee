// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "inter/moved_signs.h"
#include "inter/vertex_stream.h"
#include "intra/height_models.h"
#include "intra/sign_context.h"

namespace isoreel {

/// What adapts in each slice by itself (spec codec 11.10).
struct SliceModels {
  SignTreeModels signs;
  MovedSignModels moved_signs;
  HeightModels heights;  // profile main; its weights are those of the first slice

  void reset() {
    signs.reset();
    moved_signs.reset();
    heights.reset();
  }
  /// Memory beyond the object itself.
  std::uint64_t bytes() const { return signs.bytes() + moved_signs.bytes() + heights.bytes(); }
};

/// Everything that adapts while packets are coded. An I packet starts anew; a P packet goes on with what the
/// packet before it left (spec codec 6.4).
struct PacketModels {
  std::vector<SliceModels> slices = std::vector<SliceModels>(1);  // of as many as there were at once
  VertexModels vertices;
  MotionModels motion;
  PredictedModels predicted;
  // Profile main.
  MotionField blocks;  // of the packet before; none after an I packet

  void reset() {
    for (SliceModels& slice : slices) slice.reset();
    vertices.reset();
    motion = {};
    predicted.reset();
    blocks = {};
  }
  /// Makes room for so many slices; new ones have the models of a new GOP.
  void haveSlices(std::size_t count) {
    const bool mixed = slices[0].signs.mixed;
    slices.reserve(count);
    while (slices.size() < count) slices.emplace_back().signs.mixed = mixed;
  }
  /// Memory of all but the first slice when there are so many.
  std::uint64_t bytesOfMore(std::size_t count) const {
    return (std::max(count, slices.size()) - 1) * (sizeof(SliceModels) + slices[0].bytes());
  }
  void mixSigns(bool mixed) {
    for (SliceModels& slice : slices) slice.signs.mixed = mixed;
  }
  /// Memory beyond the object itself.
  std::uint64_t bytes() const {
    std::uint64_t sum = bytesOf(slices) + vertices.bytes() + predicted.bytes();
    for (const SliceModels& slice : slices) sum += slice.bytes();
    return sum;
  }
};

}  // namespace isoreel
