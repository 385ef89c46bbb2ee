// SPDX-License-Identifier: BSD-3-Clause
#include "src/colour_bar.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace isoreel::inspect {
namespace {

using Rgb = std::array<std::uint8_t, 3>;
// Evenly spaced in lightness: matplotlib's inferno without its black end, and Moreland's cool to
// warm.
constexpr std::array<Rgb, 7> kSequential{{{40, 11, 84},
                                          {101, 21, 110},
                                          {159, 42, 99},
                                          {212, 72, 66},
                                          {245, 125, 21},
                                          {250, 193, 39},
                                          {252, 255, 164}}};
constexpr std::array<Rgb, 7> kDiverging{{{59, 76, 192},
                                         {112, 148, 243},
                                         {170, 199, 253},
                                         {221, 221, 221},
                                         {247, 184, 156},
                                         {231, 116, 91},
                                         {180, 4, 38}}};

}  // namespace

std::array<std::uint8_t, 3> colourOf(const ColourScale& scale, double value) {
  const auto& colours = scale.palette == Palette::kDiverging ? kDiverging : kSequential;
  const double span = scale.high - scale.low;
  const double share = span > 0 && value > scale.low ? std::min((value - scale.low) / span, 1.0) : 0.0;
  const double place = share * static_cast<double>(colours.size() - 1);
  const std::size_t i = std::min(static_cast<std::size_t>(place), colours.size() - 2);
  const double t = place - static_cast<double>(i);
  Rgb result;
  for (std::size_t c = 0; c < 3; ++c)
    result[c] = static_cast<std::uint8_t>(std::lround(colours[i][c] * (1 - t) + colours[i + 1][c] * t));
  return result;
}

void paintColourBar(Canvas& canvas, const ColourScale& scale, double width, double height) {
  cairo_t* cairo = canvas.cairo();
  const double margin = 0.14 * height, bar = 0.3 * height;
  const int last = static_cast<int>(width - 2 * margin);
  for (int x = 0; x < last; ++x) {
    const auto [r, g, b] = colourOf(scale, scale.low + (scale.high - scale.low) * (x + 0.5) / last);
    cairo_set_source_rgb(cairo, r / 255.0, g / 255.0, b / 255.0);
    cairo_rectangle(cairo, margin + x, margin, 1.5, bar);
    cairo_fill(cairo);
  }
  canvas.ink();
  double size = 0.34 * height;
  cairo_set_font_size(cairo, size);
  char low[32], high[32];
  std::snprintf(low, sizeof low, "%.3g", scale.low);
  std::snprintf(high, sizeof high, "%.3g", scale.high);
  const auto wide = [&](const char* text) { return canvas.widthOf(text); };
  const double needed = wide(low) + wide(high) + wide(scale.label.c_str()) + 2 * size;
  if (const double room = width - 2 * margin; needed > room)
    cairo_set_font_size(cairo, size *= room / needed);
  const double base = height - margin - 0.04 * height;
  const auto write = [&](double x, const char* text) {
    cairo_move_to(cairo, x, base);
    cairo_show_text(cairo, text);
  };
  write(margin, low);
  write((width - wide(scale.label.c_str())) / 2, scale.label.c_str());
  write(width - margin - wide(high), high);
}

void drawColourBar(const ColourScale& scale, Image& image) {
  const int width = std::max(image.width * 2 / 5, 1), height = std::max(image.height / 11, 1);
  Canvas canvas(width, height);
  canvas.paper();
  paintColourBar(canvas, scale, width, height);
  const int gap = std::min(image.width, image.height) / 60;
  canvas.copyTo(image, image.width - width - std::min(gap, image.width - width),
                image.height - height - std::min(gap, image.height - height));
}

}  // namespace isoreel::inspect
