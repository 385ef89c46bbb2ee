// SPDX-License-Identifier: BSD-3-Clause
#include "lattice/sign_block.h"

namespace isoreel {
namespace {

constexpr int kLane = SignWindow::kLane;

// Four corners of a cell in one plane, by bit x + 2y, as they lie in a window of the cell whose x is 0.
constexpr auto kCorners = [] {
  std::array<std::uint64_t, 16> windows{};
  for (std::size_t corners = 0; corners < 16; ++corners) {
    for (std::size_t corner = 0; corner < 4; ++corner) {
      if ((corners >> corner & 1) == 0) continue;
      windows[corners] |= std::uint64_t{1} << ((1 + 2 * (corner >> 1)) * kLane + 1 + 2 * (corner & 1));
    }
  }
  return windows;
}();

// The nodes of a window in `lanes` (a bit each) that have one of the bits in `nodes`.
constexpr std::uint64_t mask(std::uint32_t lanes, std::uint64_t nodes) {
  std::uint64_t result = 0;
  for (int lane = 0; lane < 5; ++lane) {
    if (lanes >> lane & 1) result |= nodes << lane * kLane;
  }
  return result;
}

}  // namespace

void SignBlock::seed(int x, int y, int z, std::uint32_t known, std::uint32_t corners) {
  SignWindow* at = windows(y, z) + kNextPlane;
  for (int half = 0; half < 2; ++half, at += 2 * kNextPlane) {
    at->add(
        {kCorners[known >> 4 * half & 15] << 2 * x, kCorners[(known & corners) >> 4 * half & 15] << 2 * x});
  }
}

void SignBlock::agree() {
  for (int z = 0; z <= 8; z += 2) {
    SignWindow* at = &windows_[static_cast<std::size_t>(4 * (z + 1))];
    for (int y = 0; y < 3; ++y) at[y + 1].add(higher(at[y]));
    for (int y = 3; y > 0; --y) at[y - 1].add(lower(at[y]));
  }
}

void SignBlock::pull(const SignBlock& other, int dx, int dy, int dz) {
  // Which of the other's nodes these are, and how far they move within their window.
  const std::uint64_t from = mask(dy < 0   ? 0b01100  // its rows 7 and 8 are rows -1 and 0 here
                                  : dy > 0 ? 0b00110  // its rows 0 and 1 are rows 8 and 9 here
                                           : 0b11111,
                                  dx < 0   ? 0x300  // the same along x
                                  : dx > 0 ? 0x006
                                           : 0x7FF);
  const int left = (dx > 0 ? 8 : 0) + (dy > 0 ? 2 * kLane : 0),
            right = (dx < 0 ? 8 : 0) + (dy < 0 ? 2 * kLane : 0);
  const int first_plane = dz < 0 ? 0 : dz > 0 ? 9 : 1, planes = dz == 0 ? 9 : 2;
  const int first = dy > 0 ? 3 : 0, rows = dy == 0 ? 4 : 1;
  SignWindow* to = &windows_[static_cast<std::size_t>(4 * first_plane + first)];
  const SignWindow* source =
      &other.windows_[static_cast<std::size_t>(4 * (first_plane - 8 * dz) + first - 3 * dy)];
  for (int plane = 0; plane < planes; ++plane, to += kNextPlane, source += kNextPlane) {
    for (int i = 0; i < rows; ++i)
      to[i].add({(source[i].known & from) << left >> right, (source[i].inside & from) << left >> right});
  }
}

}  // namespace isoreel
