// SPDX-License-Identifier: BSD-3-Clause
#include "src/light.h"

#include <algorithm>

namespace isoreel::inspect {
namespace {

constexpr Vec3d kWater{0.030, 0.185, 0.335};
constexpr Vec3d kInner{0.50, 0.24, 0.13};
constexpr Vec3d kKeyColour{2.15, 2.0, 1.80};
constexpr Vec3d kFillColour{0.40, 0.46, 0.58};
constexpr Vec3d kRimColour{0.60, 0.70, 0.85};
constexpr Vec3d kZenith{0.62, 0.72, 0.86};
constexpr Vec3d kHorizon{0.80, 0.80, 0.80};
constexpr Vec3d kFloor{0.20, 0.19, 0.18};
constexpr double kMirror = 0.03;  // reflected when looking straight on, as by water

double smooth(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

Vec3d reflect(const Vec3d& to_viewer, const Vec3d& normal) {
  return normal * (2 * dot(normal, to_viewer)) - to_viewer;
}

// Light that arrives from far away, for reflections.
Vec3d environment(const Vec3d& direction) {
  const Vec3d above = mix(kHorizon, kZenith, smooth(0.0, 0.9, direction[2]));
  return mix(kFloor, above, smooth(-0.25, 0.1, direction[2]));
}

}  // namespace

Vec3d materialColour(bool inner) { return inner ? kInner : kWater; }

Lights::Lights(const View& view)
    : key_(normalized(view.right() * -0.72 + view.ahead() * -0.28 + Vec3d{0, 0, 0.60})),
      fill_(normalized(view.right() * 0.85 + view.ahead() * -0.5 + Vec3d{0, 0, 0.3})),
      rim_(normalized(view.right() * 0.3 + view.ahead() * 0.9 + Vec3d{0, 0, 0.45})) {}

Vec3d Lights::shade(const Spot& spot) const {
  const Vec3d& n = spot.normal;
  const auto facing = [&](const Vec3d& light) { return std::max(0.0, dot(n, light)); };
  const auto glint = [&](const Vec3d& light, double sharpness) {
    return std::pow(std::max(0.0, dot(n, normalized(light + spot.to_viewer))), sharpness);
  };

  const Vec3d sky = mix(kFloor, mix(kHorizon, kZenith, 0.6), 0.5 + 0.5 * n[2]) * spot.sky;
  const Vec3d diffuse =
      kKeyColour * (facing(key_) * spot.key) + kFillColour * (facing(fill_) * spot.sky) + sky * 0.75;
  Vec3d light = spot.colour * diffuse;

  // Steeper than water's own curve would be, which shows ripples sooner.
  const double grazing = std::pow(1 - std::clamp(dot(n, spot.to_viewer), 0.0, 1.0), 3.5);
  const double fresnel = (kMirror + (1 - kMirror) * 0.75 * grazing) * (spot.inner ? 0.4 : 1.0);
  light = light * (1 - fresnel) + environment(reflect(spot.to_viewer, n)) * (fresnel * spot.sky);
  const double gloss = spot.inner ? 0.25 : 1.0;
  light = light + kKeyColour * (gloss * spot.key * (0.32 * glint(key_, 180) + 0.05 * glint(key_, 18)) *
                                (facing(key_) > 0));
  light = light + kRimColour * (gloss * spot.sky * 0.22 * glint(rim_, 30) * (facing(rim_) > 0));
  return light;
}

Vec3d backdrop(double height) {
  return mix({0.50, 0.51, 0.53}, {0.86, 0.87, 0.89}, smooth(0.0, 1.0, height));
}

Vec3d tone(const Vec3d& colour) {
  // Straight up to 0.7, then a shoulder that reaches 1 only in the limit.
  constexpr double kKnee = 0.7;
  Vec3d result;
  for (std::size_t i = 0; i < 3; ++i) {
    const double over = colour[i] - kKnee;
    result[i] =
        over <= 0 ? std::max(0.0, colour[i]) : kKnee + (1 - kKnee) * (1 - std::exp(-over / (1 - kKnee)));
  }
  return result;
}

std::uint8_t encodeSrgb(double linear) {
  const double c = std::clamp(linear, 0.0, 1.0);
  const double encoded = c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1 / 2.4) - 0.055;
  return static_cast<std::uint8_t>(std::lround(encoded * 255));
}

double decodeSrgb(std::uint8_t encoded) {
  const double c = encoded / 255.0;
  return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
}

}  // namespace isoreel::inspect
