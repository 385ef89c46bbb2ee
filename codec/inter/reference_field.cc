// SPDX-License-Identifier: BSD-3-Clause
#include "inter/reference_field.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace isoreel {
namespace {

using Row = std::int32_t __attribute__((vector_size(16)));
// Of a node without a distance: further than all, and CornerValues::kUnknown.
constexpr std::int32_t kNothing = 0x7FFF0000;

void keepLeast(std::int32_t* at, Row made) {
  Row old;
  std::memcpy(&old, at, sizeof(Row));
  old = made < old ? made : old;
  std::memcpy(at, &old, sizeof(Row));
}

Row rowAt(const std::int32_t* at) {
  Row row;
  std::memcpy(&row, at, sizeof(Row));
  return row;
}

// The bricks reached, by whether nodes below the brick's second and above its last are written, a bit for
// each axis.
constexpr auto kReaches = [] {
  std::array<std::array<std::uint32_t, 8>, 8> table{};
  for (std::uint32_t low = 0; low < 8; ++low) {
    for (std::uint32_t high = 0; high < 8; ++high) {
      for (std::uint32_t i = 0; i < 27; ++i) {
        const std::array<std::uint32_t, 3> d{i % 3, i / 3 % 3, i / 9};
        bool reached = true;
        for (std::uint32_t k = 0; k < 3; ++k)
          reached &= d[k] == 1 || ((d[k] == 0 ? low : high) >> k & 1) != 0;
        table[low][high] |= std::uint32_t{reached} << i;
      }
    }
  }
  return table;
}();

// Numbers of the bricks met last, one for each parity of their coordinates: neighbours go back and forth
// between bricks.
class Recent {
 public:
  template <class Look>
  std::uint32_t number(const std::array<std::int32_t, 3>& brick, Look look) {
    Entry& last =
        entries_[static_cast<std::size_t>((brick[0] & 1) | (brick[1] & 1) << 1 | (brick[2] & 1) << 2)];
    if (((brick[0] ^ last.brick[0]) | (brick[1] ^ last.brick[1]) | (brick[2] ^ last.brick[2])) != 0)
      last = {brick, look(brick)};
    return last.number;
  }

 private:
  struct Entry {
    std::array<std::int32_t, 3> brick{-1, -1, -1};
    std::uint32_t number = 0;
  };
  std::array<Entry, 8> entries_;
};

}  // namespace

void ReferenceField::clear() {
  map_.clear();
  places_.clear();
}

ReferenceField::Nearest::Nearest(const GridPosition& position) {
  for (std::size_t k = 0; k < 3; ++k) {
    const std::int32_t node = (position[k] + kCell / 2) >> kPositionBits;
    brick[k] = node >> kSideLog2;
    inside[k] = node & (kSide - 1);
  }
}

bool ReferenceField::build(std::span<const ReferencePlane> planes, std::uint64_t most) {
  clear();
  if (!findPlaces(planes, most)) {
    *this = {};
    return false;
  }
  Recent recent;
  std::uint32_t begun = 0;
  for (const ReferencePlane& plane : planes) {
    const Nearest at(plane.position);
    const std::uint32_t number =
        recent.number(at.brick, [&](const auto& b) { return map_.find(b[0], b[1], b[2]); });
    if (number == begun) sources_[begun++].nodes.fill(kNothing);  // they are numbered as they are met
    add(plane, at, sources_[number]);
  }
  for (std::uint32_t i = 0; i < bricks_.size(); ++i) gather(i);
  return true;
}

// First where things go, which takes little, then room for just these.
bool ReferenceField::findPlaces(std::span<const ReferencePlane> planes, std::uint64_t most) {
  Recent recent;
  std::uint64_t sources = 0;
  const auto fits = [&] {
    return roomFor(sources) * sizeof(Source) + roomFor(places_.size()) * sizeof(Brick) + bytesOf(places_) +
               map_.bytes() <=
           most;
  };
  for (const ReferencePlane& plane : planes) {
    const Nearest at(plane.position);
    const std::uint32_t number =
        recent.number(at.brick, [&](const auto& b) { return map_.findOrAdd(b[0], b[1], b[2]); });
    if (number == places_.size()) {
      places_.push_back({at.brick[0], at.brick[1], at.brick[2], 0});
      ++sources;
      if (!fits()) return false;
    }
    std::size_t low = 0, high = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      low |= std::size_t{at.inside[k] <= 1} << k;
      high |= std::size_t{at.inside[k] == kSide - 1} << k;
    }
    places_[number].reaches |= kReaches[low][high];
  }
  for (std::size_t i = 0; i < sources; ++i) {
    const Place from = places_[i];
    for (std::uint32_t left = from.reaches; left != 0; left &= left - 1) {
      const auto d = static_cast<std::int32_t>(std::countr_zero(left));
      const Place to{from.x + d % 3 - 1, from.y + d / 3 % 3 - 1, from.z + d / 9 - 1, 0};
      if (to.x < 0 || to.y < 0 || to.z < 0) continue;  // nothing is asked there
      if (map_.findOrAdd(to.x, to.y, to.z) == places_.size()) places_.push_back(to);
    }
    if (!fits()) return false;
  }
  setSize(sources_, sources);
  setSize(bricks_, places_.size());
  return true;
}

// Nodes go in rows of four: those at -1, 0 and 1 from the vertex's own, and one that never wins. A node's
// number is that of the own node, and for each step along an axis what that adds: half the derivative of the
// square twice, the normal, and the square of the step.
void ReferenceField::add(const ReferencePlane& plane, const Nearest& nearest, Source& source) {
  std::array<std::int32_t, 3> step{};
  constexpr std::int32_t kUnit = kCell >> 8, kStepSquare = kUnit * kUnit * 65536;
  std::int32_t middle = 32768;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::int32_t d = nearest.brick[k] * (kSide * kCell) + nearest.inside[k] * kCell - plane.position[k];
    middle += (d >> 8) * (d >> 8) * 65536 + ((plane.normal[k] * d) >> kPositionBits);
    step[k] = 2 * kUnit * 65536 * (d >> 8) + plane.normal[k];
  }
  const Row on_y{step[1], step[1], step[1], 0}, on_z{step[2], step[2], step[2], 0};
  const Row square{kStepSquare, kStepSquare, kStepSquare, 0};
  const Row plane_of_nodes{middle - step[0] + kStepSquare, middle, middle + step[0] + kStepSquare, kNothing};
  const auto put_plane = [&](std::int32_t* at, Row row) {
    keepLeast(at, row - on_y + square);
    keepLeast(at + Source::kRow, row);
    keepLeast(at + 2 * Source::kRow, row + on_y + square);
  };
  std::int32_t* const nodes = source.nodes.data() + nearest.inside[2] * Source::kPlane +
                              nearest.inside[1] * Source::kRow + nearest.inside[0];
  put_plane(nodes, plane_of_nodes - on_z + square);
  put_plane(nodes + Source::kPlane, plane_of_nodes);
  put_plane(nodes + 2 * Source::kPlane, plane_of_nodes + on_z + square);
}

// The nodes of a brick, from all sources that reach it.
void ReferenceField::gather(std::uint32_t number) {
  constexpr std::int32_t kWide = kSide + 4;  // of a row here
  std::array<std::int32_t, std::size_t{kRow} * kRow * kWide> nodes;
  if (number < sources_.size()) {
    const std::int32_t* from = sources_[number].nodes.data() + Source::kPlane + Source::kRow + 1;
    std::int32_t* at = nodes.data();
    for (std::int32_t z = 0; z < kRow; ++z, from += Source::kPlane - kRow * Source::kRow) {
      for (std::int32_t y = 0; y < kRow; ++y, from += Source::kRow, at += kWide)
        std::memcpy(at, from, kWide * sizeof(std::int32_t));
    }
  } else {
    nodes.fill(kNothing);
  }
  const Place to = places_[number];
  // By offset of another source's brick, -1 to 1: the first node that it has, their number, and the first
  // one's place there.
  constexpr std::array<std::int32_t, 3> kFirst{0, 0, kSide - 1}, kCount{1, kRow, 2}, kFrom{kSide + 1, 1, 0};
  for (std::uint32_t d = 0; d < 27; ++d) {
    if (d == 13) continue;
    const std::array<std::size_t, 3> o{d % 3, d / 3 % 3, d / 9};
    const std::uint32_t other =
        map_.find(to.x + static_cast<std::int32_t>(o[0]) - 1, to.y + static_cast<std::int32_t>(o[1]) - 1,
                  to.z + static_cast<std::int32_t>(o[2]) - 1);
    if (other >= sources_.size() || (places_[other].reaches >> (26 - d) & 1) == 0) continue;
    const std::int32_t* const source = sources_[other].nodes.data();
    for (std::int32_t z = 0; z < kCount[o[2]]; ++z) {
      for (std::int32_t y = 0; y < kCount[o[1]]; ++y) {
        const std::int32_t* const from =
            source + (kFrom[o[2]] + z) * Source::kPlane + (kFrom[o[1]] + y) * Source::kRow + kFrom[o[0]];
        std::int32_t* const at =
            nodes.data() + ((kFirst[o[2]] + z) * kRow + kFirst[o[1]] + y) * kWide + kFirst[o[0]];
        // Four at a time: beyond a source's last node is nothing, beyond this row's last nobody looks.
        keepLeast(at, rowAt(from));
        if (o[0] != 1) continue;
        keepLeast(at + 4, rowAt(from + 4));
        keepLeast(at + 8, rowAt(from + 8));
      }
    }
  }
  // The low halves less 32768.
  using Eight = std::int32_t __attribute__((vector_size(32)));
  using EightShort = std::int16_t __attribute__((vector_size(16)));
  std::int16_t* out = bricks_[number].data();
  for (const std::int32_t* row = nodes.data(); row < nodes.data() + nodes.size(); row += kWide, out += kRow) {
    Eight wide;
    std::memcpy(&wide, row, sizeof wide);
    const EightShort narrow = __builtin_convertvector(wide, EightShort) ^ CornerValues::kUnknown;
    std::memcpy(out, &narrow, sizeof narrow);
    out[8] = static_cast<std::int16_t>(static_cast<std::int16_t>(row[8]) ^ CornerValues::kUnknown);
  }
}

ReferenceField::Cursor::Found ReferenceField::Cursor::look(const std::array<std::int32_t, 3>& brick) const {
  Found found{brick, nullptr};
  for (const std::int32_t b : brick) {
    if (b < 0 || b > 65536 / kSide) return found;
  }
  const std::uint32_t number = field_.map_.find(brick[0], brick[1], brick[2]);
  if (number == BrickMap::kNone) return found;
  found.nodes = field_.bricks_[number].data();
  // Most of it is needed soon, in an order that the machine does not guess.
  constexpr std::size_t kLine = 64 / sizeof(std::int16_t);
  for (std::size_t i = 0; i < std::tuple_size_v<Brick>; i += kLine) __builtin_prefetch(found.nodes + i);
  return found;
}

}  // namespace isoreel
