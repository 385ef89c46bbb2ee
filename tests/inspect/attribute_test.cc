// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <isoreel/inspect/render.h>

#include "shapes.h"

namespace isoreel::inspect {
namespace {

RenderSettings small() {
  RenderSettings settings;
  settings.width = 120;
  settings.height = 90;
  return settings;
}

int differing(const Image& a, const Image& b, int from_row, int to_row) {
  int count = 0;
  const auto row = static_cast<std::size_t>(a.width) * 4;
  for (std::size_t i = row * static_cast<std::size_t>(from_row); i < row * static_cast<std::size_t>(to_row);
       i += 4)
    count += !std::equal(&a.pixels[i], &a.pixels[i] + 4, &b.pixels[i]);
  return count;
}

TEST(Curvature, OfABallIsOneOverItsRadius) {
  Surface ball = sphereSurface({16, 16, 16}, 8);
  for (const double direction : {1.0, -1.0}) {  // a grid that mirrors has the same outside
    ball.grid.direction[0] = direction;
    const std::vector<float> curvature = meanCurvature(ball);
    ASSERT_EQ(curvature.size(), ball.vertices.size());
    // Between the poles, whose quads are degenerate.
    for (std::size_t i = curvature.size() / 4; i < curvature.size() * 3 / 4; ++i)
      ASSERT_NEAR(static_cast<double>(curvature[i]), 1.0 / 8, 0.01);
  }
  for (Quad& quad : ball.quads) std::swap(quad[1], quad[3]);
  EXPECT_LT(meanCurvature(ball)[ball.vertices.size() / 2], 0);
}

TEST(VertexDistance, IsThatToTheNearestPoint) {
  const Surface ball = sphereSurface({16, 16, 16}, 8);
  const Mesh larger = meshOf(sphereSurface({16, 16, 16}, 9));
  for (const float d : vertexDistance(meshOf(ball), larger, threadedFor(3))) ASSERT_NEAR(d, 1, 0.01);
  for (const float d : vertexDistance(meshOf(ball), Mesh())) ASSERT_EQ(d, 0);
}

TEST(ColourScale, RunsFromEndToEnd) {
  const ColourScale scale{Palette::kDiverging, -1, 1, ""};
  EXPECT_EQ(colourOf(scale, -5), colourOf(scale, -1));
  EXPECT_EQ(colourOf(scale, 5), colourOf(scale, 1));
  EXPECT_GT(colourOf(scale, -1)[2], colourOf(scale, -1)[0]);
  EXPECT_GT(colourOf(scale, 1)[0], colourOf(scale, 1)[2]);
  EXPECT_EQ(colourOf(scale, 0), (std::array<std::uint8_t, 3>{221, 221, 221}));
  EXPECT_EQ(colourOf(scale, std::nan("")), colourOf(scale, -1));
}

TEST(Render, AttributeBringsItsBar) {
  RenderSettings settings = small();
  const Image bare = render(Surface(), settings);
  settings.attribute.scale.label = "of nothing";
  const Image barred = render(Surface(), settings);
  EXPECT_EQ(differing(bare, barred, 0, 78), 0);
  EXPECT_GT(differing(bare, barred, 78, 90), 200);
}

TEST(Render, WireframeDarkensEdgesOnly) {
  const Surface ball = sphereSurface({16, 16, 16}, 15, 6);  // quads of about ten pixels
  RenderSettings settings = small();
  const Image plain = render(ball, settings);
  settings.wireframe = true;
  const Image wired = render(ball, settings);
  const int changed = differing(plain, wired, 0, 90);
  EXPECT_GT(changed, 200);
  EXPECT_LT(changed, 3000);  // of the ball's 4500
  for (std::size_t i = 0; i < plain.pixels.size(); ++i) ASSERT_LE(wired.pixels[i], plain.pixels[i] + 1);
}

}  // namespace
}  // namespace isoreel::inspect
