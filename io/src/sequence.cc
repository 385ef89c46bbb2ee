// SPDX-License-Identifier: BSD-3-Clause
#include "src/sequence.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace isoreel::io {
namespace {

std::string describe(const Grid& grid) {
  return fmt::format("{} x {} x {}", grid.nodes[0], grid.nodes[1], grid.nodes[2]);
}

class Concatenation : public VolumeSequence {
 public:
  explicit Concatenation(std::vector<std::unique_ptr<VolumeSequence>> parts) : parts_(std::move(parts)) {
    for (std::size_t part = 0; part < parts_.size(); ++part) {
      for (std::size_t i = 0; i < parts_[part]->size(); ++i) frames_.push_back({part, i});
    }
  }
  std::size_t size() const override { return frames_.size(); }
  const Grid& grid() const override { return parts_.front()->grid(); }
  bool levelSet() const override {
    return std::all_of(parts_.begin(), parts_.end(), [](const auto& part) { return part->levelSet(); });
  }
  Result<Volume> read(std::size_t i) override {
    Result<Volume> volume = parts_[frames_[i].part]->read(frames_[i].index);
    if (volume.ok()) volume->grid = grid();  // not almost the same: the same
    return volume;
  }
  std::optional<double> time(std::size_t i) const override {
    return parts_[frames_[i].part]->time(frames_[i].index);
  }
  std::string name(std::size_t i) const override { return parts_[frames_[i].part]->name(frames_[i].index); }

 private:
  struct Frame {
    std::size_t part, index;
  };
  std::vector<std::unique_ptr<VolumeSequence>> parts_;
  std::vector<Frame> frames_;
};

}  // namespace

Status checkSameGrid(const Grid& first, const std::string& firstName, const Grid& second,
                     const std::string& secondName) {
  if (first.nodes != second.nodes) {
    return {ErrorCode::kInvalidArgument,
            fmt::format("{} has {} nodes but {} has {}: frames of one sequence have one grid", firstName,
                        describe(first), secondName, describe(second))};
  }
  const double tolerance = 1e-3 * *std::min_element(first.spacing.begin(), first.spacing.end());
  for (int corner = 0; corner < 8; ++corner) {
    Vec3d cells{};
    for (std::size_t a = 0; a < 3; ++a) cells[a] = (corner >> a & 1) != 0 ? first.nodes[a] - 1.0 : 0.0;
    const Vec3d p = first.world(cells), q = second.world(cells);
    if (std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]) <= tolerance) continue;
    return {ErrorCode::kInvalidArgument, fmt::format("{} has node ({}, {}, {}) at ({:g}, {:g}, {:g}) but {} "
                                                     "at ({:g}, {:g}, {:g}): frames of one sequence lie "
                                                     "in one place",
                                                     firstName, cells[0], cells[1], cells[2], p[0], p[1],
                                                     p[2], secondName, q[0], q[1], q[2])};
  }
  return {};
}

Status setNodes(Grid& grid, std::size_t axis, std::int64_t nodes) {
  if (nodes < kMinNodes || nodes > kMaxNodes) {
    return {ErrorCode::kLimit,
            fmt::format("axis {} has {} nodes; {} to {} are allowed", axis, nodes, kMinNodes, kMaxNodes)};
  }
  grid.nodes[axis] = static_cast<std::uint32_t>(nodes);
  return {};
}

void setAxis(Grid& grid, std::size_t axis, const Vec3d& step) {
  grid.spacing[axis] = std::hypot(step[0], step[1], step[2]);
  if (!(grid.spacing[axis] > 0)) return;
  for (std::size_t row = 0; row < 3; ++row) grid.direction[3 * row + axis] = step[row] / grid.spacing[axis];
}

SequenceResult concatenate(std::vector<std::unique_ptr<VolumeSequence>> parts) {
  for (const auto& part : parts) {
    ISOREEL_TRY(checkSameGrid(parts.front()->grid(), parts.front()->name(0), part->grid(), part->name(0)));
  }
  if (parts.size() == 1) return std::move(parts.front());
  return std::unique_ptr<VolumeSequence>(std::make_unique<Concatenation>(std::move(parts)));
}

SequenceResult openEach(const std::vector<std::string>& files,
                        SequenceResult (*openOne)(const std::string& file)) {
  std::vector<std::unique_ptr<VolumeSequence>> parts;
  for (const std::string& file : files) {
    ISOREEL_ASSIGN(parts.emplace_back(), openOne(file));
  }
  return concatenate(std::move(parts));
}

}  // namespace isoreel::io
