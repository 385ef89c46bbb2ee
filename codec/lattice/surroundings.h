// SPDX-License-Identifier: BSD-3-Clause
// What lies around the active cells of a surface, or around their sheets: those across faces and further, and
// the signs of 4×4×4 nodes (spec codec 11.1, 11.4).
#pragma once

#include <isoreel/base/parallel.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "lattice/brick_halo.h"
#include "lattice/cell_index.h"
#include "lattice/runs.h"
#include "lattice/slices.h"

namespace isoreel {

/// Faces in this order: low x, high x, low y, high y, low z, high z.
struct Surroundings {
  /// Links that a cell has at most, and how many may be read behind the first one.
  static constexpr std::size_t kMostLinks = 14, kReadBehind = 16;

  /// For each cell, the faces that have another cell in `across`, one bit each.
  std::vector<std::uint8_t> faces;
  /// For each cell, the signs of the nodes from -1 to 2 along each axis, from its corner 0: bit (x + 1) + 4
  /// (y + 1) + 16 (z + 1). Outside the grid: that of the nearest node in it.
  std::vector<std::uint64_t> signs;

  /// The cells of one parity of x + y + z in a run, in order.
  struct Colour {
    std::vector<std::uint32_t> cells;
    /// Even cells: how many of the cells that differ by 1 in two coordinates come earlier. Odd cells: in bits
    /// 0 to 2 those that differ in one, from bit 4 those that differ in three.
    std::vector<std::uint8_t> counts;
  };
  static std::uint32_t linkCount(std::uint8_t count) { return (count & 15u) + (count >> 4); }
  /// The cells of some bricks, one after the other.
  struct Run {
    std::uint32_t first = 0, end = 0;  // their places
    /// Even, then odd: no two odd cells are linked.
    std::array<Colour, 2> colours;
    /// How many of its cells are odd.
    std::uint32_t odd = 0;
    /// First what is across the cells' faces, then their links: even cells' from the front on, odd ones' from
    /// the back, one cell's behind the other's; the last kReadBehind are nobody's.
    std::vector<std::uint32_t> words;

    /// Until link(): the cell across each face whose corners differ in sign; the cell itself where they
    /// agree, and at the grid's border.
    const std::uint32_t* across(std::uint32_t cell) const { return words.data() + 6 * (cell - first); }
  };
  /// Goes through the links of a colour's cells, in their order.
  class Links {
   public:
    Links(const Run& run, std::uint32_t colour)
        : at_(run.words.data() + (colour == 0 ? 0 : run.words.size() - kReadBehind)),
          down_(0 - std::ptrdiff_t{colour}) {}
    /// Those of the next cell.
    const std::uint32_t* next(std::uint8_t count) {
      const auto links = static_cast<std::ptrdiff_t>(linkCount(count));
      const std::uint32_t* const found = at_ - (links & down_);
      at_ = found + (links & ~down_);
      return found;
    }

   private:
    const std::uint32_t* at_;
    std::ptrdiff_t down_;  // -1 or 0
  };
  /// All cells, each run within a slice; beyond that, how they are cut says nothing.
  std::vector<Run> runs;
  /// Where each slice begins among the runs, and where the last one ends.
  std::vector<std::uint32_t> slice_runs;
  std::size_t sliceCount() const { return slice_runs.size() - 1; }
  std::span<const Run> slice(std::size_t n) const {
    return std::span(runs).subspan(slice_runs[n], slice_runs[n + 1] - slice_runs[n]);
  }

  /// What a brick's own cells say of its nodes from 0 to 4: by z, those that are known, then those inside;
  /// bit x + 8y.
  struct OwnNodes {
    alignas(16) std::array<std::array<std::uint64_t, 2>, 5> planes{};
  };

  /// `cells`: the active cells of a surface in Morton order, or their sheets; `index` is theirs. No links
  /// lead from slice to slice. Keeps its memory from call to call.
  void build(std::span<const Cell> cells, const CellIndex& index, const Slices& slices = {},
             const ParallelFor& parallel = serialFor);
  /// From what is across faces to colours and links, of the same cells.
  void link(std::span<const Cell> cells, const CellIndex& index, const ParallelFor& parallel = serialFor);
  /// Memory beyond the object itself.
  std::uint64_t bytes() const;
  /// The most that both take. A run's links, 14 a cell at most, may move to where there is more room for
  /// them.
  static std::uint64_t bytesFor(std::size_t cells, std::size_t bricks, std::size_t slices) {
    constexpr std::size_t kPerCell =
        1 + sizeof(std::uint64_t) + sizeof(std::uint32_t) + 1 + 2 * kMostLinks * sizeof(std::uint32_t);
    return cells * kPerCell + (runCount(cells, kRun) + slices - 1) * 1024 +
           roomFor(bricks + 1) * sizeof(OwnNodes);
  }

 private:
  static constexpr std::size_t kRun = 4096;  // cells, about

  /// Where a run lies.
  struct Span {
    std::size_t first_brick, end_brick;
    std::uint32_t first, end;  // cells of its slice
  };
  void buildRun(std::span<const Cell> cells, const CellIndex& index, const Span& where, Run& run);
  static void linkRun(std::span<const Cell> cells, const CellIndex& index, const Span& where, Run& run);

  std::vector<Span> spans_;          // of the runs
  std::vector<OwnNodes> own_nodes_;  // by number of brick, while building
};

}  // namespace isoreel
