// SPDX-License-Identifier: BSD-3-Clause
// What a P packet has beyond an I packet (spec codec 8).
#pragma once

#include <isoreel/codec/motion_block.h>

#include "inter/packet_models.h"

namespace isoreel {

/// OK when a stream was read exactly to its end; `what` for the message.
Status endOf(const RangeGet& coder, const char* what);

/// The motion section, from its header to the vertices that it predicts.
class PredictedPart {
 public:
  /// Reads the prediction header. `section` must outlive it; `depth`: of the octree.
  Status open(ByteSpan section, std::uint32_t depth, Profile profile);

  /// The octree level whose cells are the blocks: those below have signs with temporal context.
  std::uint32_t blockLevel() const { return block_level_; }
  /// Decodes the vectors; `blocks`: the cells of that level.
  Status decodeMotion(std::span<const Cell> blocks, PacketModels& models, Profile profile);
  const MotionField& motion() const { return motion_; }
  /// Memory of so many blocks, with a copy for the next packet and one for DecodeOptions::motion.
  static std::uint64_t bytesFor(std::size_t blocks) {
    return 2 * MotionField::bytesFor(blocks) + blocks * sizeof(MotionBlock);
  }

  /// Decodes the vertices of the active cells, in their cells.
  Status decodeVertices(ByteSpan bytes, std::span<const Cell> cells, const CellIndex& index,
                        const ReferenceField& field, const ResidualSteps& steps, PacketModels& models,
                        std::vector<std::array<std::int32_t, 3>>& vertices);
  /// The same for profile main: where the moved surface crosses their normals.
  void moveHeights(std::span<const Cell> cells, const ReferenceField& field, HeightFrame& heights,
                   const ParallelFor& parallel) {
    motion_.assign(cells);
    isoreel::moveHeights(field, motion_, cells, heights, parallel);
  }
  /// The blocks, once all of that is done.
  std::vector<MotionBlock> blocks(std::span<const Cell> cells, const ReferenceField& field) const;

 private:
  PredictionHeader header_;
  ByteSpan vectors_;
  std::uint32_t block_level_ = 0;
  MotionField motion_;
};

}  // namespace isoreel
