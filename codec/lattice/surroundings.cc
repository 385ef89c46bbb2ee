// SPDX-License-Identifier: BSD-3-Clause
#include "lattice/surroundings.h"

#include <cstring>
#include <utility>

#include "lattice/brick_halo.h"
#include "lattice/sheets.h"

namespace isoreel {
namespace {

// Two words that go the same way: nodes that are known, and those of them inside.
using Pair = std::uint64_t __attribute__((vector_size(16)));

// By the signs of a square's corners: two bits in each of two rows.
constexpr std::array<std::uint16_t, 16> kSpread{0x000, 0x001, 0x002, 0x003, 0x100, 0x101, 0x102, 0x103,
                                                0x200, 0x201, 0x202, 0x203, 0x300, 0x301, 0x302, 0x303};

// The nodes from -1 to 5 around a brick: a word for each z, eight bits for each y.
class Nodes {
 public:
  /// From the bricks around, numbered as in CellIndex::Around.
  void gather(const Surroundings::OwnNodes* owns, const CellIndex::Around& around) {
    std::array<Pair, 7> planes{};
    gather(owns, around, planes, std::make_index_sequence<27>());
    for (std::size_t z = 0; z < 7; ++z) {
      known_[z] = planes[z][0];
      inside_[z] = planes[z][1];
    }
  }
  /// Nodes that no active cell has as a corner are as those one step nearer: no edge between them changes
  /// sign.
  void extend() {
    for (std::size_t z = 0; z < 7; ++z) {
      const std::uint64_t right = known_[z] << 1 & kRows & ~known_[z],
                          left = known_[z] >> 1 & ~known_[z] & ~right;
      inside_[z] |= (inside_[z] << 1 & right) | (inside_[z] >> 1 & left);
      known_[z] |= right | left;
      const std::uint64_t up = known_[z] << 8 & kRows & ~known_[z], down = known_[z] >> 8 & ~known_[z] & ~up;
      inside_[z] |= (inside_[z] << 8 & up) | (inside_[z] >> 8 & down);
      known_[z] |= up | down;
    }
    for (std::size_t z = 1; z < 7; ++z) inside_[z] |= inside_[z - 1] & ~known_[z] & known_[z - 1];
    // Those above that have just been made known are not told apart from unknown ones, and need not be.
    for (std::size_t z = 6; z > 0; --z) inside_[z - 1] |= inside_[z] & ~known_[z - 1] & known_[z];
  }
  /// The 4×4×4 nodes around a cell, at 0 to 3.
  std::uint64_t around(int x, int y, int z) const {
    const std::uint64_t* const planes = &inside_[static_cast<std::size_t>(z)];
    const int shift = 8 * y + x;
    return pack(planes[0] >> shift, planes[1] >> shift) | pack(planes[2] >> shift, planes[3] >> shift) << 32;
  }

 private:
  static constexpr std::uint64_t kRows = 0x007F7F7F7F7F7F7F;
  // Four nodes of four rows of each of two planes, in 32 bits.
  static std::uint64_t pack(std::uint64_t low, std::uint64_t high) {
    std::uint64_t rows = (low & 0x0F0F0F0F) | (high & 0x0F0F0F0F) << 32;
    rows = (rows | rows >> 4) & 0x00FF00FF00FF00FF;
    rows = (rows | rows >> 8) & 0x0000FFFF0000FFFF;
    return (rows | rows >> 16) & 0xFFFFFFFF;
  }

  template <std::size_t... N>
  static void gather(const Surroundings::OwnNodes* owns, const CellIndex::Around& around,
                     std::array<Pair, 7>& planes, std::index_sequence<N...>) {
    (add<static_cast<int>(N)>(owns[around[N]], planes), ...);
  }
  // What the brick at one offset has of these nodes.
  template <int N>
  static void add(const Surroundings::OwnNodes& own, std::array<Pair, 7>& planes) {
    constexpr int kX = N % 3 - 1, kY = N / 3 % 3 - 1, kZ = N / 9 - 1;
    // Of either axis: the other's last two nodes, all five, or its first two.
    constexpr std::uint64_t kColumns = kX < 0 ? 0x18 : kX > 0 ? 0x03 : 0x1F;
    constexpr std::uint64_t kRowBits = kY < 0 ? 0x0101000000 : kY > 0 ? 0x0101 : 0x0101010101;
    constexpr std::uint64_t kMask = kColumns * kRowBits;
    constexpr int kUp = 9 + 32 * kY + 4 * kX;
    constexpr int kFirst = kZ < 0 ? 3 : 0, kLast = kZ > 0 ? 1 : 4;
    for (int z = kFirst; z <= kLast; ++z) {
      Pair nodes;
      std::memcpy(&nodes, own.planes[static_cast<std::size_t>(z)].data(), sizeof nodes);
      nodes &= Pair{kMask, kMask};
      Pair& to = planes[static_cast<std::size_t>(z + 1 + 4 * kZ)];
      if constexpr (kUp >= 0) {
        to |= nodes << kUp;
      } else {
        to |= nodes >> -kUp;
      }
    }
  }

  std::array<std::uint64_t, 7> known_, inside_;
};

// The faces whose corners differ, by configuration.
constexpr auto kMixedFaces = [] {
  std::array<std::uint8_t, 256> faces{};
  for (std::uint32_t corners = 0; corners < 256; ++corners) {
    for (std::uint32_t face = 0; face < 6; ++face) {
      std::uint32_t on_face = 0;
      for (std::uint32_t j = 0; j < 8; ++j)
        on_face |= static_cast<std::uint32_t>((j >> face / 2 & 1) == face % 2) << j;
      if ((corners & on_face) != 0 && (corners & on_face) != on_face)
        faces[corners] = static_cast<std::uint8_t>(faces[corners] | 1u << face);
    }
  }
  return faces;
}();

constexpr std::ptrdiff_t stepOf(int dx, int dy, int dz) { return dx + 6 * dy + 36 * dz; }
constexpr std::array<std::ptrdiff_t, 6> kFaceSteps{-1, 1, -6, 6, -36, 36};
constexpr std::array<std::ptrdiff_t, 12> kEdgeSteps{stepOf(0, -1, -1), stepOf(-1, 0, -1), stepOf(1, 0, -1),
                                                    stepOf(0, 1, -1),  stepOf(-1, -1, 0), stepOf(1, -1, 0),
                                                    stepOf(-1, 1, 0),  stepOf(1, 1, 0),   stepOf(0, -1, 1),
                                                    stepOf(-1, 0, 1),  stepOf(1, 0, 1),   stepOf(0, 1, 1)};
constexpr std::array<std::ptrdiff_t, 8> kCornerSteps{stepOf(-1, -1, -1), stepOf(1, -1, -1), stepOf(-1, 1, -1),
                                                     stepOf(1, 1, -1),   stepOf(-1, -1, 1), stepOf(1, -1, 1),
                                                     stepOf(-1, 1, 1),   stepOf(1, 1, 1)};

// Puts the cells at `steps` from a slot that lie from `first` on, before `end`, at `to`, or in front of it
// when Step is -1; returns how many.
template <int Step, std::size_t N>
std::uint8_t putLinks(const BrickHalo& halo, std::size_t slot, const std::array<std::ptrdiff_t, N>& steps,
                      std::uint32_t first, std::uint32_t end, std::uint32_t* to) {
  std::ptrdiff_t count = 0;
  for (const std::ptrdiff_t step : steps) {
    const std::uint32_t place = halo[slot + static_cast<std::size_t>(step)];
    to[Step > 0 ? count : -1 - count] = place;
    count += place - first < end - first;
  }
  return static_cast<std::uint8_t>(count);
}

// Whether a cell's first sheet is followed by others.
bool hasSiblings(std::span<const Cell> cells, std::uint32_t first) {
  return first + 1 < cells.size() && sameCell(cells[first], cells[first + 1]);
}

Surroundings::OwnNodes ownNodesOf(std::span<const Cell> cells, const CellIndex::Brick& brick) {
  Surroundings::OwnNodes own_nodes;
  for (std::uint32_t i = 0; i < brick.count; ++i) {
    const Cell& cell = cells[brick.first + i];
    std::uint32_t corners = cell.corners;
    if (brick.repeats) {
      if (i > 0 && sameCell(cell, cells[brick.first + i - 1])) continue;
      corners = signsOf(cells, brick.first + i);
    }
    const unsigned x = cell.x & 3u, y = cell.y & 3u, z = cell.z & 3u;
    own_nodes.planes[z][1] |= std::uint64_t{kSpread[corners & 15u]} << (x + 8 * y);
    own_nodes.planes[z + 1][1] |= std::uint64_t{kSpread[corners >> 4]} << (x + 8 * y);
  }
  for (std::size_t z = 0; z < 4; ++z) {
    const std::uint64_t rows = brick.rows >> 16 * z;
    std::uint64_t corners = (rows & 0xF) | (rows & 0xF0) << 4 | (rows & 0xF00) << 8 | (rows & 0xF000) << 12;
    corners |= corners << 1;
    corners |= corners << 8;
    own_nodes.planes[z][0] |= corners;
    own_nodes.planes[z + 1][0] |= corners;
  }
  return own_nodes;
}

}  // namespace

std::uint64_t Surroundings::bytes() const {
  std::uint64_t sum = bytesOf(runs) + bytesOf(spans_) + bytesOf(faces) + bytesOf(signs) + bytesOf(own_nodes_);
  for (const Run& run : runs) {
    sum += bytesOf(run.words);
    for (const Colour& colour : run.colours) sum += bytesOf(colour.cells) + bytesOf(colour.counts);
  }
  return sum;
}

void Surroundings::build(std::span<const Cell> cells, const CellIndex& index, const Slices& slices,
                         const ParallelFor& parallel) {
  setSize(faces, cells.size());
  setSize(signs, cells.size());
  const std::size_t bricks = index.bricks().size();
  setSize(own_nodes_, bricks + 1);  // and those of an empty one
  forRuns(parallel, bricks + 1, kRun / 8, [&](std::size_t first, std::size_t end) {
    for (std::size_t number = first; number < end; ++number)
      own_nodes_[number] = ownNodesOf(cells, index.brickOrEmpty(number));
  });
  // The place of the first cell of a brick, or behind the last one's.
  const auto placeOf = [&](std::size_t number) {
    return number < bricks ? index.brickOrEmpty(number).first : static_cast<std::uint32_t>(cells.size());
  };
  const std::vector<std::uint32_t> starts =
      sliceStarts(index.bricks(), isoreel::sliceCount(cells.size(), slices));
  spans_.clear();
  slice_runs.assign(1, 0);
  for (std::size_t slice = 0; slice + 1 < starts.size(); ++slice) {
    const std::uint32_t first = placeOf(starts[slice]), end = placeOf(starts[slice + 1]);
    const std::size_t pieces = runCount(end - first, kRun), in_slice = starts[slice + 1] - starts[slice];
    for (std::size_t n = 0; n < pieces; ++n) {
      spans_.push_back({starts[slice] + runStart(n, pieces, in_slice),
                        starts[slice] + runStart(n + 1, pieces, in_slice), first, end});
    }
    slice_runs.push_back(static_cast<std::uint32_t>(spans_.size()));
  }
  runs.resize(spans_.size());
  parallel(runs.size(), [&](std::size_t n) {
    runs[n].first = placeOf(spans_[n].first_brick);
    runs[n].end = placeOf(spans_[n].end_brick);
    buildRun(cells, index, spans_[n], runs[n]);
  });
}

void Surroundings::link(std::span<const Cell> cells, const CellIndex& index, const ParallelFor& parallel) {
  parallel(runs.size(), [&](std::size_t n) { linkRun(cells, index, spans_[n], runs[n]); });
}

void Surroundings::buildRun(std::span<const Cell> cells, const CellIndex& index, const Span& where,
                            Run& run) {
  setSize(run.words, 6 * std::size_t{run.end - run.first} + kReadBehind);
  std::uint32_t* across = run.words.data();
  run.odd = 0;
  Nodes nodes;
  BrickHalo halo;
  for (std::size_t number = where.first_brick; number < where.end_brick; ++number) {
    const CellIndex::Brick& brick = index.bricks()[number];
    halo.gatherFaces(index.owns(), index.around(number));
    nodes.gather(own_nodes_.data(), index.around(number));
    nodes.extend();
    const bool repeats = index.repeatsAround(number);
    for (std::uint32_t i = brick.first; i < brick.first + brick.count; ++i, across += 6) {
      const Cell& cell = cells[i];
      const int x = cell.x & 3, y = cell.y & 3, z = cell.z & 3;
      run.odd += static_cast<std::uint32_t>(x + y + z) & 1;
      signs[i] = nodes.around(x, y, z);
      const std::size_t slot = BrickHalo::slot(x, y, z);
      std::uint32_t present = kMixedFaces[cell.corners];
      std::uint32_t all = 0;
      for (std::size_t face = 0; face < 6; ++face) {
        const std::uint32_t other = halo[slot + static_cast<std::size_t>(kFaceSteps[face])];
        all |= across[face] = (present >> face & 1) != 0 ? other : i;
      }
      if (all > CellIndex::kNone / 2) {  // seldom: the grid may end there
        for (std::size_t face = 0; face < 6; ++face) {
          if (across[face] != CellIndex::kNone) continue;
          across[face] = i;
          present &= ~(1u << face);
        }
      }
      faces[i] = static_cast<std::uint8_t>(present);
      if (!repeats) continue;
      // The nodes already are as a sheet sees them that is alone in its cell.
      if ((i > 0 && sameCell(cells[i - 1], cell)) || hasSiblings(cells, i))
        signs[i] = signsAround(signs[i], cell);
      for (std::size_t face = 0; face < 6; ++face) {
        if (across[face] != i && hasSiblings(cells, across[face]))
          across[face] = facingSheet(cells, across[face], cell);
      }
    }
  }
}

namespace {

// The links of a run while they are found: those of even cells end at `front`, those of odd ones begin at
// `back`.
struct Found {
  std::vector<std::uint32_t>& words;
  std::uint32_t *front, *back;

  explicit Found(std::vector<std::uint32_t>& in) : words(in) {
    words.resize(words.capacity());
    front = words.data();
    back = words.data() + words.size() - Surroundings::kReadBehind;
  }
  // Makes room for `more` between them. `part`: how much of all cells have their links; `most` words.
  void widen(std::size_t more, double part, std::size_t most) {
    const std::size_t in_front = static_cast<std::size_t>(front - words.data());
    const std::size_t behind = words.size() - static_cast<std::size_t>(back - words.data());
    const std::size_t used = in_front + behind;
    const auto all = static_cast<std::size_t>(static_cast<double>(used) / part);
    std::vector<std::uint32_t> wider(std::min(std::max(all + all / 16, used + used / 8) + more, most));
    std::copy_n(words.data(), in_front, wider.data());
    std::copy_n(back, behind, wider.data() + wider.size() - behind);
    words = std::move(wider);
    front = words.data() + in_front;
    back = words.data() + words.size() - behind;
  }
};

// Of cells that face cells with several sheets: which of these it is.
void faceSheets(std::span<const Cell> cells, std::uint32_t cell, std::uint32_t* links, std::uint32_t count) {
  for (std::uint32_t n = 0; n < count; ++n) {
    if (hasSiblings(cells, links[n])) links[n] = facingSheet(cells, links[n], cells[cell]);
  }
}

}  // namespace

void Surroundings::linkRun(std::span<const Cell> cells, const CellIndex& index, const Span& where, Run& run) {
  const std::size_t count = run.end - run.first;
  std::array<std::uint32_t*, 2> lists{};
  std::array<std::uint8_t*, 2> counts{};
  for (std::size_t k = 0; k < 2; ++k) {
    Colour& colour = run.colours[k];
    setSize(colour.cells, k == 0 ? count - run.odd : run.odd);
    setSize(colour.counts, colour.cells.size());
    lists[k] = colour.cells.data();
    counts[k] = colour.counts.data();
  }
  Found found(run.words);
  const std::uint32_t first = where.first, end = where.end;
  BrickHalo halo;
  std::array<std::array<std::uint32_t, 4 * 32>, 2> places;
  std::array<std::array<std::uint8_t, 4 * 32>, 2> slots;  // of the brick's vertices, by colour
  for (std::size_t number = where.first_brick; number < where.end_brick; ++number) {
    const CellIndex::Brick& brick = index.bricks()[number];
    halo.gather(index.owns(), index.around(number));
    const std::size_t room = kMostLinks * brick.count + 2;  // what does not count is written as well
    if (found.back - found.front < static_cast<std::ptrdiff_t>(room)) {
      found.widen(room, static_cast<double>(brick.first - run.first + 1) / static_cast<double>(count),
                  kMostLinks * count + kReadBehind + 2);
    }
    std::array<std::size_t, 2> here{};
    for (std::uint32_t i = brick.first; i < brick.first + brick.count; ++i) {
      const int x = cells[i].x & 3, y = cells[i].y & 3, z = cells[i].z & 3;
      const std::size_t odd = static_cast<std::size_t>(x + y + z) & 1;
      places[odd][here[odd]] = i;
      slots[odd][here[odd]++] = static_cast<std::uint8_t>(BrickHalo::slot(x, y, z));
    }
    std::uint32_t *even = found.front, *odd = found.back;
    // Each colour by itself: which a cell is of nobody guesses.
    for (std::size_t n = 0; n < here[0]; ++n) {
      counts[0][n] = putLinks<1>(halo, slots[0][n], kEdgeSteps, first, places[0][n], even);
      even += counts[0][n];
    }
    for (std::size_t n = 0; n < here[1]; ++n) {
      const std::uint32_t far = putLinks<-1>(halo, slots[1][n], kCornerSteps, first, end, odd);
      odd -= far;
      const std::uint32_t near = putLinks<-1>(halo, slots[1][n], kFaceSteps, first, end, odd);
      odd -= near;
      counts[1][n] = static_cast<std::uint8_t>(near | far << 4);
    }
    if (index.repeatsAround(number)) {
      std::uint32_t *of_even = found.front, *of_odd = found.back;
      for (std::size_t n = 0; n < here[0]; of_even += counts[0][n++])
        faceSheets(cells, places[0][n], of_even, counts[0][n]);
      for (std::size_t n = 0; n < here[1]; ++n) {
        of_odd -= linkCount(counts[1][n]);
        faceSheets(cells, places[1][n], of_odd, linkCount(counts[1][n]));
      }
    }
    found.front = even;
    found.back = odd;
    for (std::size_t k = 0; k < 2; ++k) {
      std::copy_n(places[k].data(), here[k], lists[k]);
      lists[k] += here[k];
      counts[k] += here[k];
    }
  }
}

}  // namespace isoreel
