// SPDX-License-Identifier: BSD-3-Clause
#include "inter/motion_field.h"

namespace isoreel {
void MotionField::build(std::span<const Cell> level, std::uint32_t block_log2, std::uint32_t vector_step) {
  block_log2_ = block_log2;
  vector_step_ = vector_step;
  clearFor(blocks_, level.size());
  for (const Cell& cell : level) blocks_.push_back({cell.x, cell.y, cell.z, 0, 0, false, {}});
  index_.build(level);
}

void MotionField::assign(std::span<const Cell> active) {
  std::uint32_t next = 0;
  for (Block& block : blocks_) {
    block.first = next;
    while (next < active.size() && active[next].x >> block_log2_ == block.x &&
           active[next].y >> block_log2_ == block.y && active[next].z >> block_log2_ == block.z) {
      ++next;
    }
    block.count = next - block.first;
  }
}

MotionField::Expected MotionField::expected(const Block& block, const MotionField* before) const {
  Expected result;
  for (const Block* neighbour : {find(block.x - 1, block.y, block.z), find(block.x, block.y - 1, block.z),
                                 find(block.x, block.y, block.z - 1)}) {
    if (neighbour == nullptr || !neighbour->moves) continue;
    ++result.count;
    for (std::size_t k = 0; k < 3; ++k) result.vector[k] += neighbour->vector[k];
  }
  auto parts = static_cast<std::int32_t>(result.count);
  if (before != nullptr && !before->blocks_.empty() && before->block_log2_ == block_log2_ &&
      before->vector_step_ == vector_step_) {
    constexpr std::int32_t kWeight = 4;  // motion is steadier in time than in space
    if (const Block* same = before->find(block.x, block.y, block.z); same != nullptr && same->moves) {
      for (std::size_t k = 0; k < 3; ++k) result.vector[k] += kWeight * same->vector[k];
      parts += kWeight;
      result.count += 4;
    }
  }
  if (parts > 1) {
    for (std::int32_t& v : result.vector) v /= parts;
  }
  return result;
}

MotionField::Interpolation::Interpolation(const MotionField& field, const Block& block)
    : side_(std::int32_t{1} << field.block_log2_),
      shift_(3 * static_cast<std::int32_t>(field.block_log2_) + 3) {
  const CellIndex::Around places = field.index_.placesAround(block.x, block.y, block.z);
  const auto own = static_cast<std::uint32_t>(&block - field.blocks_.data());
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Block& found = field.blocks_[places[i] == CellIndex::kNone ? own : places[i]];
    around_[i] = field.motionOf(found.moves ? found : block);
  }
}

void MotionField::Interpolation::enter(std::uint32_t octant) {
  octant_ = octant;
  constexpr std::array<std::int32_t, 3> kStride{1, 3, 9};
  for (std::size_t k = 0; k < 3; ++k) {
    auto& terms = terms_[k];
    for (std::uint32_t corner = 0; corner < 8; ++corner) {
      std::int32_t place = 13;
      for (std::uint32_t axis = 0; axis < 3; ++axis) {
        if (corner >> axis & 1) place += octant >> axis & 1 ? kStride[axis] : -kStride[axis];
      }
      terms[corner] = around_[static_cast<std::size_t>(place)][k];
    }
    // From values at the corners to terms, an axis at a time.
    for (std::uint32_t axis = 1; axis < 8; axis <<= 1) {
      for (std::uint32_t corner = 0; corner < 8; ++corner) {
        if (corner & axis) {
          terms[corner] -= terms[corner ^ axis];
        }
      }
      for (std::uint32_t corner = 0; corner < 8; ++corner) {
        if ((corner & axis) == 0) terms[corner] *= 2 * side_;
      }
    }
  }
}

}  // namespace isoreel
