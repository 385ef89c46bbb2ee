// SPDX-License-Identifier: BSD-3-Clause
#include "lattice/surroundings.h"

#include <bit>
#include <utility>

#include "lattice/brick_halo.h"

namespace isoreel {
namespace {

// The nodes from -1 to 5 around a brick: a word for each z, eight bits for each y.
class Nodes {
 public:
  void clear() {
    known_.fill(0);
    inside_.fill(0);
  }
  /// The corners of the cell in a slot of a halo.
  void add(std::size_t slot, std::uint32_t corners) {
    const auto [plane, shift] = kPlaces[slot];
    const std::uint64_t low = kSpread[corners & 15], high = kSpread[corners >> 4];
    known_[plane] |= std::uint64_t{1} << shift;  // of the cell, until extend()
    inside_[plane] |= low << shift;
    inside_[plane + 1u] |= high << shift;
  }
  /// Nodes that no active cell has as a corner are as those one step nearer: no edge between them changes
  /// sign.
  void extend() {
    std::uint64_t below = 0;
    for (std::uint64_t& known : known_) {
      std::uint64_t corners = known | known << 1;
      corners |= corners << 8;
      known = corners | below;
      below = corners;
    }
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
  // By the signs of a square's corners: two bits in each of two rows.
  static constexpr std::array<std::uint16_t, 16> kSpread{0x000, 0x001, 0x002, 0x003, 0x100, 0x101,
                                                         0x102, 0x103, 0x200, 0x201, 0x202, 0x203,
                                                         0x300, 0x301, 0x302, 0x303};
  // Four nodes of four rows of each of two planes, in 32 bits.
  static std::uint64_t pack(std::uint64_t low, std::uint64_t high) {
    std::uint64_t rows = (low & 0x0F0F0F0F) | (high & 0x0F0F0F0F) << 32;
    rows = (rows | rows >> 4) & 0x00FF00FF00FF00FF;
    rows = (rows | rows >> 8) & 0x0000FFFF0000FFFF;
    return (rows | rows >> 16) & 0xFFFFFFFF;
  }

  // By slot of a halo: z + 1, and the bit of the cell's corner 0 in its plane.
  static constexpr auto kPlaces = [] {
    std::array<std::pair<std::uint8_t, std::uint8_t>, 216> places{};
    for (std::size_t slot = 0; slot < places.size(); ++slot) {
      places[slot] = {static_cast<std::uint8_t>(slot / 36),
                      static_cast<std::uint8_t>(8 * (slot / 6 % 6) + slot % 6)};
    }
    return places;
  }();

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

// Adds the cells at `steps` from a slot that come before `end`; returns how many.
template <std::size_t N>
std::uint8_t link(const BrickHalo& halo, std::size_t slot, const std::array<std::ptrdiff_t, N>& steps,
                  std::uint32_t end, std::uint32_t* to) {
  std::size_t count = 0;
  for (const std::ptrdiff_t step : steps) {
    to[count] = halo[slot + static_cast<std::size_t>(step)];
    count += to[count] < end;
  }
  return static_cast<std::uint8_t>(count);
}

}  // namespace

std::uint64_t Surroundings::bytes() const {
  std::uint64_t sum = bytesOf(across) + bytesOf(faces) + bytesOf(signs) + bricks_.bytes();
  for (const Colour& colour : colours)
    sum += bytesOf(colour.cells) + bytesOf(colour.counts) + bytesOf(colour.links);
  return sum;
}

void Surroundings::build(std::span<const Cell> cells, const CellIndex& index) {
  setSize(across, cells.size());
  setSize(faces, cells.size());
  setSize(signs, cells.size());
  for (Colour& colour : colours) {
    colour.cells.clear();
    colour.counts.clear();
  }
  std::array<std::size_t, 2> used{};
  Nodes nodes;
  BrickHalo halo;
  bricks_.build(index);
  for (std::size_t number = 0; number < index.bricks().size(); ++number) {
    const CellIndex::Brick& brick = index.bricks()[number];
    nodes.clear();
    halo.gather(index, bricks_[number]);
    halo.forEach([&](std::size_t slot, std::uint32_t place) { nodes.add(slot, cells[place].corners); });
    nodes.extend();
    for (std::size_t k = 0; k < 2; ++k) {
      if (colours[k].links.size() < used[k] + 14 * 64) colours[k].links.resize(2 * used[k] + 14 * 64);
    }
    for (std::uint32_t i = brick.first; i < brick.first + brick.count; ++i) {
      const Cell& cell = cells[i];
      const int x = cell.x & 3, y = cell.y & 3, z = cell.z & 3;
      signs[i] = nodes.around(x, y, z);
      const std::size_t slot = BrickHalo::slot(x, y, z);
      std::uint32_t present = kMixedFaces[cell.corners];
      std::uint32_t all = 0;
      for (std::size_t face = 0; face < 6; ++face) {
        const std::uint32_t other = halo[slot + static_cast<std::size_t>(kFaceSteps[face])];
        all |= across[i][face] = (present >> face & 1) != 0 ? other : i;
      }
      if (all > CellIndex::kNone / 2) {  // seldom: the grid may end there
        for (std::size_t face = 0; face < 6; ++face) {
          if (across[i][face] != CellIndex::kNone) continue;
          across[i][face] = i;
          present &= ~(1u << face);
        }
      }
      faces[i] = static_cast<std::uint8_t>(present);
      const std::size_t odd = static_cast<std::size_t>(x + y + z) & 1;
      Colour& colour = colours[odd];
      std::uint32_t* const to = colour.links.data() + used[odd];
      std::uint32_t count;
      if (odd == 0) {
        count = link(halo, slot, kEdgeSteps, i, to);
        used[odd] += count;
      } else {
        const std::uint32_t near = link(halo, slot, kFaceSteps, CellIndex::kNone, to);
        const std::uint32_t far = link(halo, slot, kCornerSteps, CellIndex::kNone, to + near);
        count = near | far << 4;
        used[odd] += near + far;
      }
      colour.cells.push_back(i);
      colour.counts.push_back(static_cast<std::uint8_t>(count));
    }
  }
}

}  // namespace isoreel
