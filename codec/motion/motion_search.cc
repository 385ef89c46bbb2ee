// SPDX-License-Identifier: BSD-3-Clause
#include "motion/motion_search.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <optional>

#include "motion/distance_field.h"
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

class BlockSearch {
 public:
  BlockSearch(const Reference& reference, const MotionSettings& settings, float unit)
      : reference_(reference), distance_(reference.field()), settings_(settings), unit_(unit) {}

  void start(std::span<const std::array<float, 3>> points) {
    points_.clear();
    for (const auto& p : points) points_.emplace_back(p[0], p[1], p[2]);
  }

  /// Coarse search over whole cells around the neighbours' vector: a stride of two over the range with few
  /// points, then steps of one and a half around the best with all of them (after Chalidabhongse and Kuo
  /// 1997).
  Vector3f coarse(const Vector3f& expected) {
    if (!field_) field_.emplace(reference_);
    const std::size_t stride = std::max<std::size_t>(1, points_.size() / 16);
    Vector3f best = expected;
    float least = voxelCost(best, stride, DistanceField::kFar + 1);
    const int range = static_cast<int>(settings_.range);
    for (int z = -range; z <= range; z += 2) {
      for (int y = -range; y <= range; y += 2) {
        for (int x = -range; x <= range; x += 2) tryVector(expected + step(x, y, z), stride, best, least);
      }
    }
    least = voxelCost(best, 1, DistanceField::kFar + 1);
    for (const float size : {1.0f, 0.5f}) {
      for (int round = 0; round < 3; ++round) {
        const Vector3f middle = best;
        for (int i = 0; i < 27; ++i)
          tryVector(middle + size * step(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1), 1, best, least);
        if (best == middle) break;
      }
    }
    return best;
  }

  /// Gauss-Newton on the sum of squared distances until it no longer gets less (paper, appendix A).
  Vector3f registered(Vector3f vector, const Vector3f& expected) {
    float least = cost(vector);
    for (int iteration = 0; iteration < 20; ++iteration) {
      Eigen::Matrix3f hessian = Eigen::Matrix3f::Zero();
      Vector3f gradient = Vector3f::Zero();
      for (const Vector3f& point : points_) {
        const SignedDistance::Near d = distance_.at(point + vector);
        if (!d.near || d.value * d.value > 4 * kOutlier) continue;
        hessian.noalias() += 2 * d.slope * d.slope.transpose();
        gradient += 2 * d.value * d.slope;
      }
      // Directions that the surface says nothing of go where the neighbours went.
      const float weight = 0.05f * static_cast<float>(points_.size()) + 0.05f;
      hessian.diagonal().array() += weight;
      gradient += weight * (vector - expected);
      Vector3f move = hessian.ldlt().solve(-gradient);
      if (!move.allFinite()) break;
      if (const float length = move.norm(); length > 0.7f) move *= 0.7f / length;
      const float next = cost(vector + move);
      if (next >= least) break;
      vector += move;
      const bool converged = least - next < 1e-4f * least;
      least = next;
      if (converged) break;
    }
    return vector;
  }

  /// Sum of squared distances that count.
  float cost(const Vector3f& vector) {
    float sum = 0;
    for (const Vector3f& point : points_) sum += distance_.square(point + vector, kOutlier);
    return sum;
  }
  float meanCost(const Vector3f& vector) { return cost(vector) / static_cast<float>(points_.size()); }

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
  /// Mean squared distance of every so many-th point, or, when it is not below `most`, no less than that.
  float voxelCost(const Vector3f& vector, std::size_t stride, float most) {
    const std::size_t looked_at = (points_.size() + stride - 1) / stride;
    const auto count = static_cast<float>(looked_at);
    const float enough = most * count * 1.00001f;  // rounding must not end it too early
    float sum = 0;
    for (std::size_t i = 0; i < points_.size() && sum < enough; i += stride) {
      const Vector3f at = points_[i] + vector;
      sum += field_->at({at.x(), at.y(), at.z()});
    }
    return sum / count;
  }
  static Vector3f step(int x, int y, int z) {
    return {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
  }
  void tryVector(const Vector3f& vector, std::size_t stride, Vector3f& best, float& least) {
    const float cost = voxelCost(vector, stride, least);
    if (cost >= least) return;
    least = cost;
    best = vector;
  }

  const Reference& reference_;
  SignedDistance distance_;
  std::optional<DistanceField> field_;  // made when it is first needed
  const MotionSettings& settings_;
  float unit_;  // of a quantised vector, in cells
  std::vector<Vector3f> points_;
};

}  // namespace

void searchMotion(const Reference& reference, std::span<const std::array<float, 3>> points,
                  const MotionSettings& settings, std::uint32_t vector_step, const MotionField* before,
                  MotionField& motion) {
  if (reference.planes().empty()) return;
  const float unit = static_cast<float>(vector_step) / kCell;
  const float vector_cost = before != nullptr ? kVectorCostOfMain : kVectorCost;
  BlockSearch search(reference, settings, unit);
  for (Block& block : motion.blocks()) {
    search.start(points.subspan(block.first, block.count));
    const MotionVector from = motion.expected(block, before).vector;
    const Vector3f expected = search.inCells(from);
    const auto refined = [&](const Vector3f& vector) {
      return settings.registration ? search.registered(vector, expected) : vector;
    };
    Vector3f vector = refined(
        search.cost(expected) <= search.cost(Vector3f::Zero()) ? expected : Vector3f(Vector3f::Zero()));
    if (settings.range > 0 && search.meanCost(vector) > kSearch) {
      const Vector3f other = refined(search.coarse(expected));
      if (search.cost(other) < 0.8f * search.cost(vector)) vector = other;
    }
    float least = std::numeric_limits<float>::max();
    for (const MotionVector& candidate : {from, MotionVector{}, search.quantised(vector)}) {
      float difference = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        difference += std::log2(1 + static_cast<float>(std::abs(candidate[k] - from[k])));
      }
      const float cost = search.cost(search.inCells(candidate)) + vector_cost * difference;
      if (cost >= least) continue;
      least = cost;
      block.vector = candidate;
    }
    block.moves = search.meanCost(search.inCells(block.vector)) < kNoMotion;
    if (!block.moves) block.vector = {};
  }
}

}  // namespace isoreel
