// SPDX-License-Identifier: BSD-3-Clause
#include "lattice/sheets.h"

#include <algorithm>
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

/// Corners of one sign that share an edge are joined, but along the edge whose ends are `cut`; so are the
/// outside ones of an ambiguous face, or the inside ones where it is turned.
constexpr Joints jointsOf(std::uint32_t corners, std::uint32_t turned, std::uint32_t cut) {
  Joints joints{};
  for (std::uint32_t j = 0; j < 8; ++j) {
    for (const std::uint32_t axis : {1u, 2u, 4u}) {
      if ((corners >> j & 1) == (corners >> (j ^ axis) & 1) && (bitOf(j) | bitOf(j ^ axis)) != cut)
        joints[j] |= bitOf(j ^ axis);
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

  constexpr bool has(std::uint8_t sheet) const {
    return std::find(corners.begin(), corners.begin() + count, sheet) != corners.begin() + count;
  }
};

// Groups of corners and the sheets between them are a tree: each sheet is a closed curve on the cell's
// surface.
constexpr Sheets sheetsOf(std::uint32_t corners, std::uint32_t turned, std::uint32_t cut = 0) {
  Sheets result;
  const Joints joints = jointsOf(corners, turned, cut);
  for (std::uint32_t inside = 0; inside < 8; ++inside) {
    for (const std::uint32_t axis : {1u, 2u, 4u}) {
      if ((corners >> inside & 1) == 0 || (corners >> (inside ^ axis) & 1) != 0) continue;
      const std::uint32_t in = reached(joints, bitOf(inside)), out = reached(joints, bitOf(inside ^ axis));
      // All that there is on the inner side: across all edges but those between these two groups.
      Joints others = joints;
      for (std::uint32_t j = 0; j < 8; ++j) {
        for (const std::uint32_t a : {1u, 2u, 4u}) {
          const std::uint32_t ends = bitOf(j) | bitOf(j ^ a);
          if (ends != cut && ((ends & in) == 0 || (ends & out) == 0)) others[j] |= bitOf(j ^ a);
        }
      }
      const auto sheet = static_cast<std::uint8_t>(reached(others, in));
      if (!result.has(sheet)) result.corners[result.count++] = sheet;
    }
  }
  std::sort(result.corners.begin(), result.corners.begin() + result.count);
  return result;
}

/// Whether a sheet has an edge of the cell that is on none of these faces, one bit each: one that may have a
/// quad.
constexpr bool hasEdgeOff(std::uint32_t faces, std::uint32_t sheet) {
  for (std::uint32_t j = 0; j < 8; ++j) {
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      const std::uint32_t other = j ^ 1u << axis;
      if ((sheet >> j & 1) == (sheet >> other & 1)) continue;
      bool off = true;
      for (std::uint32_t face = 0; face < 6; ++face) {
        const std::uint32_t ends = bitOf(j) | bitOf(other);
        off = off && ((faces >> face & 1) == 0 || (cornersOn(face) & ends) != ends);
      }
      if (off) return true;
    }
  }
  return false;
}

/// The sheets where these faces are at the grid's border, two of them side by side. The border may cut a
/// sheet into two, each with quads of its own; then so does the edge that these faces share. `whole`:
/// sheetsOf() the corners.
Sheets sheetsAtBorder(std::uint32_t corners, std::uint32_t turned, std::uint32_t faces, const Sheets& whole) {
  for (std::uint32_t j = 0; j < 8; ++j) {
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      const std::uint32_t other = j | 1u << axis, ends = bitOf(j) | bitOf(other);
      if (other == j || (corners >> j & 1) != (corners >> other & 1)) continue;
      bool at_border = true;
      for (std::uint32_t face = 0; face < 6; ++face)
        at_border = at_border && ((cornersOn(face) & ends) != ends || (faces >> face & 1) != 0);
      if (!at_border || (reached(jointsOf(corners, turned, ends), bitOf(j)) & ends) == ends) continue;
      const Sheets parts = sheetsOf(corners, turned, ends);
      bool all = parts.count > whole.count;
      for (std::size_t k = 0; k < parts.count; ++k)
        all = all && (whole.has(parts.corners[k]) || hasEdgeOff(faces, parts.corners[k]));
      if (all) return parts;
    }
  }
  return whole;
}

struct Tables {
  std::array<Sheets, 256> plain, turned;   // turned: with the doubtful face turned
  std::array<std::uint8_t, 256> doubtful;  // the face that the same sheet crosses twice, or kNoFace
  std::array<std::uint8_t, 256> mixed;     // faces whose corners differ, one bit each
  std::array<bool, 256> cut;               // sheetsAtBorder() may say something else
  std::array<bool, 256> special;           // several sheets, or they may depend on what is across faces
};

Tables makeTables() {
  Tables tables{};
  for (std::uint32_t corners = 0; corners < 256; ++corners) {
    tables.plain[corners] = sheetsOf(corners, kNoFace);
    std::uint32_t doubtful = kNoFace;
    for (std::uint32_t face = 0; face < 6; ++face) {
      if (!isAmbiguous(corners, face)) continue;
      const std::uint32_t pair = corners & cornersOn(face);
      if ((reached(jointsOf(corners, kNoFace, 0), pair & (0 - pair)) & pair) == pair) doubtful = face;
    }
    tables.doubtful[corners] = static_cast<std::uint8_t>(doubtful);
    tables.turned[corners] = doubtful == kNoFace ? tables.plain[corners] : sheetsOf(corners, doubtful);
    for (std::uint32_t face = 0; face < 6; ++face) {
      const std::uint32_t on_face = cornersOn(face);
      if ((corners & on_face) != 0 && (corners & on_face) != on_face)
        tables.mixed[corners] = static_cast<std::uint8_t>(tables.mixed[corners] | 1u << face);
    }
    for (std::uint32_t a = 0; a < 6; ++a) {
      for (std::uint32_t b = (a | 1) + 1; b < 6; ++b) {
        const Sheets parts = sheetsAtBorder(corners, kNoFace, 1u << a | 1u << b, tables.plain[corners]);
        tables.cut[corners] = tables.cut[corners] || parts.count > tables.plain[corners].count;
      }
    }
    tables.special[corners] = tables.plain[corners].count > 1 || doubtful != kNoFace || tables.cut[corners];
  }
  return tables;
}

/// The sheets of a cell for which Tables::special is true.
Sheets sheetsAmong(const Tables& tables, std::span<const Cell> cells, const CellIndex& index,
                   const Cell& cell) {
  const auto across = [&](std::uint32_t face) {
    std::array<std::int32_t, 3> at{cell.x, cell.y, cell.z};
    at[face / 2] += face % 2 == 0 ? -1 : 1;
    return index.find(at[0], at[1], at[2]);
  };
  // A doubtful face is turned if it is doubtful for all cells that have it.
  std::uint32_t turned = tables.doubtful[cell.corners];
  if (turned != kNoFace) {
    const std::uint32_t other = across(turned);
    if (other != CellIndex::kNone && tables.doubtful[cells[other].corners] != (turned ^ 1)) turned = kNoFace;
  }
  const Sheets& result = (turned == kNoFace ? tables.plain : tables.turned)[cell.corners];
  if (!tables.cut[cell.corners]) return result;
  std::uint32_t border = 0;
  for (std::uint32_t face = 0; face < 6; ++face) {
    if ((tables.mixed[cell.corners] >> face & 1) != 0 && across(face) == CellIndex::kNone)
      border |= 1u << face;
  }
  return (border & (border - 1)) == 0 ? result : sheetsAtBorder(cell.corners, turned, border, result);
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
  return static_cast<int>(countBits((from ^ to) & cornersBelow(axes)));
}

}  // namespace

std::vector<Cell> splitSheets(std::vector<Cell> cells, CellIndex& index, std::size_t most) {
  static const Tables tables = makeTables();
  std::vector<Cell> result;
  std::size_t done = 0;
  const auto append = [&](std::size_t end) {
    if (result.empty()) result.reserve(most + 1);
    end = std::min(end, done + most + 1 - result.size());
    result.insert(result.end(), cells.begin() + static_cast<std::ptrdiff_t>(done),
                  cells.begin() + static_cast<std::ptrdiff_t>(end));
  };
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const Cell& cell = cells[i];
    if (!tables.special[cell.corners]) continue;
    const Sheets sheets = sheetsAmong(tables, cells, index, cell);
    if (sheets.count == 1) continue;
    append(i);
    for (std::size_t k = 0; k < sheets.count && result.size() <= most; ++k)
      result.push_back({cell.x, cell.y, cell.z, sheets.corners[k]});
    if (result.size() > most) return result;
    done = i + 1;
  }
  if (done == 0) return cells;
  append(cells.size());
  if (result.size() > most) return result;
  index.repeat(result);
  return result;
}

std::uint8_t signsOf(std::span<const Cell> sheets, std::size_t first) {
  std::uint32_t corners = 0;
  for (std::size_t i = first; i < sheets.size() && sameCell(sheets[i], sheets[first]); ++i)
    corners ^= sheets[i].corners;
  // From group to group, the sign changes with each sheet between them: these are the signs, or all others. A
  // corner of the first sheet where an edge of the cell changes is inside.
  const std::uint32_t own = sheets[first].corners;
  for (std::uint32_t j = 0; j < 8; ++j) {
    for (const std::uint32_t axis : {1u, 2u, 4u}) {
      const bool changes = ((corners >> j ^ corners >> (j ^ axis)) & 1) != 0;
      if (changes && (own >> j & 1) != 0 && (own >> (j ^ axis) & 1) == 0)
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
