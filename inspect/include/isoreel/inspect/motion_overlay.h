// SPDX-License-Identifier: BSD-3-Clause
// What the blocks of a P frame do, to be drawn over its picture.
#pragma once

#include <isoreel/codec/motion_block.h>

#include <string>
#include <vector>

namespace isoreel::inspect {

struct MotionOverlay {
  std::vector<MotionBlock> blocks;  // as the decoder gave them with the full surface; none for an I frame
  double scale = 1;                 // arrows are so many times as long as the motion
  double fastest = 1;               // in cells: where the colours end
  std::string caption;              // for the upper left corner
};

/// What a legend needs so that most arrows of a sequence can be seen and told apart.
class MotionRange {
 public:
  void add(const std::vector<MotionBlock>& blocks);
  /// In cells, a round number: nine in ten moving blocks of every frame move by no more. 1 when none does.
  double fastest() const;
  /// A round number, 1 or more: arrows of the fastest are then about one and a half blocks long.
  double scale() const;

 private:
  double fastest_ = 0;
  std::int32_t side_ = 8;
};

}  // namespace isoreel::inspect
