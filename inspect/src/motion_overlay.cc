// SPDX-License-Identifier: BSD-3-Clause
#include "src/motion_overlay.h"

#include <algorithm>
#include <cstdio>
#include <map>
#include <numbers>
#include <optional>

#include "src/colour_bar.h"

namespace isoreel::inspect {
namespace {

constexpr double kFaint = 0.5;            // of what the surface hides
constexpr Vec3d kEdge{0.02, 0.02, 0.05};  // around arrows, so that they show on anything
constexpr int kPieces = 16;               // of an arrow, each seen or not

/// 1, 2 or 5 times a power of ten: the largest up to `value` above 0.
double roundDown(double value) {
  const double power = std::pow(10.0, std::floor(std::log10(value)));
  for (const double factor : {10.0, 5.0, 2.0})
    if (factor * power <= value * (1 + 1e-9)) return factor * power;
  return power;
}

/// Green is neither in the water nor in the colours of speeds.
void intraPaint(cairo_t* cairo, double alpha) { cairo_set_source_rgba(cairo, 0.05, 0.95, 0.45, alpha); }

ColourScale speedScale(const MotionOverlay& overlay) {
  return {Palette::kSequential, 0, overlay.fastest, "motion since the frame before, cells"};
}

struct Point {
  double x, y;
};

/// An arrow in the picture, with the parts of it that are seen.
struct Arrow {
  Point from, to;
  double depth;  // of its start, from the eye
  std::array<std::uint8_t, 3> colour;
  std::array<bool, kPieces + 1> seen;  // places evenly spaced along it
};

class Drawing {
 public:
  Drawing(const Surface& surface, const MotionOverlay& overlay, const View& view, const Sees& sees,
          Image& image)
      : surface_(surface),
        overlay_(overlay),
        view_(view),
        sees_(sees),
        image_(image),
        canvas_(image),
        cairo_(canvas_.cairo()),
        unit_(std::max(std::min(image.width, image.height) / 960.0, 0.5)),
        slack_(0.5 * length(stage({1, 1, 1}) - stage({0, 0, 0})) / std::sqrt(3.0)) {}

  void draw() {
    std::vector<Arrow> arrows;
    std::vector<bool> intra(surface_.vertices.size(), false);
    for (const MotionBlock& block : overlay_.blocks) {
      const std::size_t end = std::size_t{block.first} + block.vertices;
      if (end > surface_.vertices.size()) continue;  // of another surface
      if (!block.moves) {
        std::fill(intra.begin() + block.first, intra.begin() + static_cast<std::ptrdiff_t>(end), true);
      } else if (const std::optional<Vec3d> start = seenPlace(block)) {
        addArrow(block, *start, arrows);
      }
    }
    drawIntra(intra);
    std::sort(arrows.begin(), arrows.end(), [](const Arrow& a, const Arrow& b) { return a.depth > b.depth; });
    for (const Arrow& arrow : arrows) drawArrow(arrow);
    canvas_.copyTo(image_, 0, 0);
  }

 private:
  Vec3d stage(const Vec3d& cells) const { return view_.toStage(surface_.grid.world(cells)); }
  Vec3d cells(std::uint32_t vertex) const {
    const GridPosition& p = surface_.vertices[vertex];
    return {p[0] / double{kCell}, p[1] / double{kCell}, p[2] / double{kCell}};
  }
  Point project(const Vec3d& place) const {
    const Vec3d p = view_.project(place);
    return {p[0], p[1]};
  }

  /// The block's vertex nearest to the middle of its vertices, of those that are seen; in cells.
  std::optional<Vec3d> seenPlace(const MotionBlock& block) const {
    std::vector<std::pair<double, std::uint32_t>> order(block.vertices);
    Vec3d middle{0, 0, 0};
    for (std::uint32_t i = 0; i < block.vertices; ++i)
      middle = middle + cells(block.first + i) * (1.0 / block.vertices);
    for (std::uint32_t i = 0; i < block.vertices; ++i)
      order[i] = {length(cells(block.first + i) - middle), block.first + i};
    std::sort(order.begin(), order.end());
    for (const auto& [distance, vertex] : order)
      if (sees_(stage(cells(vertex)), slack_)) return cells(vertex);
    return std::nullopt;
  }

  void addArrow(const MotionBlock& block, const Vec3d& start, std::vector<Arrow>& arrows) const {
    Vec3d way;
    for (std::size_t k = 0; k < 3; ++k) way[k] = -overlay_.scale * block.vector[k] / kCell;
    const Vec3d from = stage(start), to = stage(start + way);
    Arrow arrow{project(from),
                project(to),
                length(from - view_.eye()),
                colourOf(speedScale(overlay_), block.speed()),
                {}};
    // Near the eye, or behind it, a place may be anywhere in the picture.
    if (std::max(std::abs(arrow.to.x), std::abs(arrow.to.y)) > 4.0 * (image_.width + image_.height)) return;
    for (int i = 0; i <= kPieces; ++i)
      arrow.seen[static_cast<std::size_t>(i)] = sees_(mix(from, to, double(i) / kPieces), slack_);
    arrows.push_back(arrow);
  }

  void line(const Arrow& arrow, double from, double to) {
    cairo_move_to(cairo_, std::lerp(arrow.from.x, arrow.to.x, from),
                  std::lerp(arrow.from.y, arrow.to.y, from));
    cairo_line_to(cairo_, std::lerp(arrow.from.x, arrow.to.x, to), std::lerp(arrow.from.y, arrow.to.y, to));
  }

  void drawArrow(const Arrow& arrow) {
    const double dx = arrow.to.x - arrow.from.x, dy = arrow.to.y - arrow.from.y;
    const double length = std::hypot(dx, dy), width = 2.6 * unit_, edge = 1.3 * unit_;
    const auto& rgb = arrow.colour;
    const auto colour = [&](bool seen) {
      cairo_set_source_rgba(cairo_, rgb[0] / 255.0, rgb[1] / 255.0, rgb[2] / 255.0, seen ? 1 : kFaint);
    };
    const auto dark = [&](bool seen) {
      cairo_set_source_rgba(cairo_, kEdge[0], kEdge[1], kEdge[2], seen ? 0.8 : 0.8 * kFaint);
    };
    if (length < 2 * width) {
      const auto dot = [&](double radius) {
        cairo_arc(cairo_, arrow.from.x, arrow.from.y, radius, 0, 2 * std::numbers::pi);
        cairo_fill(cairo_);
      };
      dark(true);
      dot(width / 2 + edge + 0.6 * unit_);
      colour(true);
      dot(width / 2 + 0.6 * unit_);
      return;
    }
    const double head = std::min(12 * unit_, 0.6 * length), shaft = 1 - 0.8 * head / length;
    // The shaft in runs that are seen and runs that are not.
    cairo_set_line_cap(cairo_, CAIRO_LINE_CAP_BUTT);
    const auto shaftLines = [&](double thick, auto paint) {
      cairo_set_line_width(cairo_, thick);
      for (int i = 0, next = 0; i < kPieces; i = next) {
        const bool seen = arrow.seen[static_cast<std::size_t>(i)];
        for (next = i + 1; next < kPieces && arrow.seen[static_cast<std::size_t>(next)] == seen;) ++next;
        line(arrow, shaft * i / kPieces, shaft * next / kPieces);
        paint(seen);
        cairo_stroke(cairo_);
      }
    };
    const auto headPath = [&] {
      const double back = 1 - head / length, half = 0.42 * head / length;
      const double x = std::lerp(arrow.from.x, arrow.to.x, back),
                   y = std::lerp(arrow.from.y, arrow.to.y, back);
      cairo_move_to(cairo_, arrow.to.x, arrow.to.y);
      cairo_line_to(cairo_, x - half * dy, y + half * dx);
      cairo_line_to(cairo_, x + half * dy, y - half * dx);
      cairo_close_path(cairo_);
    };
    const bool tip = arrow.seen[kPieces];
    shaftLines(width + 2 * edge, dark);
    headPath();
    dark(tip);
    cairo_set_line_width(cairo_, 2 * edge);
    cairo_stroke(cairo_);
    shaftLines(width, colour);
    headPath();
    colour(tip);
    cairo_fill(cairo_);
  }

  /// The visible quads of I blocks, tinted, and a line around them.
  void drawIntra(const std::vector<bool>& intra) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    for (const Quad& quad : surface_.quads) {
      if (std::count_if(quad.begin(), quad.end(), [&](std::uint32_t i) { return intra[i]; }) < 2) continue;
      std::array<Vec3d, 4> corners;
      for (std::size_t i = 0; i < 4; ++i) corners[i] = stage(cells(quad[i]));
      const Vec3d middle = (corners[0] + corners[1] + corners[2] + corners[3]) * 0.25;
      if (!sees_(middle, slack_)) continue;
      std::array<Point, 4> p;
      for (std::size_t i = 0; i < 4; ++i) p[i] = project(corners[i]);
      // All the same way round, or a winding number of nought would leave holes where quads overlap.
      const double area = (p[2].x - p[0].x) * (p[3].y - p[1].y) - (p[2].y - p[0].y) * (p[3].x - p[1].x);
      for (std::size_t i = 0; i < 4; ++i) {
        const Point& corner = p[area < 0 ? 3 - i : i];
        (i == 0 ? cairo_move_to : cairo_line_to)(cairo_, corner.x, corner.y);
        ++edges[std::minmax(quad[i], quad[(i + 1) % 4])];
      }
      cairo_close_path(cairo_);
    }
    intraPaint(cairo_, 0.3);
    cairo_fill(cairo_);
    for (const auto& [edge, count] : edges) {
      if (count > 1) continue;
      const Point a = project(stage(cells(edge.first))), b = project(stage(cells(edge.second)));
      cairo_move_to(cairo_, a.x, a.y);
      cairo_line_to(cairo_, b.x, b.y);
    }
    cairo_set_line_cap(cairo_, CAIRO_LINE_CAP_ROUND);
    cairo_set_line_width(cairo_, 2 * unit_);
    intraPaint(cairo_, 1);
    cairo_stroke(cairo_);
  }

  const Surface& surface_;
  const MotionOverlay& overlay_;
  const View& view_;
  const Sees& sees_;
  Image& image_;
  Canvas canvas_;
  cairo_t* cairo_;
  double unit_;   // a pixel of a picture of 960 lines
  double slack_;  // half a cell
};

/// The lower left corner: colours of speeds, and what the signs mean.
void drawLegend(const MotionOverlay& overlay, Image& image) {
  const int width = std::max(image.width * 2 / 5, 1), bar = std::max(image.height / 11, 1),
            height = std::min(2 * bar, image.height);
  Canvas canvas(width, height);
  canvas.paper();
  paintColourBar(canvas, speedScale(overlay), width, bar);
  cairo_t* cairo = canvas.cairo();
  char arrow[96];
  std::snprintf(arrow, sizeof arrow, "where it goes, %.3g \u00d7 as long as it moved", overlay.scale);
  const double margin = 0.14 * bar, indent = margin + 0.8 * bar, line = 0.5 * bar;
  const double size = canvas.fitFont(arrow, 0.34 * bar, width - indent - margin);
  const double first = height - 1.5 * line - margin / 2, second = first + line;  // middles of two rows
  const double patch = indent + canvas.widthOf("stands still") + 2.4 * size;
  const char* const intra = "I block: not predicted";
  const auto write = [&](double x, double middle, const char* text) {
    cairo_move_to(cairo, x, middle + 0.36 * size);
    cairo_show_text(cairo, text);
  };
  canvas.ink();
  write(indent, first, arrow);
  write(indent, second, "stands still");
  canvas.fitFont(intra, size, width - margin - patch);
  write(patch, second, intra);
  cairo_set_font_size(cairo, size);

  const double head = 0.6 * size, tip = indent - 0.5 * size;
  cairo_set_line_width(cairo, 0.15 * size);
  cairo_move_to(cairo, margin, first);
  cairo_line_to(cairo, tip - head / 2, first);
  cairo_stroke(cairo);
  cairo_move_to(cairo, tip, first);
  cairo_rel_line_to(cairo, -head, head / 2);
  cairo_rel_line_to(cairo, 0, -head);
  cairo_fill(cairo);
  cairo_arc(cairo, (margin + tip) / 2, second, 0.22 * size, 0, 2 * std::numbers::pi);
  cairo_fill(cairo);
  cairo_rectangle(cairo, patch - 1.1 * size, second - 0.36 * size, 0.72 * size, 0.72 * size);
  intraPaint(cairo, 0.3);
  cairo_fill_preserve(cairo);
  intraPaint(cairo, 1);
  cairo_stroke(cairo);
  const int gap = std::min(image.width, image.height) / 60;
  canvas.copyTo(image, std::min(gap, image.width - width),
                image.height - height - std::min(gap, image.height - height));
}

}  // namespace

void MotionRange::add(const std::vector<MotionBlock>& blocks) {
  std::vector<double> speeds;
  for (const MotionBlock& block : blocks) {
    side_ = block.side;
    if (block.moves) speeds.push_back(block.speed());
  }
  if (speeds.empty()) return;
  const auto most = speeds.begin() + static_cast<std::ptrdiff_t>((speeds.size() - 1) * 9 / 10);
  std::nth_element(speeds.begin(), most, speeds.end());
  fastest_ = std::max(fastest_, *most);
}

double MotionRange::fastest() const {
  if (fastest_ == 0) return 1;
  const double below = roundDown(fastest_);
  return below >= fastest_ * (1 - 1e-9) ? below : roundDown(2.5 * below);
}

double MotionRange::scale() const { return std::max(roundDown(1.5 * side_ / fastest()), 1.0); }

void drawMotion(const Surface& surface, const MotionOverlay& overlay, const View& view, const Sees& sees,
                Image& image) {
  if (!overlay.blocks.empty()) {
    Drawing(surface, overlay, view, sees, image).draw();
    drawLegend(overlay, image);
  }
  if (!overlay.caption.empty()) drawCaption(overlay.caption, image);
}

}  // namespace isoreel::inspect
