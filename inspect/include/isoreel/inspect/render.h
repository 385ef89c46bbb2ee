// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/base/packet.h>
#include <isoreel/base/parallel.h>
#include <isoreel/codec/surface.h>
#include <isoreel/inspect/attribute.h>
#include <isoreel/inspect/motion_overlay.h>

#include <filesystem>
#include <optional>
#include <span>

namespace isoreel::inspect {

/// Eight bits a channel, RGBA, rows from the top.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> pixels;
};

/// An axis-aligned box in the world; empty when min > max.
struct Box {
  Vec3d min{1, 1, 1};
  Vec3d max{-1, -1, -1};
  bool empty() const { return min[0] > max[0]; }
  void add(const Vec3d& p);
  void join(const Box& other);
};
Box boundingBox(const Surface& surface);
/// As the header tells, without decoding: of the box that is aligned with the grid, or where the header does
/// not tell one, as in other containers, of the grid. Empty without faces.
Box boundingBox(const FrameHeader& header, const Grid& grid);

/// Triangles in the world, the caller's: corners run counter-clockwise seen from outside, each below
/// points.size(); what they are is not checked here.
struct TriangleView {
  std::span<const std::array<float, 3>> points;
  std::span<const Triangle> triangles;
};
Box boundingBox(const TriangleView& mesh);

/// Where the picture is taken from. Angles in degrees: azimuth around the world's z axis (0 looks along +y),
/// elevation above its horizon, -90 to 90. The camera looks at the box's centre from where the whole box
/// fits, and the box stands in the middle of the picture. The field of view is that of the picture's shorter
/// side; `zoom` magnifies.
struct Camera {
  double azimuth = 35;
  double elevation = 25;
  double field_of_view = 35;
  double zoom = 1;
  /// Fits the box turned around its vertical axis, whatever the azimuth: an orbit then neither grows nor
  /// shrinks what it shows.
  bool turning = false;
};

struct RenderSettings {
  int width = 1280;
  int height = 960;
  double pixel_aspect = 1;  // width of a pixel by its height, above 0
  Camera camera;
  Box frame;        // what must fit into the picture; empty: the surface's own box
  int samples = 4;  // rays a pixel, a square number
  bool ambient =
      true;            // light from all of the sky and what keeps it away: most of the time; false for drafts
  bool smooth = true;  // interpolated vertex normals; false shows facets
  bool wireframe = false;  // the quads' edges, as lines of about a pixel
  Attribute attribute;     // colours the surface and adds a colour bar, when it has a value for each vertex
  std::optional<MotionOverlay> motion;  // arrows and a legend, over the picture of the blocks' own surface
};

/// Ray-casts the surface: three lights and ambient occlusion, so that shape shows; the inner side has another
/// colour, and a shadow lies below the frame's box. A surface without faces gives the backdrop alone. Opaque,
/// in sRGB, at least 1 × 1 pixels. The same on one machine for every `parallel`.
Image render(const Surface& surface, const RenderSettings& settings, const ParallelFor& parallel = serialFor);
/// The same of triangles: lines are theirs, and there are no colours or motion to show.
Image render(const TriangleView& mesh, const RenderSettings& settings,
             const ParallelFor& parallel = serialFor);

/// Writes a line of text into the upper left corner, sized by the picture. Text that is not UTF-8 leaves the
/// picture as it is.
void drawCaption(const std::string& caption, Image& image);

/// Draws the scale's bar with its range and label into the lower right corner, sized by the picture.
void drawColourBar(const ColourScale& scale, Image& image);

/// Puts pictures of equal size side by side, `columns` a row, each with a caption under it (captions may be
/// empty, and there may be fewer than pictures). No pictures give an image without pixels.
Image contactSheet(const std::vector<Image>& images, const std::vector<std::string>& captions, int columns);

/// Writes a PNG under a temporary name in the same folder (".part" added) and renames it over `path`. kIo if
/// that fails, and then nothing is left behind; kInvalidArgument for an image whose pixels do not match its
/// size.
Status writePng(const Image& image, const std::filesystem::path& path);

}  // namespace isoreel::inspect
