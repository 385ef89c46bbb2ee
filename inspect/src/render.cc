// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/inspect/render.h>

#include <algorithm>
#include <limits>
#include <numbers>
#include <optional>
#include <span>

#include "src/embree.h"
#include "src/light.h"
#include "src/motion_overlay.h"

namespace isoreel::inspect {
namespace {

constexpr std::uint32_t kSkyRays = 8;       // per ray of a pixel that has an edge in it
constexpr std::uint32_t kCalmSkyRays = 14;  // for a pixel without
constexpr double kSkyReach = 0.45;          // farther things do not darken, in half diagonals of the frame
constexpr double kGroundReach = 0.6;
constexpr double kDraftSky = 0.75;     // open part of the sky where nobody looked
constexpr double kOffset = 2e-4;       // how far from the surface secondary rays start
constexpr double kKeySpread = 0.045;   // of the key light's direction, for soft shadows
constexpr double kLeastFacing = 0.08;  // cosine between a normal and the direction to the viewer
constexpr double kCalm = 0.97;         // cosine between normals within a pixel that count as one
constexpr double kLineWidth = 1.1;     // pixels
constexpr double kLineStrength = 0.8;
constexpr Vec3d kLineColour{0.012, 0.014, 0.018};
constexpr double kGoldenTurn = 0.6180339887498949;

/// Where the secondary rays of one ray of a pixel go: well-mixed numbers for the pixel, and the ray's share
/// of a pattern that all rays of the pixel make up together. The same picture every time, on any thread.
class Pattern {
 public:
  Pattern(std::uint32_t x, std::uint32_t y, std::uint32_t ray, std::uint32_t rays)
      : state_(x * 0x8da6b343u ^ y * 0xd8163841u),
        ray_(ray),
        rays_(rays),
        dither_(fraction(52.9829189 * fraction(0.06711056 * x + 0.00583715 * y))),
        cosine_(std::cos(dither_ * 2 * std::numbers::pi)),
        sine_(std::sin(dither_ * 2 * std::numbers::pi)) {}

  static double fraction(double x) { return x - std::floor(x); }

  /// 0 to below 1, another one each time.
  double random() {
    state_ = state_ * 747796405u + 2891336453u;
    std::uint32_t word = ((state_ >> ((state_ >> 28) + 4)) ^ state_) * 277803737u;
    word ^= word >> 22;
    return word * 0x1p-32;
  }
  /// 0 to below 1, far from its neighbours' in the picture: what grain is left is fine and even.
  double dither() const { return dither_; }
  /// Number of this ray's point `i` of `count` in a sequence of count * rays.
  std::uint32_t index(std::uint32_t i) const { return i * rays_ + ray_; }
  std::uint32_t rays() const { return rays_; }
  /// Turn `point` of a spiral by the golden angle, as a unit vector, turned by the pixel's dither.
  std::array<double, 2> spiral(std::uint32_t point) const {
    static const std::vector<std::array<double, 2>> turns = [] {
      std::vector<std::array<double, 2>> result;
      for (std::uint32_t i = 0; i < 1024; ++i) {
        const double phi = i * kGoldenTurn * 2 * std::numbers::pi;
        result.push_back({std::cos(phi), std::sin(phi)});
      }
      return result;
    }();
    const auto& [c, s] = turns[point % turns.size()];
    return {c * cosine_ - s * sine_, s * cosine_ + c * sine_};
  }

 private:
  std::uint32_t state_, ray_, rays_;
  double dither_, cosine_, sine_;
};

/// Directions around an axis.
struct Around {
  explicit Around(const Vec3d& a)
      : axis(a),
        u(normalized(cross(std::abs(a[0]) > 0.7 ? Vec3d{0, 1, 0} : Vec3d{1, 0, 0}, a))),
        v(cross(a, u)) {}
  Vec3d operator()(double x, double y, double z) const { return u * x + v * y + axis * z; }
  Vec3d axis, u, v;
};

double toSegment(const Vec3d& p, const Vec3d& a, const Vec3d& b) {
  const Vec3d ab = b - a;
  const double whole = dot(ab, ab);
  const double t = whole > 0 ? std::clamp(dot(p - a, ab) / whole, 0.0, 1.0) : 0;
  return length(p - a - ab * t);
}

struct Hit {
  std::uint32_t triangle;
  double u, v, distance;
  Vec3d facet;  // the triangle's unit normal, pointing outside
};

struct Context {
  RTCIntersectContext embree;  // first: Embree hands its address to the filter
  float distance = std::numeric_limits<float>::infinity();
  unsigned triangle = RTC_INVALID_GEOMETRY_ID;
};

// Of triangles hit at the same distance the first counts, in whatever order Embree finds them.
void keepFirst(const RTCFilterFunctionNArguments* arguments) {
  auto& context = *reinterpret_cast<Context*>(arguments->context);
  const auto& ray = *reinterpret_cast<const RTCRay*>(arguments->ray);
  const auto& hit = *reinterpret_cast<const RTCHit*>(arguments->hit);
  if (ray.tfar == context.distance && hit.primID > context.triangle) {
    arguments->valid[0] = 0;
    return;
  }
  context.distance = ray.tfar;
  context.triangle = hit.primID;
}

/// What is drawn, whatever it came from.
struct Shape {
  std::vector<std::array<float, 3>> points;  // of the stage
  std::span<const Triangle> triangles;
  std::span<const Quad> quads;  // whose edges are the lines, two triangles each; none: those of triangles are
  std::vector<std::array<float, 3>> normals;  // of points; none when facets are to show
};

class Renderer {
 public:
  Renderer(const Shape& shape, const RenderSettings& settings, const View& view)
      : shape_(shape),
        settings_(settings),
        view_(view),
        lights_(view),
        around_key_(lights_.key()),
        side_(static_cast<std::uint32_t>(
            std::clamp(std::lround(std::sqrt(std::max(settings.samples, 1))), 1l, 8l))),
        scene_(shape.points, shape.triangles, nullptr, keepFirst) {
    if (settings.attribute.values.size() != shape.points.size()) return;
    for (const float value : settings.attribute.values) {
      Vec3d colour;
      const auto encoded = colourOf(settings.attribute.scale, static_cast<double>(value));
      for (std::size_t i = 0; i < 3; ++i) colour[i] = decodeSrgb(encoded[i]);
      colours_.push_back(colour);
    }
  }

  bool sees(const Vec3d& place, double slack) const {
    const Vec3d way = view_.eye() - place;
    const double distance = length(way);
    return distance <= slack ||
           !blocked(place + way * (slack / distance), way * (1 / distance), distance - slack);
  }

  void row(std::size_t y, Image& image) const {
    std::uint8_t* out = &image.pixels[y * static_cast<std::size_t>(image.width) * 4];
    for (std::uint32_t x = 0; x < static_cast<std::uint32_t>(image.width); ++x) {
      const Vec3d colour = pixel(x, static_cast<std::uint32_t>(y), 1.0 / image.height);
      for (std::size_t i = 0; i < 3; ++i) *out++ = encodeSrgb(colour[i]);
      *out++ = 255;
    }
  }

 private:
  struct Sample {
    double x, y;
    Vec3d direction;
    std::optional<Hit> hit;
    Vec3d normal;  // on the viewer's side
  };

  // Every pixel looks where its rays arrive; only one that has an edge in it is lit more than once.
  Vec3d pixel(std::uint32_t x, std::uint32_t y, double row_height) const {
    std::array<Sample, 64> samples;
    const std::uint32_t count = side_ * side_;
    bool calm = true;
    for (std::uint32_t s = 0; s < count; ++s) {
      Sample& sample = samples[s];
      const std::uint32_t column = s % side_, row = s / side_;
      sample.x = x + (column + 0.5) / side_;
      sample.y = y + (row + 0.5) / side_;
      sample.direction = view_.ray(sample.x, sample.y);
      sample.hit = firstHit(view_.eye(), sample.direction);
      if (sample.hit) sample.normal = normalAt(*sample.hit, sample.direction);
      calm = calm && alike(samples[0], sample);
    }
    if (calm) {
      // Which of the rays stands for all changes from pixel to pixel, or edges would shift to one side.
      const Pattern pattern(x, y, 0, 1);
      return tone(colour(samples[static_cast<std::uint32_t>(pattern.dither() * count)], row_height,
                         kCalmSkyRays, pattern));
    }
    Vec3d sum{0, 0, 0};
    for (std::uint32_t s = 0; s < count; ++s)
      sum = sum + tone(colour(samples[s], row_height, kSkyRays, Pattern(x, y, s, count)));
    return sum * (1.0 / count);
  }

  static bool alike(const Sample& a, const Sample& b) {
    if (!a.hit || !b.hit) return a.hit.has_value() == b.hit.has_value();
    const Vec3d apart = b.direction * b.hit->distance - a.direction * a.hit->distance;
    return dot(a.normal, b.normal) > kCalm &&
           dot(a.hit->facet, a.direction) * dot(b.hit->facet, b.direction) > 0 &&
           std::abs(dot(apart, a.normal)) < 0.003 * a.hit->distance;
  }

  static RTCRay rayOf(const Vec3d& from, const Vec3d& direction, double reach) {
    const auto o = toFloat(from), d = toFloat(direction);
    return {o[0], o[1], o[2], 0.f, d[0], d[1], d[2], 0.f, static_cast<float>(reach), ~0u, 0u, 0u};
  }

  std::optional<Hit> firstHit(const Vec3d& from, const Vec3d& direction) const {
    Context context;
    rtcInitIntersectContext(&context.embree);
    RTCRayHit query{};
    query.ray = rayOf(from, direction, std::numeric_limits<double>::infinity());
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene_.get(), &context.embree, &query);
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
    const Vec3d facet = toDouble({query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z});
    return Hit{query.hit.primID, static_cast<double>(query.hit.u), static_cast<double>(query.hit.v),
               static_cast<double>(query.ray.tfar), normalized(facet)};
  }

  bool blocked(const Vec3d& from, const Vec3d& direction, double reach) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRay ray = rayOf(from, direction, reach);
    rtcOccluded1(scene_.get(), &context, &ray);
    return ray.tfar < 0;  // Embree's way to say so
  }

  // The open part of the hemisphere around `normal`: cosine-distributed rays on a spiral, turned for each
  // place. What blocks from afar counts less.
  double openSky(const Vec3d& from, const Vec3d& normal, double reach, std::uint32_t rays,
                 Pattern& pattern) const {
    const Around around(normal);
    const double shift = pattern.random(), scale = pattern.random();
    std::uint32_t open = 0;
    for (std::uint32_t i = 0; i < rays; ++i) {
      const std::uint32_t point = pattern.index(i);
      const double squared = (point + shift) / (rays * pattern.rays());
      const double r = std::sqrt(squared);
      const auto [c, s] = pattern.spiral(point);
      const double far = Pattern::fraction(scale + point * 0.7548776662466927);
      open += !blocked(from, around(r * c, r * s, std::sqrt(std::max(0.0, 1 - squared))),
                       reach * (0.15 + 0.85 * far));
    }
    return static_cast<double>(open) / rays;
  }

  Vec3d colour(const Sample& sample, double row_height, std::uint32_t rays, Pattern pattern) const {
    return sample.hit
               ? surfaceColour(sample, rays, pattern)
               : groundColour(sample.direction, 1 - (std::floor(sample.y) + 0.5) * row_height, rays, pattern);
  }

  Vec3d normalAt(const Hit& hit, const Vec3d& direction) const {
    const double side = dot(hit.facet, direction) > 0 ? -1 : 1;
    Vec3d normal = hit.facet;
    if (!shape_.normals.empty()) {
      normal = normalized(between(hit, [this](std::uint32_t i) { return toDouble(shape_.normals[i]); }));
      if (dot(normal, normal) == 0) normal = hit.facet;
    }
    normal = normal * side;
    // An interpolated normal may look away from a viewer who sees the triangle: at outlines it would draw
    // dark seams.
    const double away = kLeastFacing + dot(normal, direction);
    return away > 0 ? normalized(normal - direction * away) : normal;
  }

  /// What the triangle's corners have, where the ray hit it.
  template <class OfVertex>
  Vec3d between(const Hit& hit, OfVertex of) const {
    const Triangle& t = shape_.triangles[hit.triangle];
    return of(t[0]) * (1 - hit.u - hit.v) + of(t[1]) * hit.u + of(t[2]) * hit.v;
  }

  Vec3d surfaceColour(const Sample& sample, std::uint32_t rays, Pattern& pattern) const {
    const Hit& hit = *sample.hit;
    const bool inner = dot(hit.facet, sample.direction) > 0;
    Spot spot{sample.normal, sample.direction * -1, materialColour(inner), inner, 1, 1};
    if (!colours_.empty()) {
      // Colours lie between those of the corners: values out of range would hide where the range ends.
      spot.colour = between(hit, [this](std::uint32_t i) { return colours_[i]; });
    }
    const Vec3d from =
        view_.eye() + sample.direction * hit.distance + hit.facet * (inner ? -kOffset : kOffset);
    spot.sky = settings_.ambient ? openSky(from, spot.normal, kSkyReach, rays, pattern) : kDraftSky;
    const double r = kKeySpread * std::sqrt((pattern.index(0) + pattern.random()) / pattern.rays());
    const auto [c, s] = pattern.spiral(pattern.index(0));
    const Vec3d key = normalized(around_key_(r * c, r * s, 1));
    if (dot(spot.normal, key) > 0) spot.key = blocked(from, key, 10) ? 0 : 1;
    const Vec3d lit = lights_.shade(spot);
    return settings_.wireframe ? mix(lit, kLineColour, kLineStrength * lineAt(sample)) : lit;
  }

  /// How much of the sample's surroundings a line covers: by its distance in the picture to the edges of the
  /// quad, or of the triangle.
  double lineAt(const Sample& sample) const {
    const std::span<const std::uint32_t> ring =
        shape_.quads.empty() ? std::span(shape_.triangles[sample.hit->triangle])
                             : std::span<const std::uint32_t>(shape_.quads[sample.hit->triangle / 2]);
    const auto corner = [&](std::size_t i) {
      return view_.project(toDouble(shape_.points[ring[i % ring.size()]]));
    };
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < ring.size(); ++i)
      nearest = std::min(nearest, toSegment({sample.x, sample.y, 0}, corner(i), corner(i + 1)));
    return std::clamp(kLineWidth / 2 + 0.5 - nearest, 0.0, 1.0);
  }

  // The backdrop, darker where the surface stands over the floor of the frame.
  Vec3d groundColour(const Vec3d& direction, double height, std::uint32_t rays, Pattern& pattern) const {
    const Vec3d colour = backdrop(height);
    const double t = (view_.ground() - kOffset - view_.eye()[2]) / direction[2];
    if (!(settings_.ambient && direction[2] < 0 && t > 0)) return colour;
    const Vec3d p = view_.eye() + direction * t;
    if (length(p) > 1 + kGroundReach) return colour;  // nothing of the frame is near
    return colour * (0.4 + 0.6 * openSky(p, {0, 0, 1}, kGroundReach, 2 * rays, pattern));
  }

  const Shape& shape_;
  const RenderSettings& settings_;
  const View& view_;
  const Lights lights_;
  const Around around_key_;
  const std::uint32_t side_;  // a pixel has side_ * side_ rays
  std::vector<Vec3d> colours_;
  const TriangleScene scene_;
};

}  // namespace

void Box::add(const Vec3d& p) {
  if (empty()) {
    min = max = p;
    return;
  }
  for (std::size_t i = 0; i < 3; ++i) {
    min[i] = std::min(min[i], p[i]);
    max[i] = std::max(max[i], p[i]);
  }
}

void Box::join(const Box& other) {
  if (other.empty()) return;
  add(other.min);
  add(other.max);
}

Box boundingBox(const FrameHeader& header, const Grid& grid) {
  Box box;
  const bool known = header.box_max != std::array<std::uint32_t, 3>{};
  for (std::size_t c = 0; c < 8 && header.faces > 0; ++c) {
    Vec3d cells{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double end = known ? header.box_max[axis] / double{kCell} : grid.nodes[axis] - 1.0;
      cells[axis] = c >> axis & 1 ? end : header.box_min[axis] / double{kCell};
    }
    box.add(grid.world(cells));
  }
  return box;
}

Box boundingBox(const TriangleView& mesh) {
  Box box;
  for (const Triangle& triangle : mesh.triangles) {
    for (const std::uint32_t i : triangle) box.add(toDouble(mesh.points[i]));
  }
  return box;
}

Box boundingBox(const Surface& surface) {
  Box box;
  for (const Quad& quad : surface.quads) {
    for (const std::uint32_t i : quad) box.add(surface.world(i));
  }
  return box;
}

namespace {

template <class Mesh>
View viewOf(const Mesh& mesh, const RenderSettings& settings, const Image& image) {
  Box frame = settings.frame.empty() ? boundingBox(mesh) : settings.frame;
  if (frame.empty()) frame.add({0, 0, 0});
  return View(settings.camera, frame, image.width, image.height, settings.pixel_aspect);
}

Image blankOf(const RenderSettings& settings) {
  Image image{std::max(settings.width, 1), std::max(settings.height, 1), {}};
  image.pixels.resize(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) * 4);
  return image;
}

/// Area-weighted, as Surface::normals().
std::vector<std::array<float, 3>> normalsOf(const TriangleView& mesh) {
  std::vector<Vec3d> sums(mesh.points.size(), Vec3d{0, 0, 0});
  for (const Triangle& t : mesh.triangles) {
    const Vec3d a = toDouble(mesh.points[t[0]]);
    const Vec3d normal = cross(toDouble(mesh.points[t[1]]) - a, toDouble(mesh.points[t[2]]) - a);
    for (const std::uint32_t i : t) sums[i] = sums[i] + normal;
  }
  std::vector<std::array<float, 3>> result;
  result.reserve(sums.size());
  for (const Vec3d& sum : sums) result.push_back(toFloat(normalized(sum)));
  return result;
}

}  // namespace

Image render(const Surface& surface, const RenderSettings& settings, const ParallelFor& parallel) {
  Image image = blankOf(settings);
  const View view = viewOf(surface, settings, image);
  const std::vector<Triangle> triangles = surface.triangles();
  Shape shape{{}, triangles, surface.quads, {}};
  shape.points.reserve(surface.vertices.size());
  for (std::uint32_t i = 0; i < surface.vertices.size(); ++i)
    shape.points.push_back(toFloat(view.toStage(surface.world(i))));
  if (settings.smooth) shape.normals = surface.normals();
  const Renderer renderer(shape, settings, view);
  parallel(static_cast<std::size_t>(image.height), [&](std::size_t y) { renderer.row(y, image); });
  if (settings.motion) {
    drawMotion(
        surface, *settings.motion, view,
        [&](const Vec3d& place, double slack) { return renderer.sees(place, slack); }, image);
  }
  if (!settings.attribute.values.empty() || !settings.attribute.scale.label.empty())
    drawColourBar(settings.attribute.scale, image);
  return image;
}

Image render(const TriangleView& mesh, const RenderSettings& settings, const ParallelFor& parallel) {
  Image image = blankOf(settings);
  const View view = viewOf(mesh, settings, image);
  Shape shape{{}, mesh.triangles, {}, {}};
  shape.points.reserve(mesh.points.size());
  for (const auto& point : mesh.points) shape.points.push_back(toFloat(view.toStage(toDouble(point))));
  if (settings.smooth) shape.normals = normalsOf(mesh);
  const Renderer renderer(shape, settings, view);
  parallel(static_cast<std::size_t>(image.height), [&](std::size_t y) { renderer.row(y, image); });
  return image;
}

}  // namespace isoreel::inspect
