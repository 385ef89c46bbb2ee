// SPDX-License-Identifier: BSD-3-Clause
// Signs with temporal context: what the moved previous surface says of a node (spec codec 8.5).
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "inter/motion_field.h"
#include "inter/reference_field.h"
#include "intra/sign_context.h"

namespace isoreel {

/// For each index how many of the ends are not above it.
template <std::size_t Size, std::size_t Ends>
constexpr std::array<std::uint8_t, Size> classTable(const std::array<std::int32_t, Ends>& ends) {
  std::array<std::uint8_t, Size> table{};
  for (std::size_t i = 0; i < Size; ++i) {
    for (const std::int32_t end : ends)
      table[i] = static_cast<std::uint8_t>(table[i] + (static_cast<std::int32_t>(i) >= end));
  }
  return table;
}

/// Models of corner signs where the moved surface is near: by its distance, by what the signs around say,
/// and by how far apart the level's nodes are.
class MovedSignModels {
 public:
  static constexpr std::size_t kLevels = 3, kDistances = 16, kVotes = 16;
  /// Classes of nodes around which not all distances are known.
  static constexpr std::size_t kMostlyOutside = kDistances, kMostlyInside = kDistances + 1,
                               kClasses = kDistances + 2;

  /// The class of a distance, 1/4096 of a cell.
  static std::size_t classOf(std::int32_t distance) {
    const std::int32_t size = (distance < 0 ? ~distance : distance) >> 4;
    const std::size_t place = kSizes[static_cast<std::size_t>(std::min(size, 256))];
    return distance < 0 ? kDistances / 2 - 1 - place : kDistances / 2 + place;
  }
  MovedOpinion at(std::uint32_t shift, std::size_t distance, std::uint16_t one) {
    const std::size_t kind = std::min<std::size_t>(shift, kLevels - 1) * kClasses + distance;
    return {&models_[kind * kVotes + kVoteOf[one >> 9]], &by_corners_[kind * 256], &weights_[kind]};
  }
  void reset() {
    models_.fill(BitModel{});
    std::fill(by_corners_.begin(), by_corners_.end(), BitModel{});
    weights_.fill({});
  }
  /// Memory beyond the object itself.
  std::uint64_t bytes() const { return by_corners_.size() * sizeof(BitModel); }

 private:
  // Where classes end: distances in 1/256 of a cell, probabilities in 1/128.
  static constexpr std::array<std::int32_t, kDistances / 2 - 1> kDistanceEnds{10, 26, 43, 69, 102, 154, 256};
  static constexpr std::array<std::int32_t, kVotes - 1> kVoteEnds{2,  5,  10,  18,  27,  39,  53, 64,
                                                                  75, 89, 101, 110, 118, 123, 126};
  static constexpr auto kSizes = classTable<257>(kDistanceEnds);
  static constexpr auto kVoteOf = classTable<128>(kVoteEnds);

  std::array<BitModel, kLevels * kClasses * kVotes> models_{};
  // Profile main.
  std::vector<BitModel> by_corners_ = std::vector<BitModel>(kLevels * kClasses * 256);
  std::array<MixWeights<3>, kLevels * kClasses> weights_{};
};

/// Looks up the distance of the moved surface at nodes of a level, cell by cell in Morton order.
class MovedSigns {
 public:
  /// `shift`: the level's nodes are 2^shift apart.
  MovedSigns(const ReferenceField& field, const MotionField& motion, MovedSignModels& models,
             std::uint32_t shift)
      : field_(field), motion_(motion), models_(models), shift_(shift) {
    enter();
  }
  /// Goes to a cell of the level above; in Morton order.
  void goTo(const Cell& cell) {
    const std::int32_t up =
        static_cast<std::int32_t>(motion_.blockLog2()) - static_cast<std::int32_t>(shift_) - 1;
    const std::int32_t x = cell.x >> up, y = cell.y >> up, z = cell.z >> up;
    const std::vector<Block>& blocks = motion_.blocks();
    if (blocks[block_].x != x || blocks[block_].y != y || blocks[block_].z != z) {
      while (blocks[block_].x != x || blocks[block_].y != y || blocks[block_].z != z) ++block_;
      enter();
    }
  }
  /// Of a lattice node whose sign has the probability `one` without the moved surface.
  MovedOpinion at(std::int32_t x, std::int32_t y, std::int32_t z, std::uint16_t one) {
    if (!moves_) return {};
    const std::array<std::int32_t, 3> place{(x << shift_) * kCell + vector_[0],
                                            (y << shift_) * kCell + vector_[1],
                                            (z << shift_) * kCell + vector_[2]};
    const CornerValues around = field_.around(place);
    std::size_t distance = 0;
    if (around.allKnown()) {
      distance = MovedSignModels::classOf(around.at(*weights_));
    } else {
      const std::int32_t sum = around.sumOfKnown();
      if (sum == 0) return {};
      distance = sum < 0 ? MovedSignModels::kMostlyInside : MovedSignModels::kMostlyOutside;
    }
    return models_.at(shift_, distance, one);
  }

 private:
  void enter() {
    moves_ = block_ < motion_.blocks().size() && motion_.blocks()[block_].moves;
    if (!moves_) return;
    vector_ = motion_.motionOf(motion_.blocks()[block_]);
    weights_.emplace(vector_);  // all nodes of a block lie at the same place in their cells there
  }

  ReferenceField::Cursor field_;
  const MotionField& motion_;
  MovedSignModels& models_;
  std::uint32_t shift_;
  std::size_t block_ = 0;
  bool moves_ = false;
  std::array<std::int32_t, 3> vector_{};  // of the block
  std::optional<CornerValues::Weights> weights_;
};

}  // namespace isoreel
