// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/inspect/distance.h>

#include <algorithm>

#include "src/sub_cell.h"
#include "src/vec.h"

namespace isoreel::inspect {
namespace {

struct ActiveCell {
  std::uint32_t x, y;
  std::array<double, 8> values;  // at its corners; positive is inside
};

// Exactly a at 0 and b at 1: cells that share a face compute the same values on it.
double lerp(double a, double b, double t) { return a * (1 - t) + b * t; }

/// Sweeps the fine lattice (`refinement` steps a cell) from z = 0 upwards. Vertices are found again by the
/// lattice edge or node they lie on, of which only those of one fine layer are kept.
class Tessellation {
 public:
  Tessellation(const Volume& volume, double isovalue, Inside inside, int refinement)
      : volume_(volume),
        isovalue_(isovalue),
        inside_(inside),
        steps_(static_cast<std::uint32_t>(refinement)),
        nodes_(volume.grid.nodes),
        width_(std::size_t{nodes_[0] - 1} * steps_ + 1),
        lattice_(width_ * (std::size_t{nodes_[1] - 1} * steps_ + 1)) {}

  Mesh run() {
    std::vector<std::uint8_t> below, above = signs(0);
    for (std::uint32_t z = 0; z + 1 < nodes_[2]; ++z) {
      below = std::move(above);
      above = signs(z + 1);
      const std::vector<ActiveCell> cells = activeCells(below, above, z);
      for (std::uint32_t k = 0; k < steps_; ++k) fineLayer(cells, z, k);
    }
    return std::move(mesh_);
  }

 private:
  // Vertices (their number plus one) on the lattice edges that start at a lattice node, and on the node. A
  // number below the first one of its layer is left over from an earlier layer.
  struct Slot {
    std::array<std::uint32_t, 3> edges{};
    std::uint32_t node = 0;
  };

  std::vector<std::uint8_t> signs(std::uint32_t z) const {
    const std::size_t count = std::size_t{nodes_[0]} * nodes_[1];
    const auto samples = volume_.samples.subspan(count * z, count);
    std::vector<std::uint8_t> result(count);
    for (std::size_t i = 0; i < count; ++i) result[i] = isInside(samples[i], isovalue_, inside_);
    return result;
  }

  std::vector<ActiveCell> activeCells(const std::vector<std::uint8_t>& below,
                                      const std::vector<std::uint8_t>& above, std::uint32_t z) const {
    std::vector<ActiveCell> cells;
    for (std::uint32_t y = 0; y + 1 < nodes_[1]; ++y) {
      for (std::uint32_t x = 0; x + 1 < nodes_[0]; ++x) {
        const std::size_t i = std::size_t{y} * nodes_[0] + x, j = i + nodes_[0];
        const int inside = below[i] + below[i + 1] + below[j] + below[j + 1] + above[i] + above[i + 1] +
                           above[j] + above[j + 1];
        if (inside == 0 || inside == 8) continue;
        ActiveCell cell{x, y, {}};
        for (std::uint32_t c = 0; c < 8; ++c)
          cell.values[c] = value({x + (c & 1), y + (c >> 1 & 1), z + (c >> 2)});
        cells.push_back(cell);
      }
    }
    return cells;
  }

  double finiteValue(float sample) const {
    const double v = static_cast<double>(sample);
    return inside_ == Inside::kBelow ? isovalue_ - v : v - isovalue_;
  }

  double value(const std::array<std::uint32_t, 3>& node) const {
    const float sample = volume_.at(node[0], node[1], node[2]);
    return std::isfinite(sample) ? finiteValue(sample) : -meanOfInsideNeighbours(node);
  }

  // What a sample that is no number stands for is minus this: with one inside neighbour along the axes, the
  // crossing is in the middle of the edge to it; with several, in the middle on average.
  double meanOfInsideNeighbours(const std::array<std::uint32_t, 3>& node) const {
    std::array<double, 2> sum{};  // along the axes; diagonal
    std::array<double, 2> count{};
    std::array<std::uint32_t, 3> low, high, n;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = node[axis] > 0 ? node[axis] - 1 : 0;
      high[axis] = std::min(node[axis] + 1, nodes_[axis] - 1);
    }
    for (n[2] = low[2]; n[2] <= high[2]; ++n[2]) {
      for (n[1] = low[1]; n[1] <= high[1]; ++n[1]) {
        for (n[0] = low[0]; n[0] <= high[0]; ++n[0]) {
          const float sample = volume_.at(n[0], n[1], n[2]);
          if (!isInside(sample, isovalue_, inside_)) continue;
          const std::size_t kind = (n[0] != node[0]) + (n[1] != node[1]) + (n[2] != node[2]) == 1 ? 0 : 1;
          sum[kind] += finiteValue(sample);
          count[kind] += 1;
        }
      }
    }
    const std::size_t kind = count[0] > 0 ? 0 : 1;
    return count[kind] > 0 ? sum[kind] / count[kind] : 1;
  }

  // The sub-cells between fine planes k and k + 1 of the cells whose lower corner is at node z.
  void fineLayer(const std::vector<ActiveCell>& cells, std::uint32_t z, std::uint32_t k) {
    // Plane k keeps what the layer below made on it.
    std::swap(planes_[0], planes_[1]);
    first_[0] = first_[1];
    first_[1] = static_cast<std::uint32_t>(mesh_.points.size()) + 1;
    if (planes_[1].empty()) {
      planes_[0].resize(lattice_);
      planes_[1].resize(lattice_);
    }
    const double step = 1.0 / steps_;
    const std::size_t side = steps_ + 1;
    std::vector<double> fine(2 * side * side);
    for (const ActiveCell& cell : cells) {
      for (std::size_t plane = 0; plane < 2; ++plane) {
        const double tz = static_cast<double>(k + plane) * step;
        std::array<double, 4> column;
        for (std::size_t c = 0; c < 4; ++c) column[c] = lerp(cell.values[c], cell.values[c + 4], tz);
        for (std::size_t j = 0; j < side; ++j) {
          const double ty = static_cast<double>(j) * step;
          const double left = lerp(column[0], column[2], ty), right = lerp(column[1], column[3], ty);
          double* row = &fine[(plane * side + j) * side];
          for (std::size_t i = 0; i < side; ++i) row[i] = lerp(left, right, static_cast<double>(i) * step);
        }
      }
      for (std::uint32_t j = 0; j < steps_; ++j) {
        for (std::uint32_t i = 0; i < steps_; ++i) {
          std::array<double, 8> v;
          int inside = 0;
          for (std::size_t c = 0; c < 8; ++c) {
            v[c] = fine[((c >> 2) * side + j + (c >> 1 & 1)) * side + i + (c & 1)];
            inside += v[c] > 0;
          }
          if (inside > 0 && inside < 8) {
            subCell({std::size_t{cell.x} * steps_ + i, std::size_t{cell.y} * steps_ + j,
                     std::size_t{z} * steps_ + k},
                    v);
          }
        }
      }
    }
  }

  void subCell(const std::array<std::size_t, 3>& corner, const std::array<double, 8>& v) {
    const SubCellLoops loops = subCellLoops(v);
    const std::uint8_t* edge = loops.edges.data();
    for (std::size_t loop = 0; loop < static_cast<std::size_t>(loops.count); ++loop) {
      const std::size_t size = loops.sizes[loop];
      std::array<std::uint32_t, 12> ids;
      for (std::size_t i = 0; i < size; ++i) ids[i] = vertex(corner, *edge++, v);
      // A fan; of four corners along the shorter diagonal.
      const bool turn = size == 4 && squaredLength(ids[1], ids[3]) < squaredLength(ids[0], ids[2]);
      if (turn) std::rotate(ids.begin(), ids.begin() + 1, ids.begin() + 4);
      for (std::size_t i = 2; i < size; ++i) add({ids[0], ids[i - 1], ids[i]});
    }
  }

  double squaredLength(std::uint32_t a, std::uint32_t b) const {
    const Vec3d d = toDouble(mesh_.points[a]) - toDouble(mesh_.points[b]);
    return dot(d, d);
  }

  // Corners that met in a node (a value equal to the isovalue) leave a line or a point: its neighbours close
  // over it.
  void add(const Triangle& t) {
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) mesh_.triangles.push_back(t);
  }

  std::uint32_t vertex(const std::array<std::size_t, 3>& corner, std::size_t edge,
                       const std::array<double, 8>& v) {
    const std::size_t axis = edge / 4;
    const std::size_t start = kEdgeStart[edge], end = start | (std::size_t{1} << axis);
    std::array<std::size_t, 3> at = corner;  // lattice node, of the edge's start or where the crossing is
    std::size_t c = start;
    double t = 0;
    const bool on_node = v[start] == 0 || v[end] == 0;
    if (v[end] == 0) c = end;
    for (std::size_t a = 0; a < 3; ++a) at[a] += c >> a & 1;
    if (!on_node) t = v[start] / (v[start] - v[end]);

    const std::size_t plane = c >> 2;
    Slot& slot = planes_[plane][at[1] * width_ + at[0]];
    std::uint32_t& id = on_node ? slot.node : slot.edges[axis];
    if (id < first_[plane]) {
      Vec3d p{static_cast<double>(at[0]), static_cast<double>(at[1]), static_cast<double>(at[2])};
      p[axis] += t;
      mesh_.points.push_back(toFloat(p * (1.0 / steps_)));
      id = static_cast<std::uint32_t>(mesh_.points.size());
    }
    return id - 1;
  }

  const Volume& volume_;
  const double isovalue_;
  const Inside inside_;
  const std::uint32_t steps_;
  const std::array<std::uint32_t, 3> nodes_;
  const std::size_t width_, lattice_;
  std::array<std::vector<Slot>, 2> planes_;   // fine planes k and k + 1
  std::array<std::uint32_t, 2> first_{1, 1};  // first vertex that either may hold
  Mesh mesh_;
};

}  // namespace

Mesh volumeIsosurface(const Volume& volume, double isovalue, Inside inside, int refinement) {
  return Tessellation(volume, isovalue, inside, std::clamp(refinement, 1, 16)).run();
}

}  // namespace isoreel::inspect
