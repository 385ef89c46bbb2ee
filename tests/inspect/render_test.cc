// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <isoreel/inspect/render.h>
#include <png.h>

#include <fstream>

#include "shapes.h"

namespace isoreel::inspect {
namespace {

RenderSettings small() {
  RenderSettings settings;
  settings.width = 120;
  settings.height = 90;
  settings.frame.add({0, 0, 0});
  settings.frame.add({32, 32, 32});
  return settings;
}

std::array<int, 3> pixel(const Image& image, int x, int y) {
  const std::size_t i =
      (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(x)) * 4;
  return {image.pixels[i], image.pixels[i + 1], image.pixels[i + 2]};
}

/// Water is much bluer than the grey backdrop, lit or not.
struct Seen {
  int left = 10'000, right = -1, top = 10'000, bottom = -1, count = 0;
};
Seen seen(const Image& image) {
  Seen s;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const auto [r, g, b] = pixel(image, x, y);
      if (b - r < 24) continue;
      s.left = std::min(s.left, x);
      s.right = std::max(s.right, x);
      s.top = std::min(s.top, y);
      s.bottom = std::max(s.bottom, y);
      ++s.count;
    }
  }
  return s;
}

std::filesystem::path scratch(const std::string& name) {
  auto folder = std::filesystem::temp_directory_path() / ("isoreel_render_test_" + name);
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  return folder;
}

TEST(Render, ShowsASphereAsADisc) {
  const RenderSettings settings = small();
  const Image image = render(sphereSurface({16, 16, 16}, 15), settings);
  ASSERT_EQ(image.pixels.size(), 120u * 90u * 4u);
  for (std::size_t i = 3; i < image.pixels.size(); i += 4) ASSERT_EQ(image.pixels[i], 255);
  const Seen s = seen(image);
  EXPECT_GT(s.count, 1200);
  EXPECT_NEAR(s.left + s.right, 119, 5);
  EXPECT_NEAR(s.right - s.left, s.bottom - s.top, 6);
  const double disc = std::numbers::pi / 4 * (s.right - s.left + 1) * (s.bottom - s.top + 1);
  EXPECT_NEAR(s.count, disc, 0.06 * disc);
  // Light from the upper left.
  const int x = (s.left + s.right) / 2, y = (s.top + s.bottom) / 2, r = (s.right - s.left) / 4;
  EXPECT_GT(pixel(image, x - r, y - r)[1], pixel(image, x + r, y + r)[1] + 15);
}

TEST(Render, OfNothingIsTheBackdrop) {
  for (const bool framed : {true, false}) {
    RenderSettings settings = small();
    if (!framed) settings.frame = Box();
    const Image image = render(Surface(), settings);
    EXPECT_EQ(seen(image).count, 0);
    for (int y = 0; y < image.height; ++y) EXPECT_EQ(pixel(image, 0, y), pixel(image, image.width - 1, y));
  }
}

TEST(Render, KeepsTheCameraForTheSameFrame) {
  const RenderSettings settings = small();
  const Seen low = seen(render(sphereSurface({16, 16, 8}, 5), settings));
  const Seen high = seen(render(sphereSurface({16, 16, 24}, 5), settings));
  EXPECT_LT(high.bottom, low.top);
  EXPECT_NEAR(high.left + high.right, low.left + low.right, 3);
  const Seen large = seen(render(sphereSurface({16, 16, 8}, 7), settings));
  EXPECT_GT(large.right - large.left, low.right - low.left + 3);
}

TEST(Render, FitsTheFrameWhereverTheCameraStands) {
  // Small spheres in all corners of the frame: none may be cut, and the picture is well filled.
  Surface corners;
  for (unsigned i = 0; i < 8; ++i) {
    const Surface one = sphereSurface({i & 1 ? 31.0 : 1, i & 2 ? 31.0 : 1, i & 4 ? 31.0 : 1}, 1, 8);
    const auto first = static_cast<std::uint32_t>(corners.vertices.size());
    corners.grid = one.grid;
    corners.vertices.insert(corners.vertices.end(), one.vertices.begin(), one.vertices.end());
    for (Quad quad : one.quads) {
      for (std::uint32_t& corner : quad) corner += first;
      corners.quads.push_back(quad);
    }
  }
  corners.grid.origin = {1e6, -1e6, 5e5};
  corners.grid.spacing = {1e-3, 1e-3, 1e-3};
  for (const double azimuth : {0.0, 35.0, 200.0}) {
    for (const double elevation : {-30.0, 0.0, 25.0, 90.0}) {
      for (const bool tall : {false, true}) {
        RenderSettings settings = small();
        settings.frame = Box();
        settings.samples = 1;
        if (tall) std::swap(settings.width, settings.height);
        settings.camera.azimuth = azimuth;
        settings.camera.elevation = elevation;
        const Seen s = seen(render(corners, settings));
        const int margin =
            std::min({s.left, s.top, settings.width - 1 - s.right, settings.height - 1 - s.bottom});
        EXPECT_GE(margin, 1) << azimuth << " " << elevation;
        EXPECT_LE(margin, 12) << azimuth << " " << elevation;
      }
    }
  }
}

TEST(Render, LooksAlongYFromAzimuthNought) {
  RenderSettings settings = small();
  settings.camera.azimuth = 0;
  const Seen left = seen(render(sphereSurface({6, 16, 16}, 4), settings));
  const Seen right = seen(render(sphereSurface({26, 16, 16}, 4), settings));
  EXPECT_LT(left.right, right.left);
  const Seen near = seen(render(sphereSurface({16, 6, 16}, 4), settings));
  const Seen far = seen(render(sphereSurface({16, 26, 16}, 4), settings));
  EXPECT_GT(near.right - near.left, far.right - far.left);
}

TEST(Render, TellsInsideFromOutside) {
  Surface inside_out = sphereSurface({16, 16, 16}, 15);
  for (Quad& quad : inside_out.quads) std::swap(quad[1], quad[3]);
  const Image image = render(inside_out, small());
  EXPECT_EQ(seen(image).count, 0);
  const auto [r, g, b] = pixel(image, 60, 45);
  EXPECT_GT(r, b + 20);
  // The viewer's side of it is lit, as that of any surface.
  EXPECT_GT(pixel(image, 45, 30)[0], r);
  EXPECT_GT(pixel(image, 75, 60)[0], 80);
}

TEST(Render, ShowsFacetsWhenAsked) {
  const Surface coarse = sphereSurface({16, 16, 16}, 15, 6);
  RenderSettings settings = small();
  const Image smooth = render(coarse, settings);
  settings.smooth = false;
  EXPECT_NE(render(coarse, settings).pixels, smooth.pixels);
}

TEST(Render, DoesNotDependOnThreads) {
  const Surface surface = sphereSurface({16, 16, 16}, 15);
  const Image serial = render(surface, small());
  EXPECT_EQ(render(surface, small(), threadedFor(2)).pixels, serial.pixels);
  EXPECT_EQ(render(surface, small(), threadedFor(5)).pixels, serial.pixels);
}

TEST(BoundingBox, HoldsWhatHasFaces) {
  EXPECT_TRUE(boundingBox(Surface()).empty());
  Surface surface = sphereSurface({16, 16, 16}, 8);
  surface.vertices.push_back({0, 0, 0});  // of no face
  const Box box = boundingBox(surface);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(box.min[i], 8, 1e-3);
    EXPECT_NEAR(box.max[i], 24, 1e-3);
  }
}

Image plain(int width, int height, std::uint8_t grey) {
  Image image{width, height, {}};
  image.pixels.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 4, grey);
  return image;
}

TEST(ContactSheet, PutsPicturesInRows) {
  const std::vector<Image> tiles{plain(60, 40, 10), plain(60, 40, 20), plain(60, 40, 30)};
  const Image bare = contactSheet(tiles, {}, 2);
  EXPECT_GT(bare.width, 120);
  EXPECT_LT(bare.width, 180);
  EXPECT_GT(bare.height, 80);
  EXPECT_EQ(pixel(bare, bare.width / 4, bare.height / 4)[0], 10);
  EXPECT_EQ(pixel(bare, bare.width * 3 / 4, bare.height / 4)[0], 20);
  EXPECT_EQ(pixel(bare, bare.width / 4, bare.height * 3 / 4)[0], 30);
  EXPECT_GT(pixel(bare, bare.width * 3 / 4, bare.height * 3 / 4)[0], 200);  // paper

  const Image captioned = contactSheet(tiles, {"first", "", "a caption too long for its small picture"}, 2);
  EXPECT_GT(captioned.height, bare.height);
  const auto ink = [&](int left, int right, int top, int bottom) {
    int count = 0;
    for (int y = top; y < bottom; ++y) {
      for (int x = left; x < right; ++x) {
        const int v = pixel(captioned, x, y)[0];
        count += v > 40 && v < 180;
      }
    }
    return count;
  };
  const int middle = captioned.width / 2, half = captioned.height / 2;
  EXPECT_GT(ink(0, middle, 0, half), 10);
  EXPECT_EQ(ink(middle, captioned.width, 0, captioned.height), 0);
  EXPECT_GT(ink(0, middle, half, captioned.height), 10);

  EXPECT_EQ(contactSheet({}, {}, 4).width, 0);
  EXPECT_EQ(contactSheet(tiles, {"\xff\xfe"}, 0).width,
            contactSheet(tiles, {}, 1).width);  // not UTF-8: left out
}

TEST(WritePng, HoldsThePixels) {
  const auto folder = scratch("pixels");
  Image image{7, 5, {}};
  for (std::size_t i = 0; i < std::size_t{7} * 5 * 4; ++i)
    image.pixels.push_back(static_cast<std::uint8_t>(i * 37));
  const auto path = folder / "picture.png";
  std::ofstream(path) << "an older file";
  const Status status = writePng(image, path);
  ASSERT_TRUE(status.ok()) << status.message();

  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  ASSERT_NE(png_image_begin_read_from_file(&png, path.c_str()), 0);
  png.format = PNG_FORMAT_RGBA;
  std::vector<std::uint8_t> pixels(PNG_IMAGE_SIZE(png));
  ASSERT_NE(png_image_finish_read(&png, nullptr, pixels.data(), 0, nullptr), 0);
  EXPECT_EQ(png.width, 7u);
  EXPECT_EQ(png.height, 5u);
  EXPECT_EQ(pixels, image.pixels);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder), {}), 1);
  std::filesystem::remove_all(folder);
}

TEST(WritePng, SaysWhatWentWrong) {
  const auto folder = scratch("errors");
  const Status missing = writePng(plain(2, 2, 0), folder / "nowhere" / "picture.png");
  EXPECT_EQ(missing.error().code, ErrorCode::kIo);
  EXPECT_NE(missing.message().find("picture.png"), std::string::npos);

  std::filesystem::create_directories(folder / "taken.png" / "inside");
  EXPECT_EQ(writePng(plain(2, 2, 0), folder / "taken.png").error().code, ErrorCode::kIo);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder), {}), 1);  // nothing left behind

  Image wrong = plain(2, 2, 0);
  wrong.width = 3;
  EXPECT_EQ(writePng(wrong, folder / "wrong.png").error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(writePng(Image(), folder / "wrong.png").error().code, ErrorCode::kInvalidArgument);
  std::filesystem::remove_all(folder);
}

TEST(Render, TrianglesLookLikeTheSurfaceTheyAreOf) {
  const Surface surface = sphereSurface({16, 16, 16}, 12);
  std::vector<std::array<float, 3>> points;
  for (std::uint32_t i = 0; i < surface.vertices.size(); ++i) {
    const Vec3d p = surface.world(i);
    points.push_back({static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])});
  }
  const std::vector<Triangle> triangles = surface.triangles();
  const Image expected = render(surface, small()), image = render(TriangleView{points, triangles}, small());
  ASSERT_EQ(image.pixels.size(), expected.pixels.size());
  int apart = 0;
  for (std::size_t i = 0; i < image.pixels.size(); ++i)
    apart += std::abs(image.pixels[i] - expected.pixels[i]) > 8;
  EXPECT_LT(apart, 100);
  EXPECT_EQ(boundingBox(TriangleView{points, triangles}).max, boundingBox(surface).max);
}

TEST(Render, WidePixelsLeaveABallRound) {
  RenderSettings settings = small();
  const Surface ball = sphereSurface({16, 16, 16}, 15);
  const Seen square = seen(render(ball, settings));
  settings.width /= 2;
  settings.pixel_aspect = 2;
  const Seen wide = seen(render(ball, settings));
  EXPECT_NEAR(2 * (wide.right - wide.left), square.right - square.left, 4);
  EXPECT_NEAR(wide.bottom - wide.top, square.bottom - square.top, 2);
}

TEST(Render, DraftsShowTheSameOutline) {
  RenderSettings settings = small();
  const Surface ball = sphereSurface({16, 16, 16}, 15);
  const Seen full = seen(render(ball, settings));
  settings.ambient = false;
  settings.samples = 1;
  EXPECT_NEAR(seen(render(ball, settings)).count, full.count, 0.05 * full.count);
}

TEST(Render, CaptionsStandInTheUpperLeftCorner) {
  const Image plain = render(Surface{}, small());
  Image captioned = plain;
  drawCaption("frame 17", captioned);
  EXPECT_NE(captioned.pixels, plain.pixels);
  EXPECT_EQ(pixel(captioned, 119, 89), pixel(plain, 119, 89));
}

}  // namespace
}  // namespace isoreel::inspect
