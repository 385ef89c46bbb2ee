// SPDX-License-Identifier: BSD-3-Clause
// The signs that are known so far on the lattice of one octree level, a block for each brick of 4×4×4 cells
// of the level above.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>

#include "lattice/bits.h"

namespace isoreel {

/// A bit for each node of five rows along x: what the new nodes of the four cells of one row can see in one
/// plane. Lane i of 12 bits is row 2y - 1 + i for the cells at y, bit x + 1 of a lane is node x.
struct SignWindow {
  static constexpr int kLane = 12;
  static constexpr std::uint64_t kAll = (std::uint64_t{1} << 5 * kLane) - 1;
  /// The lowest bit of each lane, of three lanes.
  static constexpr std::uint64_t kLanes = 1 | 1 << kLane | 1 << 2 * kLane;
  /// 3×3 nodes, the lowest at bit 0.
  static constexpr std::uint64_t kSquare = 7 * kLanes;

  std::uint64_t known = 0;
  std::uint64_t inside = 0;  // within `known`

  void add(const SignWindow& other) {
    known |= other.known;
    inside |= other.inside;
  }
};

/// The 11×11×11 nodes from -1 to 9 around a brick whose own nodes are 0 to 8: what the contexts of its new
/// nodes see. Windows overlap by three rows, so that a cell finds all it needs in five of them.
class SignBlock {
 public:
  static constexpr int kSide = 11;

  /// The five windows, 4 apart, that hold the nodes from 2y - 1 to 2y + 3 and 2z - 1 to 2z + 3 for cells at
  /// (y, z), 0 to 3.
  SignWindow* windows(int y, int z) { return &windows_[static_cast<std::size_t>(4 * 2 * z + y)]; }
  static constexpr int kNextPlane = 4;

  /// Makes corners of the cell (x, y, z), 0 to 3, known: those in `known`, inside when in `corners` (bit:
  /// number of the corner). agree() has to follow.
  void seed(int x, int y, int z, std::uint32_t known, std::uint32_t corners);
  /// Brings what seed() did to the windows that overlap.
  void agree();
  /// Brings the new nodes of a cell at (y, z) to the windows that overlap its own.
  void share(int y, int z) {
    // Without a branch: where there is no other window, nothing goes to this one.
    const int down = y > 0, up = y < 3;
    const std::uint64_t to_lower = 0 - static_cast<std::uint64_t>(down),
                        to_upper = 0 - static_cast<std::uint64_t>(up);
    SignWindow* at = windows(y, z) + kNextPlane;
    for (int plane = 0; plane < 3; ++plane, at += kNextPlane) {
      const SignWindow low = lower(*at), high = higher(*at);
      at[-down].add({low.known & to_lower, low.inside & to_lower});
      at[up].add({high.known & to_upper, high.inside & to_upper});
    }
  }
  /// The 3×3×3 nodes in three windows of successive planes, interleaved: bit (dx + 1) + 3 (dz + 1) + 12 (dy +
  /// 1). `shift` is that of the lowest in their windows.
  static SignWindow around(const SignWindow* at, int shift) {
    SignWindow result;
    for (int plane = 0; plane < 3; ++plane) {
      result.known |= (at[plane * kNextPlane].known >> shift & SignWindow::kSquare) << 3 * plane;
      result.inside |= (at[plane * kNextPlane].inside >> shift & SignWindow::kSquare) << 3 * plane;
    }
    return result;
  }
  /// How many of the 4×4×4 nodes in four windows are known, and inside.
  static std::pair<std::uint32_t, std::uint32_t> count(const SignWindow* at, int shift) {
    constexpr std::uint64_t kFour = 15 | std::uint64_t{15} << SignWindow::kLane |
                                    std::uint64_t{15} << 2 * SignWindow::kLane |
                                    std::uint64_t{15} << 3 * SignWindow::kLane;
    SignWindow three, last = at[3 * kNextPlane];
    for (int plane = 0; plane < 3; ++plane) {
      three.known |= (at[plane * kNextPlane].known >> shift & kFour) << 4 * plane;
      three.inside |= (at[plane * kNextPlane].inside >> shift & kFour) << 4 * plane;
    }
    return {countBits(three.known) + countBits(last.known >> shift & kFour),
            countBits(three.inside) + countBits(last.inside >> shift & kFour)};
  }
  /// Makes nodes of a cell at x, in its row's windows, known: those of its 27, as around() has them, that are
  /// in `nodes.known`.
  static void set(SignWindow* windows, int x, const SignWindow& nodes) {
    SignWindow* at = windows + kNextPlane;
    for (int plane = 0; plane < 3; ++plane, at += kNextPlane) {
      at->add({(nodes.known >> 3 * plane & SignWindow::kSquare) << (SignWindow::kLane + 1 + 2 * x),
               (nodes.inside >> 3 * plane & SignWindow::kSquare) << (SignWindow::kLane + 1 + 2 * x)});
    }
  }

  /// Adds what the neighbouring brick at an offset, numbered as in CellIndex::Around, knows of the nodes of
  /// this block.
  void pull(const SignBlock& other, std::uint32_t offset);

  bool isKnown(int x, int y, int z) const { return at(y, z).known >> bit(x, y) & 1; }
  bool isInside(int x, int y, int z) const { return at(y, z).inside >> bit(x, y) & 1; }

 private:
  static int row(int y) { return std::clamp(y / 2, 0, 3); }
  static int bit(int x, int y) { return (y + 1 - 2 * row(y)) * SignWindow::kLane + x + 1; }
  const SignWindow& at(int y, int z) const {
    return windows_[static_cast<std::size_t>(4 * (z + 1) + row(y))];
  }

  template <int Offset>
  static void pullFrom(SignBlock& block, const SignBlock& other);

  // The same nodes as the next window, and the one before, has them.
  static SignWindow higher(const SignWindow& w) {
    return {w.known >> 2 * SignWindow::kLane, w.inside >> 2 * SignWindow::kLane};
  }
  static SignWindow lower(const SignWindow& w) {
    return {w.known << 2 * SignWindow::kLane & SignWindow::kAll,
            w.inside << 2 * SignWindow::kLane & SignWindow::kAll};
  }

  std::array<SignWindow, std::size_t{kSide} * 4> windows_{};  // plane z + 1, then the cells' y
};

}  // namespace isoreel
