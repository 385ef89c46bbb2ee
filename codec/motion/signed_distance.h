// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "inter/reference_field.h"

namespace isoreel {

/// The signed distance from the reference surface, in cells: what registration minimises the squares of. It
/// is the field that the prediction itself is made of, so what is found is good for just that. (Mitra et
/// al.'s d²-tree, which the paper fits to it, was no better and took a third of the time of encoding.)
class SignedDistance {
 public:
  /// `near` is false where the field does not know: further than about a cell from the surface.
  struct Near {
    bool near = false;
    float value = 0;
    Eigen::Vector3f slope = Eigen::Vector3f::Zero();
  };

  explicit SignedDistance(const ReferenceField& field) : field_(field) {}

  /// At a place in cells, anywhere.
  Near at(const Eigen::Vector3f& place) {
    Lattice lattice;
    if (!toLattice(place, lattice)) return {};
    const CornerValues corners = field_.around(lattice);
    if (!corners.allKnown()) return {};
    const CornerValues::Between between = corners.slopesAt(lattice);
    return {true,
            toCells(between.value),
            {toCells(between.slope[0]), toCells(between.slope[1]), toCells(between.slope[2])}};
  }

  /// The square of it, at most `most`.
  float square(const Eigen::Vector3f& place, float most) {
    Lattice lattice;
    if (!toLattice(place, lattice)) return most;
    const CornerValues corners = field_.around(lattice);
    if (!corners.allKnown()) return most;
    const float distance = toCells(corners.at(CornerValues::Weights(lattice)));
    return std::min(distance * distance, most);
  }

  /// 1/16384 of a cell.
  using Lattice = std::array<std::int32_t, 3>;

  /// The square of that at the lowest corner of the cell that holds a place.
  float squareAtNode(const Lattice& place, float most) {
    const std::int16_t value = field_.lowest(place);
    if (value == CornerValues::kUnknown) return most;
    const float distance = toCells(value);
    return distance * distance;
  }

 private:
  static bool toLattice(const Eigen::Vector3f& place, Lattice& result) {
    for (int k = 0; k < 3; ++k) {
      if (!(place[k] >= 0 && place[k] < 65535)) return false;
      result[static_cast<std::size_t>(k)] = static_cast<std::int32_t>(place[k] * kCell);
    }
    return true;
  }
  static float toCells(std::int32_t value) { return static_cast<float>(value) / 4096; }

  ReferenceField::Cursor field_;
};

}  // namespace isoreel
