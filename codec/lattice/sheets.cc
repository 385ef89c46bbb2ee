// SPDX-License-Identifier: BSD-3-Clause
#include "lattice/sheets.h"

#include <array>
#include <bit>

namespace isoreel {
namespace {

constexpr std::uint32_t kNoFace = 6;

constexpr std::uint32_t bitOf(std::uint32_t corner) { return 1u << corner; }
/// The corners of a face: low x, high x, low y and so on.
constexpr std::uint32_t cornersOn(std::uint32_t face) {
  std::uint32_t result = 0;
  for (std::uint32_t j = 0; j < 8; ++j) {
    if ((j >> face / 2 & 1) == face % 2) result |= bitOf(j);
  }
  return result;
}

/// What is joined to what in a cell: for each corner, those that are in its group for sure, one bit each.
using Joints = std::array<std::uint32_t, 8>;

constexpr std::uint32_t reached(const Joints& joints, std::uint32_t from) {
  std::uint32_t group = from;
  for (std::uint32_t before = 0; group != before;) {
    before = group;
    for (std::uint32_t j = 0; j < 8; ++j) {
      if ((before >> j & 1) != 0) group |= joints[j];
    }
  }
  return group;
}

constexpr bool isAmbiguous(std::uint32_t corners, std::uint32_t face) {
  const std::uint32_t on_face = corners & cornersOn(face);
  if (std::popcount(on_face) != 2) return false;
  const auto low = static_cast<std::uint32_t>(std::countr_zero(on_face));
  return std::popcount(low ^ static_cast<std::uint32_t>(std::countr_zero(on_face ^ bitOf(low)))) == 2;
}

/// Corners of one sign that share an edge are joined; so are the outside ones of an ambiguous face, or the
/// inside ones where it is turned.
constexpr Joints jointsOf(std::uint32_t corners, std::uint32_t turned) {
  Joints joints{};
  for (std::uint32_t j = 0; j < 8; ++j) {
    for (const std::uint32_t axis : {1u, 2u, 4u}) {
      if ((corners >> j & 1) == (corners >> (j ^ axis) & 1)) joints[j] |= bitOf(j ^ axis);
    }
  }
  for (std::uint32_t face = 0; face < 6; ++face) {
    if (!isAmbiguous(corners, face)) continue;
    const std::uint32_t pair = (face == turned ? corners : ~corners) & cornersOn(face);
    for (std::uint32_t j = 0; j < 8; ++j) {
      if ((pair >> j & 1) != 0) joints[j] |= pair;
    }
  }
  return joints;
}

struct Sheets {
  std::uint8_t count = 0;
  std::array<std::uint8_t, 4> corners{};  // rising
};

// Groups of corners and the sheets between them are a tree: each sheet is a closed curve on the cell's surface.
constexpr Sheets sheetsOf(std::uint32_t corners, std::uint32_t turned) {
  Sheets result;
  const Joints joints = jointsOf(corners, turned);
  for (std::uint32_t inside = 0; inside < 8; ++inside) {
    for (const std::uint32_t axis : {1u, 2u, 4u}) {
      if ((corners >> inside & 1) == 0 || (corners >> (inside ^ axis) & 1) != 0) continue;
      const std::uint32_t in = reached(joints, bitOf(inside)), out = reached(joints, bitOf(inside ^ axis));
      // All that there is on the inner side: across all edges but those between these two groups.
      Joints others = joints;
      for (std::uint32_t j = 0; j < 8; ++j) {
        for (const std::uint32_t a : {1u, 2u, 4u}) {
          const std::uint32_t ends = bitOf(j) | bitOf(j ^ a);
          if ((ends & in) == 0 || (ends & out) == 0) others[j] |= bitOf(j ^ a);
        }
      }
      const auto sheet = static_cast<std::uint8_t>(reached(others, in));
      std::uint8_t place = 0;
      while (place < result.count && result.corners[place] < sheet) ++place;
      if (place < result.count && result.corners[place] == sheet) continue;
      for (std::uint8_t k = result.count++; k > place; --k) result.corners[k] = result.corners[k - 1u];
      result.corners[place] = sheet;
    }
  }
  return result;
}

struct Tables {
  std::array<Sheets, 256> plain, turned;   // turned: with the doubtful face turned
  std::array<std::uint8_t, 256> doubtful;  // the face that the same sheet crosses twice, or kNoFace
  std::array<bool, 256> special;           // several sheets, or a doubtful face
};

Tables makeTables() {
  Tables tables{};
  for (std::uint32_t corners = 0; corners < 256; ++corners) {
    tables.plain[corners] = sheetsOf(corners, kNoFace);
    std::uint32_t doubtful = kNoFace;
    for (std::uint32_t face = 0; face < 6; ++face) {
      if (!isAmbiguous(corners, face)) continue;
      const std::uint32_t pair = corners & cornersOn(face);
      if ((reached(jointsOf(corners, kNoFace), pair & (0 - pair)) & pair) == pair) doubtful = face;
    }
    tables.doubtful[corners] = static_cast<std::uint8_t>(doubtful);
    tables.turned[corners] = sheetsOf(corners, doubtful);
    tables.special[corners] = tables.plain[corners].count > 1 || doubtful != kNoFace;
  }
  return tables;
}

/// Whether the doubtful face of a cell, if it has one, is so for all cells that have it.
bool isTurned(const Tables& tables, std::span<const Cell> cells, const CellIndex& index, const Cell& cell) {
  const std::uint32_t face = tables.doubtful[cell.corners];
  if (face == kNoFace) return false;
  std::array<std::int32_t, 3> across{cell.x, cell.y, cell.z};
  across[face / 2] += face % 2 == 0 ? -1 : 1;
  const std::uint32_t other = index.find(across[0], across[1], across[2]);
  return other == CellIndex::kNone || tables.doubtful[cells[other].corners] == (face ^ 1);
}

/// By axes, one bit each: the corners that are high along none of them.
constexpr std::uint32_t cornersBelow(std::uint32_t axes) {
  std::uint32_t result = 0xFF;
  for (std::uint32_t axis = 0; axis < 3; ++axis) {
    if ((axes >> axis & 1) != 0) result &= cornersOn(2 * axis);
  }
  return result;
}

/// How many of the nodes that two cells share do their sheets differ in.
int differences(const Cell& a, const Cell& b) {
  const std::array<int, 3> way{b.x - a.x, b.y - a.y, b.z - a.z};
  std::uint32_t from = a.corners, to = b.corners, axes = 0;
  for (std::uint32_t axis = 0; axis < 3; ++axis) {  // to the corners that are low where the cells differ
    if (way[axis] == 0) continue;
    axes |= 1u << axis;
    (way[axis] > 0 ? from : to) >>= 1u << axis;
  }
  return std::popcount((from ^ to) & cornersBelow(axes));
}

}  // namespace

std::vector<Cell> splitSheets(std::vector<Cell> cells, const CellIndex& index) {
  static const Tables tables = makeTables();
  std::vector<Cell> result;
  std::size_t done = 0;
  const auto append = [&](std::size_t end) {
    if (result.empty()) result.reserve(cells.size() + cells.size() / 64 + 64);
    result.insert(result.end(), cells.begin() + static_cast<std::ptrdiff_t>(done),
                  cells.begin() + static_cast<std::ptrdiff_t>(end));
  };
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const Cell& cell = cells[i];
    if (!tables.special[cell.corners]) continue;
    const Sheets& sheets = (isTurned(tables, cells, index, cell) ? tables.turned : tables.plain)[cell.corners];
    if (sheets.count == 1) continue;
    append(i);
    for (std::size_t k = 0; k < sheets.count; ++k) result.push_back({cell.x, cell.y, cell.z, sheets.corners[k]});
    done = i + 1;
  }
  if (done == 0) return cells;
  append(cells.size());
  return result;
}

std::uint8_t signsOf(std::span<const Cell> sheets, std::size_t first) {
  std::uint32_t corners = 0;
  for (std::size_t i = first; i < sheets.size() && sameCell(sheets[i], sheets[first]); ++i)
    corners ^= sheets[i].corners;
  // From group to group, the sign changes with each sheet between them: these are the signs, or all others. A
  // corner of the first sheet where an edge changes is inside.
  const std::uint32_t own = sheets[first].corners;
  for (std::uint32_t j = 0; j < 8; ++j) {
    for (const std::uint32_t axis : {1u, 2u, 4u}) {
      if ((own >> j & 1) != 0 && (own >> (j ^ axis) & 1) == 0)
        return static_cast<std::uint8_t>((corners >> j & 1) != 0 ? corners : ~corners);
    }
  }
  return static_cast<std::uint8_t>(own);
}

std::vector<Cell> uniteSheets(std::span<const Cell> sheets) {
  std::vector<Cell> cells;
  cells.reserve(sheets.size());
  for (std::size_t i = 0; i < sheets.size(); ++i) {
    if (i > 0 && sameCell(sheets[i], sheets[i - 1])) continue;
    cells.push_back(sheets[i]);
    cells.back().corners = signsOf(sheets, i);
  }
  return cells;
}

std::uint32_t facingSheet(std::span<const Cell> sheets, std::uint32_t first, const Cell& sheet) {
  std::uint32_t best = first;
  int least = 9;
  for (std::uint32_t i = first; i < sheets.size() && sameCell(sheets[i], sheets[first]); ++i) {
    const int differ = differences(sheet, sheets[i]);
    if (differ >= least) continue;
    least = differ;
    best = i;
  }
  return best;
}

std::uint64_t signsAround(std::uint64_t signs, const Cell& sheet) {
  constexpr std::uint64_t kOctant = 0x0033'0033;  // the nodes nearest to corner 0
  for (std::uint32_t j = 0; j < 8; ++j) {
    const std::uint32_t x = j & 1, y = j >> 1 & 1, z = j >> 2;
    const bool inside = (sheet.corners >> j & 1) != 0;
    if ((signs >> (21 + x + 4 * y + 16 * z) & 1) == inside) continue;
    const std::uint64_t nodes = kOctant << (2 * x + 8 * y + 32 * z);
    signs = inside ? signs | nodes : signs & ~nodes;
  }
  return signs;
}

}  // namespace isoreel
