// SPDX-License-Identifier: BSD-3-Clause
// Signs with temporal context: what the moved previous surface says of a node (spec codec 8.4).
#pragma once

#include <array>

#include "inter/motion_field.h"
#include "inter/reference_field.h"

namespace isoreel {

/// Models of corner signs where the moved surface is near: by its distance, by what the signs around say,
/// and by how far apart the level's nodes are.
class MovedSignModels {
 public:
  static constexpr std::size_t kLevels = 3, kDistances = 16, kClasses = kDistances + 2, kVotes = 16;

  static std::size_t classOf(std::int32_t distance) {
    std::size_t d = 0;
    while (d < kDistances - 1 && distance >= kDistanceCuts[d]) ++d;
    return d;
  }
  BitModel& at(std::uint32_t shift, std::size_t d, std::uint16_t one) {
    std::size_t v = 0;
    while (v < kVotes - 1 && one >= kVoteCuts[v]) ++v;
    return models_[(std::min<std::size_t>(shift, kLevels - 1) * kClasses + d) * kVotes + v];
  }
  void reset() { models_.fill(BitModel{}); }

 private:
  // In 1/8192 of a cell: 0, 0.04, 0.1, 0.17, 0.27, 0.4, 0.6 and 1 cell to either side.
  static constexpr std::array<std::int32_t, kDistances - 1> kDistanceCuts{
      -8192, -4915, -3277, -2212, -1393, -819, -328, 0, 328, 819, 1393, 2212, 3277, 4915, 8192};
  static constexpr std::array<std::uint16_t, kVotes - 1> kVoteCuts{
      1000, 2500, 5000, 9000, 14000, 20000, 27000, 32768, 38500, 45500, 51500, 56500, 60500, 63000, 64500};

  std::array<BitModel, kLevels * kClasses * kVotes> models_{};
};

/// Looks up the distance of the moved surface at nodes, cell by cell in Morton order.
class MovedSigns {
 public:
  MovedSigns(const ReferenceField& field, const MotionField& motion, MovedSignModels& models)
      : field_(field), motion_(motion), models_(models) {}

  /// Starts a level whose nodes are 2^shift apart.
  void start(std::uint32_t shift) {
    shift_ = shift;
    block_ = 0;
    enter();
  }
  /// Goes to a cell of the level above; in Morton order.
  void goTo(const Cell& cell) {
    const std::int32_t up = static_cast<std::int32_t>(motion_.blockLog2()) - static_cast<std::int32_t>(shift_) - 1;
    const std::int32_t x = cell.x >> up, y = cell.y >> up, z = cell.z >> up;
    const std::vector<Block>& blocks = motion_.blocks();
    if (blocks[block_].x != x || blocks[block_].y != y || blocks[block_].z != z) {
      while (blocks[block_].x != x || blocks[block_].y != y || blocks[block_].z != z) ++block_;
      enter();
    }
  }
  /// The model of a lattice node whose sign has the probability `one` without the moved surface; null where
  /// that is not near.
  BitModel* at(std::int32_t x, std::int32_t y, std::int32_t z, std::uint16_t one) {
    if (!moves_) return nullptr;
    const std::array<std::int32_t, 3> place{(x << shift_) * kCell + vector_[0], (y << shift_) * kCell + vector_[1],
                                            (z << shift_) * kCell + vector_[2]};
    std::array<std::int32_t, 8> v{};
    if (field_.corners({place[0] >> kPositionBits, place[1] >> kPositionBits, place[2] >> kPositionBits}, v))
      return &models_.at(shift_, MovedSignModels::classOf(ReferenceField::Cursor::mix(v, place)), one);
    if (!field_.any()) return nullptr;
    std::int32_t sum = 0;
    for (auto d : v) sum += d == ReferenceField::kUnknown ? 0 : d;
    if (sum == 0) return nullptr;
    return &models_.at(shift_, MovedSignModels::kDistances + (sum < 0), one);
  }

 private:
  void enter() {
    moves_ = block_ < motion_.blocks().size() && motion_.blocks()[block_].moves;
    if (!moves_) return;
    vector_ = motion_.motionOf(motion_.blocks()[block_]);
  }

  ReferenceField::Cursor field_;
  const MotionField& motion_;
  MovedSignModels& models_;
  std::uint32_t shift_ = 0;
  std::size_t block_ = 0;
  bool moves_ = false;
  std::array<std::int32_t, 3> vector_{};  // of the block
};

}  // namespace isoreel
