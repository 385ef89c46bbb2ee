// SPDX-License-Identifier: BSD-3-Clause
#include "inter/reference_field.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

#include "lattice/bits.h"
#include "lattice/runs.h"

namespace isoreel {
namespace {

using Row = std::int32_t __attribute__((vector_size(16)));
// Numbers of nodes are between these, so that, taken for floats, they are in the same order and none is
// special: SSE2 has a minimum of floats only.
constexpr std::int32_t kLeast = 0x00800000;
// Of a node without a distance: further than all, and CornerValues::kUnknown.
constexpr std::int32_t kNothing = 0x7F7F0000;

void keepLeast(std::int32_t* at, Row made) {
#ifdef __SSE2__
  auto* const to = reinterpret_cast<float*>(at);
  _mm_storeu_ps(to, _mm_min_ps(_mm_loadu_ps(to), reinterpret_cast<__m128>(made)));
#else
  Row old;
  std::memcpy(&old, at, sizeof(Row));
  old = made < old ? made : old;
  std::memcpy(at, &old, sizeof(Row));
#endif
}

Row rowAt(const std::int32_t* at) {
  Row row;
  std::memcpy(&row, at, sizeof(Row));
  return row;
}

// What a node's place along an axis of its brick says of the bricks that those around it reach: the next
// lower one from bit 0, the next higher one from bit 3.
constexpr std::array<std::uint8_t, 8> kNear{1, 1, 0, 0, 0, 0, 0, 8};
// The bricks reached, by that of all axes.
constexpr auto kReaches = [] {
  std::array<std::uint32_t, 64> table{};
  for (std::uint32_t near = 0; near < 64; ++near) {
    for (std::uint32_t i = 0; i < 27; ++i) {
      const std::array<std::uint32_t, 3> d{i % 3, i / 3 % 3, i / 9};
      bool reached = true;
      for (std::uint32_t k = 0; k < 3; ++k)
        reached &= d[k] == 1 || (near >> (d[k] == 0 ? k : k + 3) & 1) != 0;
      table[near] |= std::uint32_t{reached} << i;
    }
  }
  return table;
}();

constexpr std::uint32_t kNone = 0xFFFFFFFF;
constexpr std::uint32_t kItself = 1u << 13;  // of Source::reaches

}  // namespace

void ReferenceField::clear() {
  map_.clear();
  places_.clear();
  sources_.clear();
  links_.clear();
  first_links_.clear();
  bricks_.clear();
}

bool ReferenceField::build(std::span<const ReferencePlane> planes, std::uint64_t most,
                           const ParallelFor& parallel) {
  clear();
  if (!findSources(planes, most)) {
    *this = {};
    return false;
  }
  addPlanes(planes, parallel);
  if (!link(most)) {
    *this = {};
    return false;
  }
  forRuns(parallel, bricks_.size(), 64, [&](std::size_t first, std::size_t end) {
    for (std::size_t i = first; i < end; ++i) gather(static_cast<std::uint32_t>(i));
  });
  return true;
}

// The source of each plane, and room for all of them.
bool ReferenceField::findSources(std::span<const ReferencePlane> planes, std::uint64_t most) {
  if (planes.size() > most / sizeof(std::uint32_t)) return false;
  setSize(source_of_, planes.size());
  // Vertices go to and fro between a few bricks: the last ones, by their lowest bits.
  struct Last {
    Place brick{-1, -1, -1};
    std::uint32_t number = 0;
  };
  std::array<Last, 8> lasts;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    std::array<std::int32_t, 3> brick{};
    for (std::size_t k = 0; k < 3; ++k)
      brick[k] = ((planes[i].position[k] + kCell / 2) >> kPositionBits) >> kSideLog2;
    Last& last = lasts[static_cast<std::size_t>((brick[0] & 1) | (brick[1] & 1) << 1 | (brick[2] & 1) << 2)];
    if (((brick[0] ^ last.brick.x) | (brick[1] ^ last.brick.y) | (brick[2] ^ last.brick.z)) != 0) {
      if (places_.size() == places_.capacity()) {
        const std::size_t next = places_.size() + places_.size() / 2 + 16;
        if (bytes() + 3 * next * sizeof(Place) + places_.size() * (sizeof(Source) + sizeof(Brick)) +
                2 * BrickMap::bytesFor(next) >
            most)
          return false;
        places_.reserve(next);
      }
      last.brick = {brick[0], brick[1], brick[2]};
      last.number = map_.findOrAdd(brick[0], brick[1], brick[2]);
      if (last.number == places_.size()) places_.push_back(last.brick);
    }
    source_of_[i] = last.number;
  }
  if (bytes() + places_.size() * (sizeof(Source) + sizeof(Brick)) > most) return false;
  clearFor(sources_, places_.size());  // no more than these: they are large
  sources_.resize(places_.size());
  return true;
}

// Sources are numbered as planes first have them: those between the first ones of one run and of the next
// belong to that run. What it has for others waits until all are done; which is nearest hangs on no order.
void ReferenceField::addPlanes(std::span<const ReferencePlane> planes, const ParallelFor& parallel) {
  const std::size_t runs = runCount(planes.size(), 4096);
  std::vector<std::uint32_t> firsts{0};
  for (std::size_t n = 0; n < runs; ++n) {
    std::uint32_t next = firsts.back();
    for (std::size_t i = runStart(n, runs, planes.size()); i < runStart(n + 1, runs, planes.size()); ++i)
      next = std::max(next, source_of_[i] + 1);
    firsts.push_back(next);
  }
  parallel(runs, [&](std::size_t n) {
    for (std::uint32_t source = firsts[n]; source < firsts[n + 1]; ++source) {
      sources_[source].nodes.fill(kNothing);
      sources_[source].reaches = 0;
    }
    for (std::size_t i = runStart(n, runs, planes.size()); i < runStart(n + 1, runs, planes.size()); ++i) {
      if (source_of_[i] >= firsts[n]) add(planes[i], sources_[source_of_[i]]);
    }
  });
  for (std::size_t n = 1; n < runs; ++n) {
    for (std::size_t i = runStart(n, runs, planes.size()); i < runStart(n + 1, runs, planes.size()); ++i) {
      if (source_of_[i] < firsts[n]) add(planes[i], sources_[source_of_[i]]);
    }
  }
}

// Which sources have nodes of which bricks, and room for these.
bool ReferenceField::link(std::uint64_t most) {
  std::size_t links = 0;
  for (const Source& source : sources_) links += countBits(source.reaches & ~kItself);
  const std::size_t places = sources_.size() + links;  // if each link goes to a brick of its own
  if (bytes() + links * sizeof(Link) + 3 * places * (sizeof(Place) + sizeof(std::uint32_t)) +
          2 * BrickMap::bytesFor(places) >
      most)
    return false;
  clearFor(links_, links);
  first_links_.assign(sources_.size(), kNone);
  for (std::uint32_t i = 0; i < sources_.size(); ++i) {
    const Place from = places_[i];
    for (std::uint32_t left = sources_[i].reaches & ~kItself; left != 0; left &= left - 1) {
      const auto d = std::countr_zero(left);
      const Place to{from.x + d % 3 - 1, from.y + d / 3 % 3 - 1, from.z + d / 9 - 1};
      if (to.x < 0 || to.y < 0 || to.z < 0) continue;  // nothing is asked there
      const std::uint32_t number = map_.findOrAdd(to.x, to.y, to.z);
      if (number == places_.size()) {
        places_.push_back(to);
        first_links_.push_back(kNone);
      }
      links_.push_back({i, static_cast<std::uint32_t>(26 - d), first_links_[number]});
      first_links_[number] = static_cast<std::uint32_t>(links_.size() - 1);
    }
  }
  if (bytes() + (bricks_.capacity() < places_.size() ? roomFor(places_.size()) * sizeof(Brick) : 0) > most)
    return false;
  setSize(bricks_, places_.size());
  return true;
}

// Nodes go in rows of four: those at -1, 0 and 1 from the vertex's own, and one that never wins. A node's
// number is that of the own node, and for each step along an axis what that adds: half the derivative of the
// square twice, the normal, and the square of the step.
void ReferenceField::add(const ReferencePlane& plane, Source& source) {
  std::array<std::int32_t, 3> inside{};  // the nearest node, in its brick
  std::array<std::int32_t, 3> step{};
  constexpr std::int32_t kUnit = kCell >> 8, kStepSquare = kUnit * kUnit * 65536;
  std::int32_t middle = kLeast + 32768;
  std::size_t near = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::int32_t own = (plane.position[k] + kCell / 2) >> kPositionBits;
    inside[k] = own & (kSide - 1);
    near |= static_cast<std::size_t>(kNear[static_cast<std::size_t>(inside[k])]) << k;
    const std::int32_t d = own * kCell - plane.position[k];
    middle += (d >> 8) * (d >> 8) * 65536 + ((plane.normal[k] * d) >> kPositionBits);
    step[k] = 2 * kUnit * 65536 * (d >> 8) + plane.normal[k];
  }
  source.reaches |= kReaches[near];
  const Row on_y{step[1], step[1], step[1], 0}, on_z{step[2], step[2], step[2], 0};
  const Row square{kStepSquare, kStepSquare, kStepSquare, 0};
  const Row plane_of_nodes{middle - step[0] + kStepSquare, middle, middle + step[0] + kStepSquare, kNothing};
  const auto put_plane = [&](std::int32_t* at, Row row) {
    keepLeast(at, row - on_y + square);
    keepLeast(at + Source::kRow, row);
    keepLeast(at + 2 * Source::kRow, row + on_y + square);
  };
  std::int32_t* const at =
      source.nodes.data() + inside[2] * Source::kPlane + inside[1] * Source::kRow + inside[0];
  put_plane(at, plane_of_nodes - on_z + square);
  put_plane(at + Source::kPlane, plane_of_nodes);
  put_plane(at + 2 * Source::kPlane, plane_of_nodes + on_z + square);
}

// From the source at an offset of bricks, numbered as in Source::reaches, to the nodes of a brick.
template <std::size_t Offset>
void ReferenceField::merge(const std::int32_t* source, std::int32_t* nodes) {
  // By offset, -1 to 1: the first node that it has, their number, and the first one's place there.
  constexpr std::array<std::int32_t, 3> kFirst{0, 0, kSide - 1}, kCount{1, kRow, 2}, kFrom{kSide + 1, 1, 0};
  constexpr std::size_t kX = Offset % 3, kY = Offset / 3 % 3, kZ = Offset / 9;
  for (std::int32_t z = 0; z < kCount[kZ]; ++z) {
    for (std::int32_t y = 0; y < kCount[kY]; ++y) {
      const std::int32_t* const from =
          source + (kFrom[kZ] + z) * Source::kPlane + (kFrom[kY] + y) * Source::kRow + kFrom[kX];
      std::int32_t* const at = nodes + ((kFirst[kZ] + z) * kRow + kFirst[kY] + y) * kWide + kFirst[kX];
      // Four at a time: beyond a source's last node is nothing, beyond this row's last nobody looks.
      keepLeast(at, rowAt(from));
      if constexpr (kX == 1) {
        keepLeast(at + 4, rowAt(from + 4));
        keepLeast(at + 8, rowAt(from + 8));
      }
    }
  }
}

void ReferenceField::mergeFrom(const std::int32_t* source, std::uint32_t offset, std::int32_t* nodes) {
  static constexpr auto kMerges = []<std::size_t... O>(std::index_sequence<O...>) {
    return std::array<void (*)(const std::int32_t*, std::int32_t*), 27>{&merge<O>...};
  }
  (std::make_index_sequence<27>());
  kMerges[offset](source, nodes);
}

// The nodes of a brick, from all sources that reach it.
void ReferenceField::gather(std::uint32_t number) {
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
  for (std::uint32_t link = first_links_[number]; link != kNone; link = links_[link].next) {
    const std::int32_t* const source = sources_[links_[link].source].nodes.data();
    mergeFrom(source, links_[link].offset, nodes.data());
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
