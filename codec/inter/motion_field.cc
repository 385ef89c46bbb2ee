// SPDX-License-Identifier: BSD-3-Clause
#include "inter/motion_field.h"

namespace isoreel {
namespace {

std::int64_t floorDivide(std::int64_t a, std::int64_t b) { return a >= 0 ? a / b : -((b - 1 - a) / b); }

}  // namespace

void MotionField::build(std::span<const Cell> level, std::uint32_t block_log2, std::uint32_t vector_step) {
  block_log2_ = block_log2;
  vector_step_ = vector_step;
  blocks_.clear();
  map_.clear();
  for (const Cell& cell : level) {
    blocks_.push_back({cell.x, cell.y, cell.z, 0, 0, false, {}});
    map_.findOrAdd(cell.x, cell.y, cell.z);
  }
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

MotionField::Expected MotionField::expected(const Block& block) const {
  Expected result;
  for (const Block* neighbour : {find(block.x - 1, block.y, block.z), find(block.x, block.y - 1, block.z),
                                 find(block.x, block.y, block.z - 1)}) {
    if (neighbour == nullptr || !neighbour->moves) continue;
    ++result.count;
    for (std::size_t k = 0; k < 3; ++k) result.vector[k] += neighbour->vector[k];
  }
  if (result.count > 1) {
    for (std::int32_t& v : result.vector) v /= static_cast<std::int32_t>(result.count);
  }
  return result;
}

MotionField::Interpolation::Interpolation(const MotionField& field, const Block& block)
    : side_(std::int32_t{1} << field.block_log2_), step_(static_cast<std::int32_t>(field.vector_step_)) {
  for (std::int32_t i = 0; i < 27; ++i) {
    const Block* found = field.find(block.x + i % 3 - 1, block.y + i / 3 % 3 - 1, block.z + i / 9 - 1);
    if (found != nullptr && found->moves) around_[static_cast<std::size_t>(i)] = found;
  }
}

std::array<std::int32_t, 3> MotionField::Interpolation::at(std::int32_t x, std::int32_t y, std::int32_t z) const {
  // Distance of the place from the block's middle, in cells, and the block on that side.
  const std::int32_t half = side_ / 2;
  const std::array<std::int32_t, 3> inside{2 * (x & (half - 1)) + 1 - half, 2 * (y & (half - 1)) + 1 - half,
                                           2 * (z & (half - 1)) + 1 - half};
  constexpr std::array<std::int32_t, 3> kStride{1, 3, 9};
  std::array<std::int64_t, 3> sum{};
  std::int64_t weights = 0;
  for (std::uint32_t corner = 0; corner < 8; ++corner) {
    std::int64_t weight = 1;
    std::int32_t place = 13;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int32_t away = std::abs(inside[k]);
      const bool beyond = corner >> k & 1;
      weight *= beyond ? away : side_ - away;
      if (beyond) place += inside[k] < 0 ? -kStride[k] : kStride[k];
    }
    const Block* block = around_[static_cast<std::size_t>(place)];
    if (block == nullptr) continue;
    weights += weight;
    for (std::size_t k = 0; k < 3; ++k) sum[k] += weight * block->vector[k];
  }
  const int log2 = std::countr_zero(static_cast<std::uint32_t>(side_));
  const std::int64_t all = std::int64_t{1} << (3 * log2);  // what the eight weights come to
  std::array<std::int32_t, 3> result{};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::int64_t moved = sum[k] * step_;
    result[k] =
        static_cast<std::int32_t>(weights == all ? moved >> (3 * log2) : floorDivide(moved, weights));
  }
  return result;
}

}  // namespace isoreel
