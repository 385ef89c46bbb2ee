// SPDX-License-Identifier: BSD-3-Clause
// Lists of cells that no surface would make.
#pragma once

#include <algorithm>

#include "inter/motion_field.h"
#include "lattice/morton.h"
#include "made.h"

namespace isoreel::made {

inline void sortByMortonCode(std::vector<Cell>& cells) {
  std::sort(cells.begin(), cells.end(), [](const Cell& a, const Cell& b) {
    return mortonCode(a.x, a.y, a.z) < mortonCode(b.x, b.y, b.z);
  });
}

/// Some random active cells of a cube of `side` cells, in Morton order.
inline std::vector<Cell> randomCells(Random& random, std::int32_t low, std::int32_t side,
                                     std::uint32_t rarity) {
  std::vector<Cell> cells;
  for (std::int32_t z = low; z < low + side; ++z) {
    for (std::int32_t y = low; y < low + side; ++y) {
      for (std::int32_t x = low; x < low + side; ++x) {
        if (random() % rarity != 0) continue;
        cells.push_back({static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y),
                         static_cast<std::uint16_t>(z), static_cast<std::uint8_t>(1 + random() % 254)});
      }
    }
  }
  sortByMortonCode(cells);
  return cells;
}

/// The cells of the coarser level whose cells have 2^log2 of these a side, in Morton order.
inline std::vector<Cell> coarser(const std::vector<Cell>& cells, std::uint32_t log2) {
  std::vector<Cell> result;
  for (const Cell& cell : cells) {
    const Cell up{static_cast<std::uint16_t>(cell.x >> log2), static_cast<std::uint16_t>(cell.y >> log2),
                  static_cast<std::uint16_t>(cell.z >> log2), 1};
    if (result.empty() || result.back().x != up.x || result.back().y != up.y || result.back().z != up.z)
      result.push_back(up);
  }
  return result;
}

/// The blocks of these cells, standing still.
inline MotionField blocksOf(const std::vector<Cell>& cells, std::uint32_t block_log2,
                            std::uint32_t vector_step) {
  MotionField field;
  field.build(coarser(cells, block_log2), block_log2, vector_step);
  field.assign(cells);
  return field;
}

}  // namespace isoreel::made
