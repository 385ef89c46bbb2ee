// SPDX-License-Identifier: BSD-3-Clause
#include "motion/motion_search.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <utility>

#include "lattice/runs.h"
#include "motion/signed_distance.h"

namespace isoreel {
namespace {

using Eigen::Vector3f;

// What a vector costs against the squared distance it leaves, per unit of its difference from what is
// expected: in cells squared, of a whole block.
constexpr float kVectorCost = 0.4f;
// The same in profile main, where the rest takes half the bytes.
constexpr float kVectorCostOfMain = 0.7f;
// Squared distances count up to this: what is further has no counterpart, and should not pull.
constexpr float kOutlier = 0.25f;
// A block that keeps more than this in the mean is coded without motion.
constexpr float kNoMotion = 0.2f;
// Where the neighbours' vector leaves more than this in the mean, the coarse search looks for better.
constexpr float kSearch = 0.08f;

// Blocks.
constexpr std::size_t kPerTask = 2;
// A block of fewer points is looked at in full.
constexpr std::size_t kFew = 8;

class BlockSearch {
 public:
  BlockSearch(const Reference& reference, const MotionSettings& settings, float unit)
      : distance_(reference.field()), settings_(settings), unit_(unit) {}

  void start(std::span<const std::array<float, 3>> points) {
    points_.clear();
    nodes_.clear();
    const std::size_t every = points.size() >= kFew ? std::max(1u, settings_.every) : 1;
    for (std::size_t i = 0; i < points.size(); i += every) {
      points_.emplace_back(points[i][0], points[i][1], points[i][2]);
      nodes_.push_back(inLattice(points_.back(), kCell / 2));  // the nearest is the lowest from here
    }
  }

  /// A vector, and the sum of squared distances that it leaves.
  struct Found {
    Vector3f vector;
    float cost;
  };

  /// Coarse search over whole cells around the neighbours' vector: a stride of two over the range with few
  /// points, then steps of one and a half around the best with all of them (after Chalidabhongse and Kuo
  /// 1997).
  Found coarse(const Vector3f& expected) {
    const std::size_t stride = std::max<std::size_t>(1, points_.size() / 16);
    Vector3f best = expected;
    float least = nodeCost(best, stride, kFar + 1);
    const int range = static_cast<int>(settings_.range);
    for (int z = -range; z <= range; z += 2) {
      for (int y = -range; y <= range; y += 2) {
        for (int x = -range; x <= range; x += 2) tryVector(expected + step(x, y, z), stride, best, least);
      }
    }
    least = nodeCost(best, 1, kFar + 1);
    for (const float size : {1.0f, 0.5f}) {
      for (int round = 0; round < 3; ++round) {
        const Vector3f middle = best;
        for (int i = 0; i < 27; ++i)
          tryVector(middle + size * step(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1), 1, best, least);
        if (best == middle) break;
      }
    }
    return at(best);
  }

  /// Gauss-Newton on the sum of squared distances until it no longer gets less (paper, appendix A).
  Found registered(const Found& start, const Vector3f& expected) {
    if (!settings_.registration) return start;
    Found best = start;
    Normal here = normal(start.vector);
    for (int iteration = 0; iteration < 20; ++iteration) {
      // Directions that the surface says nothing of go where the neighbours went.
      const float weight = 0.05f * static_cast<float>(points_.size()) + 0.05f;
      here.hessian.diagonal().array() += weight;
      here.gradient += weight * (best.vector - expected);
      Vector3f move = here.hessian.ldlt().solve(-here.gradient);
      if (!move.allFinite()) break;
      if (const float length = move.norm(); length > 0.7f) move *= 0.7f / length;
      here = normal(best.vector + move);
      if (here.cost >= best.cost) break;
      const bool converged = best.cost - here.cost < 1e-4f * best.cost;
      best = {best.vector + move, here.cost};
      if (converged) break;
    }
    return best;
  }

  Found at(const Vector3f& vector) {
    float sum = 0;
    for (const Vector3f& point : points_) sum += distance_.square(point + vector, kOutlier);
    return {vector, sum};
  }
  float mean(const Found& found) const { return found.cost / static_cast<float>(points_.size()); }

  MotionVector quantised(const Vector3f& vector) const {
    MotionVector result{};
    const float limit = static_cast<float>(MotionField::kMaxMotion) / (unit_ * kCell);
    for (int k = 0; k < 3; ++k) {
      result[static_cast<std::size_t>(k)] =
          static_cast<std::int32_t>(std::lround(std::clamp(vector[k] / unit_, -limit, limit)));
    }
    return result;
  }
  Vector3f inCells(const MotionVector& vector) const {
    return Vector3f(static_cast<float>(vector[0]), static_cast<float>(vector[1]),
                    static_cast<float>(vector[2])) *
           unit_;
  }

 private:
  static constexpr float kFar = 4;  // cells squared: further than the field knows

  /// What Gauss-Newton asks of a vector: the sum of squared distances and its derivatives.
  struct Normal {
    float cost = 0;
    Eigen::Matrix3f hessian;
    Vector3f gradient;
  };
  Normal normal(const Vector3f& vector) {
    Normal result;
    std::array<Eigen::Array4f, 3> sums;  // of products of the slopes with each other, and with the distance
    for (Eigen::Array4f& sum : sums) sum.setZero();
    for (const Vector3f& point : points_) {
      const SignedDistance::Near d = distance_.at(point + vector);
      const float square = d.value * d.value;
      result.cost += d.near ? std::min(square, kOutlier) : kOutlier;
      if (!d.near || square > 4 * kOutlier) continue;
      const Eigen::Array4f slope(d.slope[0], d.slope[1], d.slope[2], d.value);
      for (std::size_t k = 0; k < 3; ++k) sums[k] += slope * slope[static_cast<Eigen::Index>(k)];
    }
    for (int k = 0; k < 3; ++k) {
      const Eigen::Array4f& sum = sums[static_cast<std::size_t>(k)];
      result.hessian.col(k) = 2 * sum.head<3>();
      result.gradient[k] = 2 * sum[3];
    }
    return result;
  }

  /// Mean squared distance of the nodes nearest to every so many-th point, or, when it is not below `most`,
  /// no less than that.
  float nodeCost(const Vector3f& vector, std::size_t stride, float most) {
    const std::size_t looked_at = (points_.size() + stride - 1) / stride;
    const auto count = static_cast<float>(looked_at);
    const float enough = most * count * 1.00001f;  // rounding must not end it too early
    const SignedDistance::Lattice move = inLattice(vector, 0);
    float sum = 0;
    for (std::size_t i = 0; i < nodes_.size() && sum < enough; i += stride) {
      const SignedDistance::Lattice& from = nodes_[i];
      sum += distance_.squareAtNode({from[0] + move[0], from[1] + move[1], from[2] + move[2]}, kFar);
    }
    return sum / count;
  }
  static SignedDistance::Lattice inLattice(const Vector3f& cells, std::int32_t more) {
    return {static_cast<std::int32_t>(cells[0] * kCell) + more,
            static_cast<std::int32_t>(cells[1] * kCell) + more,
            static_cast<std::int32_t>(cells[2] * kCell) + more};
  }
  static Vector3f step(int x, int y, int z) {
    return {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
  }
  void tryVector(const Vector3f& vector, std::size_t stride, Vector3f& best, float& least) {
    const float cost = nodeCost(vector, stride, least);
    if (cost >= least) return;
    least = cost;
    best = vector;
  }

  SignedDistance distance_;
  const MotionSettings& settings_;
  float unit_;  // of a quantised vector, in cells
  std::vector<Vector3f> points_;
  std::vector<SignedDistance::Lattice> nodes_;
};

}  // namespace

void searchMotion(const Reference& reference, std::span<const std::array<float, 3>> points,
                  const MotionSettings& settings, std::uint32_t vector_step, const MotionField* before,
                  MotionField& motion, const ParallelFor& parallel) {
  if (reference.planes().empty()) return;
  const float unit = static_cast<float>(vector_step) / kCell;
  const float vector_cost = before != nullptr ? kVectorCostOfMain : kVectorCost;
  const auto searchFor = [&](BlockSearch& search, Block& block) {
    using Found = BlockSearch::Found;
    search.start(points.subspan(block.first, block.count));
    const MotionVector from = motion.expected(block, before).vector;
    const Found expected = search.at(search.inCells(from)), still = search.at(Vector3f::Zero());
    Found best = search.registered(expected.cost <= still.cost ? expected : still, expected.vector);
    if (settings.range > 0 && search.mean(best) > kSearch) {
      const Found other = search.registered(search.coarse(expected.vector), expected.vector);
      if (other.cost < 0.8f * best.cost) best = other;
    }
    const MotionVector quantised = search.quantised(best.vector);
    float least = std::numeric_limits<float>::max(), left = 0;
    for (const auto& [vector, cost] : {std::pair(from, expected.cost), std::pair(MotionVector{}, still.cost),
                                       std::pair(quantised, search.at(search.inCells(quantised)).cost)}) {
      float difference = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        difference += std::log2(1 + static_cast<float>(std::abs(vector[k] - from[k])));
      }
      const float sum = cost + vector_cost * difference;
      if (sum >= least) continue;
      least = sum;
      left = cost;
      block.vector = vector;
    }
    block.moves = search.mean({best.vector, left}) < kNoMotion;
    if (!block.moves) block.vector = {};
  };
  // A block's vector is expected from those of blocks one lower along an axis: those with the same sum of
  // coordinates know nothing of each other.
  std::vector<std::vector<Block*>> diagonals;
  for (Block& block : motion.blocks()) {
    const auto diagonal = static_cast<std::size_t>(block.x + block.y + block.z);
    if (diagonal >= diagonals.size()) diagonals.resize(diagonal + 1);
    diagonals[diagonal].push_back(&block);
  }
  std::vector<BlockSearch> searches;
  for (const std::vector<Block*>& blocks : diagonals) {
    if (blocks.empty()) continue;
    const std::size_t runs = runCount(blocks.size(), kPerTask);
    while (searches.size() < runs) searches.emplace_back(reference, settings, unit);
    parallel(runs, [&](std::size_t n) {
      const std::size_t end = runStart(n + 1, runs, blocks.size());
      for (std::size_t i = runStart(n, runs, blocks.size()); i < end; ++i) searchFor(searches[n], *blocks[i]);
    });
  }
}

}  // namespace isoreel
