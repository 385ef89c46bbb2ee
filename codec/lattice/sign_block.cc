// SPDX-License-Identifier: BSD-3-Clause
#include "lattice/sign_block.h"

#include <utility>

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

template <int Offset>
void SignBlock::pullFrom(SignBlock& block, const SignBlock& other) {
  constexpr int kX = Offset % 3 - 1, kY = Offset / 3 % 3 - 1, kZ = Offset / 9 - 1;
  // Which of the other's nodes these are, and how far they move within their window.
  constexpr std::uint64_t kFrom = mask(kY < 0   ? 0b01100  // its rows 7 and 8 are rows -1 and 0 here
                                       : kY > 0 ? 0b00110  // its rows 0 and 1 are rows 8 and 9 here
                                                : 0b11111,
                                       kX < 0   ? 0x300  // the same along x
                                       : kX > 0 ? 0x006
                                                : 0x7FF);
  constexpr int kLeft = (kX > 0 ? 8 : 0) + (kY > 0 ? 2 * kLane : 0),
                kRight = (kX < 0 ? 8 : 0) + (kY < 0 ? 2 * kLane : 0);
  constexpr int kFirstPlane = kZ < 0 ? 0 : kZ > 0 ? 9 : 1, kPlanes = kZ == 0 ? 9 : 2;
  constexpr int kFirst = kY > 0 ? 3 : 0, kRows = kY == 0 ? 4 : 1;
  SignWindow* to = &block.windows_[static_cast<std::size_t>(4 * kFirstPlane + kFirst)];
  const SignWindow* source =
      &other.windows_[static_cast<std::size_t>(4 * (kFirstPlane - 8 * kZ) + kFirst - 3 * kY)];
  for (int plane = 0; plane < kPlanes; ++plane, to += kNextPlane, source += kNextPlane) {
    for (int i = 0; i < kRows; ++i) {
      to[i].add(
          {(source[i].known & kFrom) << kLeft >> kRight, (source[i].inside & kFrom) << kLeft >> kRight});
    }
  }
}

void SignBlock::pull(const SignBlock& other, std::uint32_t offset) {
  // A function for each offset: loops without ends to guess.
  static constexpr auto kPulls = []<int... O>(std::integer_sequence<int, O...>) {
    return std::array<void (*)(SignBlock&, const SignBlock&), 27>{&pullFrom<O>...};
  }
  (std::make_integer_sequence<int, 27>());
  kPulls[offset](*this, other);
}

}  // namespace isoreel
