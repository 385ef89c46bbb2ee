// SPDX-License-Identifier: BSD-3-Clause
#include "inter/reference_field.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <memory>
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
constexpr std::uint32_t kItself = 1u << 13;  // of Origin::reaches

}  // namespace

/// Builds a field in waves of planes: after each, the bricks are gathered that no later one has anything for,
/// so that few sources are there at once.
class ReferenceField::Builder {
 public:
  Builder(ReferenceField& field, std::span<const ReferencePlane> planes, std::uint64_t most,
          const ParallelFor& parallel)
      : field_(field), planes_(planes), most_(most), parallel_(parallel) {}

  /// False when it would take more than `most` bytes.
  bool build() { return findSources() && link() && fill(); }

 private:
  /// What the vertices nearest to the 8×8×8 first nodes of a brick say: of nodes -1 to 8. A node is a number
  /// whose high half is the squared distance of the nearest vertex, 1/4096 of a cell squared, and whose low
  /// half is the plane's distance + 32768: the least is the nearest.
  struct Source {
    // Rows have room for reading and writing four nodes at a time.
    static constexpr std::int32_t kRow = kSide + 5, kPlane = (kSide + 2) * kRow;
    std::array<std::int32_t, std::size_t{kSide + 2} * kPlane> nodes;
    // Leaves them as they are: they are many, and by default they would be cleared.
    Source() {}  // NOLINT(modernize-use-equals-default)
  };
  /// A source while waves pass.
  struct Origin {
    std::uint32_t reaches = 0;  // bit (dx + 1) + 3 (dy + 1) + 9 (dz + 1): the brick at that offset has some
    std::uint32_t bricks = 0;   // how many of them are still to be gathered
    std::uint32_t place = 0;    // in sources_
  };
  // That a source has nodes of a brick; the next one's place in links_.
  struct Link {
    std::uint32_t source, offset, next;
  };
  // Planes of a wave, and of a run of these.
  static constexpr std::size_t kWave = 16384, kRun = 2048;
  static constexpr std::int32_t kWide = kSide + 4;  // a row of a brick's nodes while they are gathered

  std::uint64_t bytes() const {
    return field_.bytes() + bytesOf(source_of_) + bytesOf(origins_) + bytesOf(links_) +
           bytesOf(first_links_) + bytesOf(last_waves_) + bytesOf(order_) + bytesOf(sources_) +
           bytesOf(free_) + sources_.size() * sizeof(Source);
  }
  bool findSources();
  bool link();
  bool fill();
  bool takeSources(std::uint32_t first, std::uint32_t end);
  void addPlanes(std::span<const ReferencePlane> planes, const std::uint32_t* source_of,
                 std::span<const std::uint32_t> firsts);
  static void add(const ReferencePlane& plane, Source& source);
  Source& sourceAt(std::uint32_t number) { return *sources_[origins_[number].place]; }
  void gather(std::uint32_t number);
  void leave(std::uint32_t source) {
    if (--origins_[source].bricks == 0) free_.push_back(origins_[source].place);
  }
  template <std::size_t Offset>
  static void merge(const std::int32_t* source, std::int32_t* nodes);
  static void mergeFrom(const std::int32_t* source, std::uint32_t offset, std::int32_t* nodes);

  ReferenceField& field_;
  std::span<const ReferencePlane> planes_;
  std::uint64_t most_;
  const ParallelFor& parallel_;
  std::vector<std::uint32_t> source_of_;  // by plane
  std::vector<Origin> origins_;           // of the sources: the first bricks
  std::vector<Link> links_;
  std::vector<std::uint32_t> first_links_;  // by brick
  std::vector<std::uint32_t> last_waves_;   // by brick: the wave after which it can be gathered
  std::vector<std::uint32_t> order_;        // the bricks, in the order of these
  std::vector<std::unique_ptr<Source>> sources_;
  std::vector<std::uint32_t> free_;  // of sources_
};

// The source of each plane, and what bricks it reaches.
bool ReferenceField::Builder::findSources() {
  if (planes_.size() > most_ / sizeof(std::uint32_t)) return false;
  source_of_.resize(planes_.size());
  // Vertices go to and fro between a few bricks: the last ones, by their lowest bits.
  struct Last {
    Place brick{-1, -1, -1};
    std::uint32_t number = 0;
  };
  std::array<Last, 8> lasts;
  for (std::size_t i = 0; i < planes_.size(); ++i) {
    std::array<std::int32_t, 3> brick{};
    std::size_t near = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int32_t own = (planes_[i].position[k] + kCell / 2) >> kPositionBits;
      brick[k] = own >> kSideLog2;
      near |= static_cast<std::size_t>(kNear[static_cast<std::size_t>(own & (kSide - 1))]) << k;
    }
    Last& last = lasts[static_cast<std::size_t>((brick[0] & 1) | (brick[1] & 1) << 1 | (brick[2] & 1) << 2)];
    if (((brick[0] ^ last.brick.x) | (brick[1] ^ last.brick.y) | (brick[2] ^ last.brick.z)) != 0) {
      if (field_.places_.size() == field_.places_.capacity() || origins_.size() == origins_.capacity()) {
        const std::size_t next = field_.places_.size() + field_.places_.size() / 2 + 16;
        if (bytes() + 2 * next * (sizeof(Place) + sizeof(Origin) + sizeof(std::uint32_t)) +
                field_.places_.size() * sizeof(Brick) + 2 * BrickMap::bytesFor(next) >
            most_)
          return false;
        field_.places_.reserve(next);
        origins_.reserve(next);
        last_waves_.reserve(next);
      }
      last.brick = {brick[0], brick[1], brick[2]};
      last.number = field_.map_.findOrAdd(brick[0], brick[1], brick[2]);
      if (last.number == field_.places_.size()) {
        field_.places_.push_back(last.brick);
        origins_.emplace_back();
        last_waves_.push_back(0);
      }
    }
    source_of_[i] = last.number;
    origins_[last.number].reaches |= kReaches[near];
    last_waves_[last.number] = static_cast<std::uint32_t>(i / kWave);
  }
  return true;
}

// Which sources have nodes of which bricks, and room for these.
bool ReferenceField::Builder::link() {
  std::size_t links = 0;
  for (const Origin& origin : origins_) links += countBits(origin.reaches & ~kItself);
  const std::size_t places = origins_.size() + links;  // if each link goes to a brick of its own
  if (bytes() + links * sizeof(Link) + 3 * places * (sizeof(Place) + 2 * sizeof(std::uint32_t)) +
          2 * BrickMap::bytesFor(places) >
      most_)
    return false;
  clearFor(links_, links);
  first_links_.assign(origins_.size(), kNone);
  const std::vector<std::uint32_t> own_waves = last_waves_;
  for (std::uint32_t i = 0; i < origins_.size(); ++i) {
    const Place from = field_.places_[i];
    origins_[i].bricks = 1;
    for (std::uint32_t left = origins_[i].reaches & ~kItself; left != 0; left &= left - 1) {
      const auto d = std::countr_zero(left);
      const Place to{from.x + d % 3 - 1, from.y + d / 3 % 3 - 1, from.z + d / 9 - 1};
      if (to.x < 0 || to.y < 0 || to.z < 0) continue;  // nothing is asked there
      const std::uint32_t number = field_.map_.findOrAdd(to.x, to.y, to.z);
      if (number == field_.places_.size()) {
        field_.places_.push_back(to);
        first_links_.push_back(kNone);
        last_waves_.push_back(0);
      }
      ++origins_[i].bricks;
      last_waves_[number] = std::max(last_waves_[number], own_waves[i]);
      links_.push_back({i, static_cast<std::uint32_t>(26 - d), first_links_[number]});
      first_links_[number] = static_cast<std::uint32_t>(links_.size() - 1);
    }
  }
  if (bytes() + (field_.bricks_.capacity() < field_.places_.size()
                     ? roomFor(field_.places_.size()) * sizeof(Brick)
                     : 0) >
      most_)
    return false;
  setSize(field_.bricks_, field_.places_.size());
  return true;
}

// A wave of planes after the other goes to the sources, and after each the bricks are gathered that no later
// one has anything for: few sources are there at once.
bool ReferenceField::Builder::fill() {
  const std::size_t waves = planes_.size() / kWave + 1;
  if (bytes() + (waves + 1 + field_.bricks_.size() + 2 * origins_.size()) * sizeof(std::uint64_t) > most_)
    return false;
  std::vector<std::uint32_t> starts(waves + 1);  // of each wave's bricks in order_
  for (const std::uint32_t wave : last_waves_) ++starts[wave + 1];
  for (std::size_t wave = 0; wave < waves; ++wave) starts[wave + 1] += starts[wave];
  order_.resize(field_.bricks_.size());
  for (std::uint32_t i = 0; i < field_.bricks_.size(); ++i) order_[starts[last_waves_[i]]++] = i;
  sources_.reserve(origins_.size());
  free_.reserve(origins_.size());
  std::uint32_t done = 0;
  for (std::size_t wave = 0, taken = 0; wave < waves; ++wave) {
    const std::size_t begin = wave * kWave;
    const auto in_wave = planes_.subspan(begin, std::min(kWave, planes_.size() - begin));
    // Sources are numbered as planes first have them: those between the first ones of one run and of the next
    // belong to that run.
    const std::size_t runs = runCount(in_wave.size(), kRun);
    std::vector<std::uint32_t> firsts{static_cast<std::uint32_t>(taken)};
    for (std::size_t n = 0; n < runs; ++n) {
      std::uint32_t next = firsts.back();
      for (std::size_t i = runStart(n, runs, in_wave.size()); i < runStart(n + 1, runs, in_wave.size()); ++i)
        next = std::max(next, source_of_[begin + i] + 1);
      firsts.push_back(next);
    }
    if (!takeSources(firsts.front(), firsts.back())) return false;
    taken = firsts.back();
    addPlanes(in_wave, source_of_.data() + begin, firsts);
    const std::uint32_t end = starts[wave];  // they have moved on by a wave
    forRuns(parallel_, end - done, 32, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = done + first; i < done + last; ++i) gather(order_[i]);
    });
    for (; done < end; ++done) {
      const std::uint32_t number = order_[done];
      if (number < origins_.size()) leave(number);
      for (std::uint32_t link = first_links_[number]; link != kNone; link = links_[link].next)
        leave(links_[link].source);
    }
  }
  return true;
}

// Memory for the sources of these numbers; that of others that are done with.
bool ReferenceField::Builder::takeSources(std::uint32_t first, std::uint32_t end) {
  const std::size_t more = std::max<std::size_t>(end - first, free_.size()) - free_.size();
  if (bytes() + more * sizeof(Source) > most_) return false;
  for (std::uint32_t number = first; number < end; ++number) {
    if (free_.empty()) {
      origins_[number].place = static_cast<std::uint32_t>(sources_.size());
      sources_.push_back(std::make_unique<Source>());
    } else {
      origins_[number].place = free_.back();
      free_.pop_back();
    }
  }
  return true;
}

// What a run has for the sources of others waits until all are done; which is nearest hangs on no order.
void ReferenceField::Builder::addPlanes(std::span<const ReferencePlane> planes,
                                        const std::uint32_t* source_of,
                                        std::span<const std::uint32_t> firsts) {
  const std::size_t runs = firsts.size() - 1;
  parallel_(runs, [&](std::size_t n) {
    for (std::uint32_t source = firsts[n]; source < firsts[n + 1]; ++source)
      sourceAt(source).nodes.fill(kNothing);
    const std::uint32_t own = n == 0 ? 0 : firsts[n];  // those of waves before are the first run's
    for (std::size_t i = runStart(n, runs, planes.size()); i < runStart(n + 1, runs, planes.size()); ++i) {
      if (source_of[i] >= own) add(planes[i], sourceAt(source_of[i]));
    }
  });
  for (std::size_t n = 1; n < runs; ++n) {
    for (std::size_t i = runStart(n, runs, planes.size()); i < runStart(n + 1, runs, planes.size()); ++i) {
      if (source_of[i] < firsts[n]) add(planes[i], sourceAt(source_of[i]));
    }
  }
}

// Nodes go in rows of four: those at -1, 0 and 1 from the vertex's own, and one that never wins. A node's
// number is that of the own node, and for each step along an axis what that adds: half the derivative of the
// square twice, the normal, and the square of the step.
void ReferenceField::Builder::add(const ReferencePlane& plane, Source& source) {
  std::array<std::int32_t, 3> inside{};  // the nearest node, in its brick
  std::array<std::int32_t, 3> step{};
  constexpr std::int32_t kUnit = kCell >> 8, kStepSquare = kUnit * kUnit * 65536;
  std::int32_t middle = kLeast + 32768;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::int32_t own = (plane.position[k] + kCell / 2) >> kPositionBits;
    inside[k] = own & (kSide - 1);
    const std::int32_t d = own * kCell - plane.position[k];
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
  std::int32_t* const at =
      source.nodes.data() + inside[2] * Source::kPlane + inside[1] * Source::kRow + inside[0];
  put_plane(at, plane_of_nodes - on_z + square);
  put_plane(at + Source::kPlane, plane_of_nodes);
  put_plane(at + 2 * Source::kPlane, plane_of_nodes + on_z + square);
}

// From the source at an offset of bricks, numbered as in Origin::reaches, to the nodes of a brick.
template <std::size_t Offset>
void ReferenceField::Builder::merge(const std::int32_t* source, std::int32_t* nodes) {
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

void ReferenceField::Builder::mergeFrom(const std::int32_t* source, std::uint32_t offset,
                                        std::int32_t* nodes) {
  static constexpr auto kMerges = []<std::size_t... O>(std::index_sequence<O...>) {
    return std::array<void (*)(const std::int32_t*, std::int32_t*), 27>{&merge<O>...};
  }
  (std::make_index_sequence<27>());
  kMerges[offset](source, nodes);
}

// The nodes of a brick, from all sources that reach it.
void ReferenceField::Builder::gather(std::uint32_t number) {
  std::array<std::int32_t, std::size_t{kRow} * kRow * kWide> nodes;
  if (number < origins_.size()) {
    const std::int32_t* from = sourceAt(number).nodes.data() + Source::kPlane + Source::kRow + 1;
    std::int32_t* at = nodes.data();
    for (std::int32_t z = 0; z < kRow; ++z, from += Source::kPlane - kRow * Source::kRow) {
      for (std::int32_t y = 0; y < kRow; ++y, from += Source::kRow, at += kWide)
        std::memcpy(at, from, kWide * sizeof(std::int32_t));
    }
  } else {
    nodes.fill(kNothing);
  }
  for (std::uint32_t link = first_links_[number]; link != kNone; link = links_[link].next) {
    const std::int32_t* const source = sourceAt(links_[link].source).nodes.data();
    mergeFrom(source, links_[link].offset, nodes.data());
  }
  // The low halves less 32768.
  using Eight = std::int32_t __attribute__((vector_size(32)));
  using EightShort = std::int16_t __attribute__((vector_size(16)));
  std::int16_t* out = field_.bricks_[number].data();
  for (const std::int32_t* row = nodes.data(); row < nodes.data() + nodes.size(); row += kWide, out += kRow) {
    Eight wide;
    std::memcpy(&wide, row, sizeof wide);
    const EightShort narrow = __builtin_convertvector(wide, EightShort) ^ CornerValues::kUnknown;
    std::memcpy(out, &narrow, sizeof narrow);
    out[8] = static_cast<std::int16_t>(static_cast<std::int16_t>(row[8]) ^ CornerValues::kUnknown);
  }
}

bool ReferenceField::build(std::span<const ReferencePlane> planes, std::uint64_t most,
                           const ParallelFor& parallel) {
  clear();
  if (Builder(*this, planes, most, parallel).build()) return true;
  *this = {};
  return false;
}

void ReferenceField::clear() {
  map_.clear();
  places_.clear();
  bricks_.clear();
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
