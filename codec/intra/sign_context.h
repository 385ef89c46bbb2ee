// SPDX-License-Identifier: BSD-3-Clause
// Contexts of corner signs and leaf bits: what the known signs around say (spec codec 4.4, 4.5).
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "entropy/mixer.h"
#include "lattice/sign_block.h"

namespace isoreel {

/// The models of corner signs. A context is the state (inside, outside, unknown) of each of the six face
/// neighbours, and the clamped balances (known inside minus known outside) of the edge and corner neighbours.
/// Each model starts from the vote of its own context.
class SignModels {
 public:
  SignModels() : models_(initial().begin(), initial().end()) {}
  void reset() { std::copy(initial().begin(), initial().end(), models_.begin()); }
  /// Memory beyond the object itself.
  std::uint64_t bytes() const { return models_.size() * sizeof(BitModel); }

  /// `known` and `inside`: of the 3×3×3 nodes around, bit (dx + 1) + 3 (dz + 1) + 12 (dy + 1): three planes
  /// of a SignWindow, interleaved.
  BitModel& at(std::uint64_t known, std::uint64_t inside) { return of(sumOf(known, inside)); }

  /// The same in two steps: a sum of what each of the known nodes around says, and its model.
  static std::uint32_t sumOf(std::uint64_t known, std::uint64_t inside) {
    std::uint32_t sum = kBalanced;
    for (std::size_t dy = 0; dy < 3; ++dy) {
      sum += kSums.known[dy][known >> (SignWindow::kLane * dy) & 511];
      sum += kSums.inside[dy][inside >> (SignWindow::kLane * dy) & 511];
    }
    return sum;
  }
  /// What one known node at offset (dx, dy, dz), each -1 to 1, adds to the sum.
  static constexpr std::uint32_t part(int dx, int dy, int dz, bool inside) {
    const auto lane = static_cast<std::size_t>(dy + 1), node = std::size_t{1} << (dx + 1 + 3 * (dz + 1));
    return kSums.known[lane][node] + (inside ? kSums.inside[lane][node] : 0);
  }
  BitModel& of(std::uint32_t sum) { return models_[(sum & 0xFFFF) + kClamped[sum >> kEdgeBit]]; }

 private:
  static constexpr int kEdgeClamp = 4;
  static constexpr int kCornerClamp = 3;
  static constexpr std::size_t kEdgeStates = 2 * kEdgeClamp + 1;
  static constexpr std::size_t kCornerStates = 2 * kCornerClamp + 1;
  static constexpr std::size_t kContexts = 729 * kEdgeStates * kCornerStates;

  // What nine nodes with the same dy add to the sum that tells the context: the states of the face neighbours
  // (a number to base 3; 0 unknown, 1 outside, 2 inside) times kEdgeStates · kCornerStates from bit 0, the
  // balance of the edge neighbours from bit 16, that of the corner neighbours from bit 21. A known node adds
  // as if it were outside, an inside one what brings it from there to inside.
  struct Sums {
    std::array<std::array<std::uint32_t, 512>, 3> known;
    std::array<std::array<std::uint32_t, 512>, 3> inside;
  };
  static constexpr int kEdgeBit = 16, kCornerBit = 21;
  static constexpr std::uint32_t kBalanced = 12u << kEdgeBit | 8u << kCornerBit;  // so that none goes below 0
  static constexpr Sums kSums = [] {
    Sums sums{};
    std::uint32_t state = kEdgeStates * kCornerStates;  // of the next face neighbour, in the order z, y, x
    std::array<std::array<std::uint32_t, 9>, 3> faces{};
    for (const auto& [dy, node] : {std::pair{1, 1}, {0, 4}, {1, 3}, {1, 5}, {2, 4}, {1, 7}}) {
      faces[static_cast<std::size_t>(dy)][static_cast<std::size_t>(node)] = state;
      state *= 3;
    }
    for (std::size_t dy = 0; dy < 3; ++dy) {
      for (std::uint32_t node = 0; node < 9; ++node) {
        const int axes = (dy != 1) + (node % 3 != 1) + (node / 3 != 1);  // along which it differs
        const std::uint32_t unit = axes == 2 ? 1u << kEdgeBit : axes == 3 ? 1u << kCornerBit : 0;
        for (std::uint32_t others = 0; others < 1u << node; ++others) {
          const std::uint32_t set = others | 1u << node;
          sums.known[dy][set] = sums.known[dy][others] + faces[dy][node] - unit;
          sums.inside[dy][set] = sums.inside[dy][others] + faces[dy][node] + 2 * unit;
        }
      }
    }
    return sums;
  }();
  // Both balances clamped, by what stands in the sum from kEdgeBit.
  static constexpr auto kClamped = [] {
    std::array<std::uint8_t, 17 << (kCornerBit - kEdgeBit)> clamped{};
    for (std::size_t i = 0; i < clamped.size(); ++i) {
      const int edges = static_cast<int>(i % 32) - 12, corners = static_cast<int>(i / 32) - 8;
      clamped[i] = static_cast<std::uint8_t>(
          static_cast<std::size_t>(std::clamp(edges, -kEdgeClamp, kEdgeClamp) + kEdgeClamp) * kCornerStates +
          static_cast<std::size_t>(std::clamp(corners, -kCornerClamp, kCornerClamp) + kCornerClamp));
    }
    return clamped;
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

  /// `known` and `inside`: how many of the 4×4×4 nodes around the child are known, and inside;
  /// `levels_below`: octree levels under the child's.
  BitModel& at(std::uint32_t known, std::uint32_t inside, bool sign, std::uint32_t levels_below) {
    const std::uint32_t other = sign ? known - inside : inside;
    const std::uint32_t unknown = 64 - known;
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

/// What the moved previous surface says of a sign (spec codec 8.5); null where that surface is not near.
struct MovedOpinion {
  BitModel* model = nullptr;
  // To mix, in profile main (spec codec 11.7): 256 models, by the corners of the cell that adds the node.
  BitModel* by_corners = nullptr;
  MixWeights<3>* weights = nullptr;
};

/// Second opinions on corner signs, in profile main (spec codec 11.7): by the corners of the cell that adds
/// the node, and which of its new nodes it is.
class SignOpinions {
 public:
  void reset() {
    std::fill(models_.begin(), models_.end(), BitModel{});
    weights_.fill({});
  }
  /// `corners`: of the cell; `node`: of kNewNodes; `deepest`: whether the node's level is.
  Mix<2> mix(BitModel& first, std::uint32_t corners, std::uint32_t node, bool deepest) {
    return {{&first, &models_[(node * 256 + corners) * 2 + deepest]}, weights_[node * 2 + deepest], kFloor};
  }
  std::uint64_t bytes() const { return models_.size() * sizeof(BitModel); }
  /// Where the moved surface is near, its two opinions count instead.
  static Mix<3> mix(BitModel& first, const MovedOpinion& moved, std::uint32_t corners) {
    return {{&first, moved.model, moved.by_corners + corners}, *moved.weights, kFloor};
  }

 private:
  static constexpr std::int32_t kFloor = 64;

  std::vector<BitModel> models_ = std::vector<BitModel>(19 * 256 * 2);
  std::array<MixWeights<2>, 19 * 2> weights_;
};

/// All that the octree of signs adapts. A P packet goes on with what the packet before it left.
struct SignTreeModels {
  SignModels signs;
  LeafModels leaves;
  SignOpinions opinions;
  bool mixed = false;  // signs by two opinions: profile main

  void reset() {
    signs.reset();
    opinions.reset();
    leaves.reset();
  }
  /// Memory beyond the object itself.
  std::uint64_t bytes() const { return signs.bytes() + opinions.bytes(); }
};

}  // namespace isoreel
