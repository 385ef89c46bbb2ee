// SPDX-License-Identifier: BSD-3-Clause
// Contexts of corner signs and leaf bits: what the known signs around say (spec codec 4.4, 4.5).
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "entropy/range_coder.h"
#include "lattice/sign_lattice.h"

namespace isoreel {

// Bits of SignBlock::neighbours: the nodes around the middle one across a face, an edge or a corner.
inline constexpr std::uint32_t kFaceNeighbours =
    1u << 4 | 1u << 10 | 1u << 12 | 1u << 14 | 1u << 16 | 1u << 22;
inline constexpr std::uint32_t kCornerNeighbours =
    1u << 0 | 1u << 2 | 1u << 6 | 1u << 8 | 1u << 18 | 1u << 20 | 1u << 24 | 1u << 26;
inline constexpr std::uint32_t kEdgeNeighbours =
    ((1u << 27) - 1) & ~(kFaceNeighbours | kCornerNeighbours | 1u << 13);

/// Known inside minus known outside among the masked neighbours.
inline int balance(std::uint32_t known, std::uint32_t inside, std::uint32_t mask) {
  return std::popcount(inside & mask) - std::popcount(known & ~inside & mask);
}

/// The models of corner signs. A context is the state (inside, outside, unknown) of each of the six face
/// neighbours, and the clamped balances of the edge and corner neighbours. Each model starts from the vote of
/// its own context.
class SignModels {
 public:
  SignModels() : models_(initial().begin(), initial().end()) {}
  void reset() { std::copy(initial().begin(), initial().end(), models_.begin()); }

  BitModel& at(std::uint32_t known, std::uint32_t inside) { return models_[context(known, inside)]; }

 private:
  static constexpr int kEdgeClamp = 4;
  static constexpr int kCornerClamp = 3;
  static constexpr std::size_t kEdgeStates = 2 * kEdgeClamp + 1;
  static constexpr std::size_t kCornerStates = 2 * kCornerClamp + 1;
  static constexpr std::size_t kContexts = 729 * kEdgeStates * kCornerStates;

  static std::size_t context(std::uint32_t known, std::uint32_t inside) {
    const auto faces = [](std::uint32_t bits) {
      return (bits >> 4 & 1) | (bits >> 10 & 1) << 1 | (bits >> 12 & 1) << 2 | (bits >> 14 & 1) << 3 |
             (bits >> 16 & 1) << 4 | (bits >> 22 & 1) << 5;
    };
    const std::size_t states = kPowers[faces(known)] + kPowers[faces(inside)];
    const int edges =
        std::clamp(balance(known, inside, kEdgeNeighbours), -kEdgeClamp, kEdgeClamp) + kEdgeClamp;
    const int corners =
        std::clamp(balance(known, inside, kCornerNeighbours), -kCornerClamp, kCornerClamp) + kCornerClamp;
    return (states * kEdgeStates + static_cast<std::size_t>(edges)) * kCornerStates +
           static_cast<std::size_t>(corners);
  }

  // Sum of 3^i over the bits set: a neighbour counts 0 when unknown, 1 when outside, 2 when inside.
  static constexpr auto kPowers = [] {
    std::array<std::uint16_t, 64> sums{};
    for (std::size_t bits = 0; bits < 64; ++bits) {
      int power = 1;
      for (int i = 0; i < 6; ++i, power *= 3) {
        if (bits >> i & 1) sums[bits] = static_cast<std::uint16_t>(sums[bits] + power);
      }
    }
    return sums;
  }();

  // Faces weigh 4, edges 2, corners 1 in the vote; a unit of it moves the first probability by 1/40.
  static const std::array<BitModel, kContexts>& initial() {
    static const auto table = [] {
      std::array<BitModel, kContexts> models{};
      for (std::size_t context = 0; context < kContexts; ++context) {
        int vote = static_cast<int>(context % kCornerStates) - kCornerClamp +
                   2 * (static_cast<int>(context / kCornerStates % kEdgeStates) - kEdgeClamp);
        std::size_t states = context / kCornerStates / kEdgeStates;
        for (int i = 0; i < 6; ++i, states /= 3) {
          if (states % 3 != 0) vote += states % 3 == 2 ? 4 : -4;
        }
        models[context].one = static_cast<std::uint16_t>(std::clamp(32768 + vote * 1638, 3277, 62259));
      }
      return models;
    }();
    return table;
  }

  std::vector<BitModel> models_;
};

/// The models of leaf bits. A child whose corners agree is likely to hold a sign change when nodes around it
/// have the other sign, and unlikely when they are all known and agree.
class LeafModels {
 public:
  void reset() { models_.fill(BitModel{}); }

  /// `around` and `around_inside`: known and inside bits of the 4×4×4 nodes around the child, as popcounts
  /// can take them; `levels_below`: octree levels under the child's.
  BitModel& at(std::uint64_t around, std::uint64_t around_inside, bool sign, std::uint32_t levels_below) {
    const int other = std::popcount(sign ? around & ~around_inside : around_inside);
    const int unknown = 64 - std::popcount(around);
    const std::size_t others = other == 0   ? 0
                               : other == 1 ? 1
                               : other == 2 ? 2
                               : other <= 4 ? 3
                               : other <= 8 ? 4
                                            : 5;
    const std::size_t unknowns = unknown == 0 ? 0 : unknown <= 8 ? 1 : unknown <= 24 ? 2 : 3;
    const std::size_t level = std::min<std::uint32_t>(levels_below - 1, 3);
    return models_[((level * 2 + sign) * 6 + others) * 4 + unknowns];
  }

 private:
  std::array<BitModel, 4 * 2 * 6 * 4> models_{};
};

/// All that the octree of signs adapts. A P packet goes on with what the packet before it left.
struct SignTreeModels {
  SignModels signs;
  LeafModels leaves;

  void reset() {
    signs.reset();
    leaves.reset();
  }
};

}  // namespace isoreel
