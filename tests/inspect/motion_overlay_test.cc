// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <isoreel/inspect/render.h>

#include "shapes.h"

namespace isoreel::inspect {
namespace {

constexpr int kWidth = 320, kHeight = 240;
constexpr int kSegments = 96;  // of sphereSurface

/// A ball, seen along +y: x runs to the right, z up.
Surface ball() { return sphereSurface({16, 16, 16}, 11); }

Image picture(const std::optional<MotionOverlay>& overlay) {
  RenderSettings settings;
  settings.width = kWidth;
  settings.height = kHeight;
  settings.samples = 1;
  settings.camera.azimuth = settings.camera.elevation = 0;
  settings.frame.add({0, 0, 0});
  settings.frame.add({32, 32, 32});
  settings.motion = overlay;
  return render(ball(), settings);
}

using Rgb = std::array<int, 3>;
Rgb pixel(const Image& image, int x, int y) {
  const auto i = static_cast<std::size_t>(4 * (y * image.width + x));
  return {image.pixels[i], image.pixels[i + 1], image.pixels[i + 2]};
}

/// Where two pictures differ, outside the corners that legend and caption take.
struct Changed {
  int left = kWidth, right = -1, top = kHeight, bottom = -1, count = 0;
};
Changed changed(const Image& a, const Image& b) {
  Changed c;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const bool legend = x < kWidth * 2 / 5 + 6 && y > kHeight * 3 / 4, caption = y < kHeight / 14;
      if (legend || caption || pixel(a, x, y) == pixel(b, x, y)) continue;
      c.left = std::min(c.left, x);
      c.right = std::max(c.right, x);
      c.top = std::min(c.top, y);
      c.bottom = std::max(c.bottom, y);
      ++c.count;
    }
  }
  return c;
}

/// A block of one vertex, that nearest to `place`, which goes `way` cells from frame to frame.
MotionBlock blockAt(const Point& place, const Point& way) {
  const Surface surface = ball();
  MotionBlock block;
  double best = 1e9;
  for (std::uint32_t i = 0; i < surface.vertices.size(); ++i) {
    const Vec3d p = surface.world(i);
    const double away = std::hypot(p[0] - place[0], p[1] - place[1], p[2] - place[2]);
    if (away < best) block.first = i;
    best = std::min(best, away);
  }
  block.side = 8;
  block.vertices = block.predicted = 1;
  block.moves = true;
  for (std::size_t k = 0; k < 3; ++k) block.vector[k] = static_cast<std::int32_t>(-way[k] * kCell);
  return block;
}

const Point kFront{16, 5, 16};
constexpr int kMiddleX = kWidth / 2, kMiddleY = kHeight / 2;

TEST(MotionOverlay, ArrowsPointWhereTheSurfaceGoes) {
  const Image plain = picture(std::nullopt);
  // From the middle of the picture to the right, left, up and down.
  for (const Point& way : {Point{3, 0, 0}, Point{-3, 0, 0}, Point{0, 0, 3}, Point{0, 0, -3}}) {
    std::array<int, 2> lengths{};
    for (const int scale : {1, 2}) {
      const Image image = picture(MotionOverlay{{blockAt(kFront, way)}, double(scale), 6, ""});
      const Changed c = changed(image, plain);
      const int ahead = way[0] > 0   ? c.right - kMiddleX
                        : way[0] < 0 ? kMiddleX - c.left
                        : way[2] > 0 ? kMiddleY - c.top
                                     : c.bottom - kMiddleY;
      const int behind = way[0] > 0   ? kMiddleX - c.left
                         : way[0] < 0 ? c.right - kMiddleX
                         : way[2] > 0 ? c.bottom - kMiddleY
                                      : kMiddleY - c.top;
      const int across = way[0] != 0 ? c.bottom - c.top : c.right - c.left;
      lengths[static_cast<std::size_t>(scale) - 1] = ahead;
      EXPECT_LE(behind, 2) << scale;
      EXPECT_LE(across, 12) << scale;
      // Its colour tells the speed, whatever the scale.
      const auto wanted = colourOf({Palette::kSequential, 0, 6, ""}, 3);
      int nearest = 255;
      for (int y = c.top; y <= c.bottom; ++y) {
        for (int x = c.left; x <= c.right; ++x) {
          int away = 0;
          for (std::size_t k = 0; k < 3; ++k)
            away = std::max(away, std::abs(pixel(image, x, y)[k] - wanted[k]));
          nearest = std::min(nearest, away);
        }
      }
      EXPECT_LE(nearest, 25) << scale;
    }
    // The ball's 22 cells are 150 pixels or so.
    EXPECT_NEAR(lengths[0], 3 * 7, 5);
    EXPECT_NEAR(lengths[1], 2 * lengths[0], 3);
  }
}

TEST(MotionOverlay, HiddenArrowsAreLeftOutAndHiddenPartsFainter) {
  const Image plain = picture(std::nullopt);
  EXPECT_EQ(changed(picture(MotionOverlay{{blockAt({16, 27, 16}, {3, 0, 0})}, 1, 6, ""}), plain).count, 0);
  // Of a block whose vertices are all around, the one in front stands for it.
  MotionBlock all = blockAt(kFront, {3, 0, 0});
  all.first = 0;
  all.vertices = static_cast<std::uint32_t>(ball().vertices.size());
  EXPECT_GT(changed(picture(MotionOverlay{{all}, 1, 6, ""}), plain).count, 50);

  const auto strength = [&](const Point& way) {
    const Image image = picture(MotionOverlay{{blockAt(kFront, way)}, 1, 100, ""});  // the darkest colour
    const Changed c = changed(image, plain);
    int sum = 0;
    for (int x = (c.left + c.right) / 2 - 2; x <= (c.left + c.right) / 2 + 2; ++x)
      for (std::size_t k = 0; k < 3; ++k) sum += pixel(plain, x, kMiddleY)[k] - pixel(image, x, kMiddleY)[k];
    return sum;
  };
  const int seen = strength({6, 0, 0}), inside = strength({6, 9, 0});
  EXPECT_GT(inside, seen / 8);
  EXPECT_LT(inside, seen * 3 / 4);
}

TEST(MotionOverlay, WhatStandsStillIsADot) {
  const Changed c =
      changed(picture(MotionOverlay{{blockAt(kFront, {0, 0, 0})}, 1, 6, ""}), picture(std::nullopt));
  EXPECT_GT(c.count, 4);
  EXPECT_NEAR(c.left + c.right, 2 * kMiddleX, 3);
  EXPECT_NEAR(c.top + c.bottom, 2 * kMiddleY, 3);
  EXPECT_LE(c.right - c.left, 7);
}

TEST(MotionOverlay, OutlinesIntraBlocks) {
  // A band around the ball's equator, from ring 20 to 28 of 48.
  MotionBlock block;
  block.side = 8;
  block.first = 20 * kSegments;
  block.vertices = 9 * kSegments;
  const Image plain = picture(std::nullopt), image = picture(MotionOverlay{{block}, 1, 6, ""});
  const Changed c = changed(image, plain);
  EXPECT_NEAR(c.top + c.bottom, 2 * kMiddleY, 4);
  EXPECT_GT(c.right - c.left, 120);
  EXPECT_NEAR(c.bottom - c.top, 150 * std::sin(std::numbers::pi * 5 / 48), 8);
  // The tint is greener than the ball, and the outline is greener than the tint.
  const auto green = [](const Rgb& colour) { return colour[1] - std::max(colour[0], colour[2]); };
  const int tint = green(pixel(image, kMiddleX, kMiddleY));
  EXPECT_GT(tint, green(pixel(plain, kMiddleX, kMiddleY)) + 20);
  int outline = -255;
  for (int y = c.top; y < c.top + 5; ++y) outline = std::max(outline, green(pixel(image, kMiddleX, y)));
  EXPECT_GT(outline, tint + 20);
}

TEST(MotionOverlay, AnIntraFrameHasTheCaptionAlone) {
  const Image plain = picture(std::nullopt);
  EXPECT_EQ(picture(MotionOverlay{{}, 1, 6, ""}).pixels, plain.pixels);
  const Image captioned = picture(MotionOverlay{{}, 1, 6, "frame 0   I"});
  EXPECT_NE(captioned.pixels, plain.pixels);
  for (int y = kHeight / 10; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) ASSERT_EQ(pixel(captioned, x, y), pixel(plain, x, y));
}

TEST(MotionOverlay, LeavesOutBlocksOfAnotherSurface) {
  MotionBlock block = blockAt(kFront, {3, 0, 0});
  block.first = 0xFFFFFFFF;
  MotionBlock intra = block;
  intra.moves = false;
  const Image image = picture(MotionOverlay{{block, intra}, 1, 6, ""});
  EXPECT_EQ(changed(image, picture(std::nullopt)).count, 0);
}

TEST(MotionRange, IsRoundAndFitsMostArrows) {
  MotionRange range;
  EXPECT_EQ(range.fastest(), 1);
  range.add({});
  EXPECT_GE(range.scale(), 1);
  std::vector<MotionBlock> blocks;
  for (int i = 1; i <= 10; ++i) blocks.push_back(blockAt(kFront, {0.03 * i, 0, 0}));
  blocks.back().vector[0] = 40 * kCell;  // the odd one out
  range.add(blocks);
  EXPECT_NEAR(range.fastest(), 0.5, 1e-12);  // 0.27 rounded up
  EXPECT_NEAR(range.scale(), 20, 1e-12);     // 12 cells / 0.5
  blocks.assign(3, blockAt(kFront, {0, 0, 20}));
  range.add(blocks);
  EXPECT_NEAR(range.fastest(), 20, 1e-12);
  EXPECT_EQ(range.scale(), 1);
  blocks.assign(3, blockAt(kFront, {0, 0, 0}));
  range.add(blocks);
  EXPECT_NEAR(range.fastest(), 20, 1e-12);
}

}  // namespace
}  // namespace isoreel::inspect
