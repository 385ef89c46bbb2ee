// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/inspect/render.h>

#include <algorithm>
#include <limits>
#include <numbers>
#include <optional>

#include "src/embree.h"
#include "src/light.h"

namespace isoreel::inspect {
namespace {

constexpr std::uint32_t kSkyRays = 8;  // per ray of the picture
constexpr double kSkyReach = 0.45;     // farther things do not darken, in half diagonals of the frame
constexpr double kGroundReach = 0.6;
constexpr double kOffset = 2e-4;       // how far from the surface secondary rays start
constexpr double kKeySpread = 0.045;   // of the key light's direction, for soft shadows
constexpr double kLeastFacing = 0.08;  // cosine between a normal and the direction to the viewer
constexpr double kGoldenTurn = 0.6180339887498949;

/// Where the secondary rays of one ray of a pixel go: well-mixed numbers for the pixel, and the ray's share
/// of a pattern that all rays of the pixel make up together. The same picture every time, on any thread.
class Pattern {
 public:
  Pattern(std::uint32_t x, std::uint32_t y, std::uint32_t ray, std::uint32_t rays)
      : state_(x * 0x8da6b343u ^ y * 0xd8163841u),
        ray_(ray),
        rays_(rays),
        dither_(std::fmod(52.9829189 * std::fmod(0.06711056 * x + 0.00583715 * y, 1.0), 1.0)) {}

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

 private:
  std::uint32_t state_, ray_, rays_;
  double dither_;
};

Vec3d aroundAxis(const Vec3d& axis, double x, double y, double z) {
  const Vec3d side = std::abs(axis[0]) > 0.7 ? Vec3d{0, 1, 0} : Vec3d{1, 0, 0};
  const Vec3d u = normalized(cross(side, axis));
  return u * x + cross(axis, u) * y + axis * z;
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

class Renderer {
 public:
  Renderer(const Surface& surface, const RenderSettings& settings, const View& view)
      : settings_(settings),
        view_(view),
        lights_(view),
        triangles_(surface.triangles()),
        scene_(points(surface, view), triangles_, nullptr, keepFirst) {
    if (settings.smooth) normals_ = surface.normals();
  }

  void row(std::size_t y, Image& image) const {
    std::uint8_t* out = &image.pixels[y * static_cast<std::size_t>(image.width) * 4];
    const auto side = static_cast<std::uint32_t>(
        std::clamp(std::lround(std::sqrt(std::max(settings_.samples, 1))), 1l, 64l));
    for (std::uint32_t x = 0; x < static_cast<std::uint32_t>(image.width); ++x) {
      Vec3d sum{0, 0, 0};
      for (std::uint32_t s = 0; s < side * side; ++s) {
        const std::uint32_t column = s % side, line = s / side;
        const double px = x + (column + 0.5) / side;
        const double py = static_cast<double>(y) + (line + 0.5) / side;
        Pattern pattern(x, static_cast<std::uint32_t>(y), s, side * side);
        sum = sum + tone(colour(px, py, 1 - py / image.height, pattern));
      }
      for (std::size_t i = 0; i < 3; ++i) *out++ = encodeSrgb(sum[i] / (side * side));
      *out++ = 255;
    }
  }

 private:
  static std::vector<std::array<float, 3>> points(const Surface& surface, const View& view) {
    std::vector<std::array<float, 3>> result;
    result.reserve(surface.vertices.size());
    for (std::uint32_t i = 0; i < surface.vertices.size(); ++i)
      result.push_back(toFloat(view.toStage(surface.world(i))));
    return result;
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
  double openSky(const Vec3d& from, const Vec3d& normal, double reach, Pattern& pattern) const {
    const double turn = pattern.dither(), shift = pattern.random(), scale = pattern.random();
    std::uint32_t open = 0;
    for (std::uint32_t i = 0; i < kSkyRays; ++i) {
      const std::uint32_t point = pattern.index(i);
      const double r = std::sqrt((point + shift) / (kSkyRays * pattern.rays()));
      const double phi = (turn + point * kGoldenTurn) * 2 * std::numbers::pi;
      const double far = std::fmod(scale + point * 0.7548776662466927, 1.0);
      const Vec3d direction =
          aroundAxis(normal, r * std::cos(phi), r * std::sin(phi), std::sqrt(std::max(0.0, 1 - r * r)));
      open += !blocked(from, direction, reach * (0.15 + 0.85 * far));
    }
    return static_cast<double>(open) / kSkyRays;
  }

  Vec3d colour(double x, double y, double height, Pattern& pattern) const {
    const Vec3d direction = view_.ray(x, y);
    const auto hit = firstHit(view_.eye(), direction);
    return hit ? surfaceColour(*hit, direction, pattern) : groundColour(direction, height, pattern);
  }

  Vec3d surfaceColour(const Hit& hit, const Vec3d& direction, Pattern& pattern) const {
    Spot spot{hit.facet, direction * -1, dot(hit.facet, direction) > 0, 1, 1};
    const double side = spot.inner ? -1 : 1;
    const Vec3d facet = hit.facet * side;
    if (!normals_.empty()) {
      const Triangle& t = triangles_[hit.triangle];
      spot.normal = normalized(toDouble(normals_[t[0]]) * (1 - hit.u - hit.v) +
                               toDouble(normals_[t[1]]) * hit.u + toDouble(normals_[t[2]]) * hit.v);
      if (dot(spot.normal, spot.normal) == 0) spot.normal = hit.facet;
    }
    spot.normal = spot.normal * side;
    // An interpolated normal may look away from a viewer who sees the triangle: at outlines it would draw
    // dark seams.
    const double away = kLeastFacing - dot(spot.normal, spot.to_viewer);
    if (away > 0) spot.normal = normalized(spot.normal + spot.to_viewer * away);
    const Vec3d from = view_.eye() + direction * hit.distance + facet * kOffset;
    spot.sky = openSky(from, spot.normal, kSkyReach, pattern);
    const double r = kKeySpread * std::sqrt((pattern.index(0) + pattern.random()) / pattern.rays());
    const double phi = (pattern.dither() + pattern.index(0) * kGoldenTurn) * 2 * std::numbers::pi;
    const Vec3d key = normalized(aroundAxis(lights_.key(), r * std::cos(phi), r * std::sin(phi), 1));
    if (dot(spot.normal, key) > 0) spot.key = blocked(from, key, 10) ? 0 : 1;
    return lights_.shade(spot);
  }

  // The backdrop, darker where the surface stands over the floor of the frame.
  Vec3d groundColour(const Vec3d& direction, double height, Pattern& pattern) const {
    const Vec3d colour = backdrop(height);
    const double t = (view_.ground() - kOffset - view_.eye()[2]) / direction[2];
    if (!(direction[2] < 0 && t > 0)) return colour;
    const Vec3d p = view_.eye() + direction * t;
    if (length(p) > 1 + kGroundReach) return colour;  // nothing of the frame is near
    return colour * (0.4 + 0.6 * openSky(p, {0, 0, 1}, kGroundReach, pattern));
  }

  const RenderSettings& settings_;
  const View& view_;
  const Lights lights_;
  const std::vector<Triangle> triangles_;
  std::vector<std::array<float, 3>> normals_;
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

Box boundingBox(const Surface& surface) {
  Box box;
  for (const Quad& quad : surface.quads) {
    for (const std::uint32_t i : quad) box.add(surface.world(i));
  }
  return box;
}

Image render(const Surface& surface, const RenderSettings& settings, const ParallelFor& parallel) {
  Image image{std::max(settings.width, 1), std::max(settings.height, 1), {}};
  image.pixels.resize(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) * 4);
  Box frame = settings.frame.empty() ? boundingBox(surface) : settings.frame;
  if (frame.empty()) frame.add({0, 0, 0});
  const View view(settings.camera, frame, image.width, image.height);
  const Renderer renderer(surface, settings, view);
  parallel(static_cast<std::size_t>(image.height), [&](std::size_t y) { renderer.row(y, image); });
  return image;
}

}  // namespace isoreel::inspect
