// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/inspect/render.h>

#include <algorithm>

#include "src/canvas.h"

namespace isoreel::inspect {
namespace {

constexpr int kGap = 8;
constexpr std::uint8_t kPaper = 250;
constexpr double kInk = 0.2;

std::size_t offset(const Image& image, int x, int y) {
  return (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(x)) *
         4;
}

Image blank(int width, int height) {
  Image image{width, height, {}};
  image.pixels.assign(offset(image, 0, height), kPaper);
  for (std::size_t i = 3; i < image.pixels.size(); i += 4) image.pixels[i] = 255;
  return image;
}

void paste(const Image& tile, int x, int y, Image& sheet) {
  const int rows = std::min(tile.height, sheet.height - y);
  const int columns = std::min(tile.width, sheet.width - x);
  for (int row = 0; row < rows; ++row) {
    std::copy_n(&tile.pixels[offset(tile, 0, row)], 4 * columns, &sheet.pixels[offset(sheet, x, y + row)]);
  }
}

/// One line of text in the middle of a strip, in smaller letters if it would not fit. Text that is not UTF-8,
/// or a machine without fonts, leaves the strip empty.
Image captionStrip(const std::string& text, int width, int height) {
  Canvas canvas(width, height);
  cairo_t* cairo = canvas.cairo();
  cairo_set_source_rgb(cairo, kPaper / 255.0, kPaper / 255.0, kPaper / 255.0);
  cairo_paint(cairo);
  cairo_set_source_rgb(cairo, kInk, kInk, kInk);

  const double size = canvas.fitFont(text.c_str(), 0.62 * height, 0.96 * width);
  cairo_move_to(cairo, (width - canvas.widthOf(text.c_str())) / 2, height / 2.0 + 0.36 * size);
  cairo_show_text(cairo, text.c_str());

  Image strip = blank(width, height);
  canvas.copyTo(strip, 0, 0);
  return strip;
}

}  // namespace

Image contactSheet(const std::vector<Image>& images, const std::vector<std::string>& captions, int columns) {
  if (images.empty()) return {};
  int width = 1, height = 1;
  for (const Image& image : images) {
    width = std::max(width, image.width);
    height = std::max(height, image.height);
  }
  const int count = static_cast<int>(images.size());
  columns = std::clamp(columns, 1, count);
  const int rows = (count + columns - 1) / columns;
  const bool captioned =
      std::any_of(captions.begin(), captions.end(), [](const std::string& text) { return !text.empty(); });
  const int strip = captioned ? std::clamp(height / 9, 14, 40) : 0;

  Image sheet = blank(columns * (width + kGap) + kGap, rows * (height + strip + kGap) + kGap);
  for (int i = 0; i < count; ++i) {
    const auto index = static_cast<std::size_t>(i);
    const int x = kGap + i % columns * (width + kGap);
    const int y = kGap + i / columns * (height + strip + kGap);
    paste(images[index], x, y, sheet);
    if (index < captions.size() && !captions[index].empty()) {
      paste(captionStrip(captions[index], width, strip), x, y + height, sheet);
    }
  }
  return sheet;
}

}  // namespace isoreel::inspect
