// SPDX-License-Identifier: BSD-3-Clause
#include "src/canvas.h"

#if defined(__SANITIZE_ADDRESS__)
#define ISOREEL_LEAK_CHECK
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define ISOREEL_LEAK_CHECK
#endif
#endif
#ifdef ISOREEL_LEAK_CHECK
// fontconfig keeps what it found in pointers that are stored as offsets, where the leak check does not see
// them.
// NOLINTNEXTLINE: the sanitizer gives this its name
extern "C" const char* __lsan_default_suppressions() { return "leak:libfontconfig"; }
#endif

namespace isoreel::inspect {

Canvas::Canvas(int width, int height)
    : width_(width),
      height_(height),
      surface_(cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height)),
      cairo_(cairo_create(surface_.get())) {
  cairo_select_font_face(cairo(), "sans", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  cairo_font_options_t* options = cairo_font_options_create();
  cairo_font_options_set_antialias(options, CAIRO_ANTIALIAS_GRAY);
  cairo_font_options_set_hint_style(options, CAIRO_HINT_STYLE_NONE);
  cairo_font_options_set_hint_metrics(options, CAIRO_HINT_METRICS_OFF);
  cairo_set_font_options(cairo(), options);
  cairo_font_options_destroy(options);
}

Canvas::Canvas(const Image& image) : Canvas(image.width, image.height) {
  cairo_surface_flush(surface_.get());
  unsigned char* data = cairo_image_surface_get_data(surface_.get());
  if (data == nullptr) return;
  const int stride = cairo_image_surface_get_stride(surface_.get());
  const std::uint8_t* in = image.pixels.data();
  for (int line = 0; line < height_; ++line) {
    auto* row = reinterpret_cast<std::uint32_t*>(data + static_cast<std::ptrdiff_t>(line) * stride);
    for (int column = 0; column < width_; ++column, in += 4)
      row[column] = std::uint32_t{in[0]} << 16 | std::uint32_t{in[1]} << 8 | in[2];
  }
  cairo_surface_mark_dirty(surface_.get());
}

void Canvas::paper() const {
  cairo_set_source_rgb(cairo(), 0.96, 0.96, 0.96);
  cairo_paint(cairo());
}

void Canvas::ink() const { cairo_set_source_rgb(cairo(), 0.15, 0.15, 0.15); }

double Canvas::widthOf(const char* text) const {
  cairo_text_extents_t extents;
  cairo_text_extents(cairo(), text, &extents);
  return extents.x_advance;
}

double Canvas::fitFont(const char* text, double size, double room) const {
  cairo_set_font_size(cairo(), size);
  if (const double width = widthOf(text); width > room) cairo_set_font_size(cairo(), size *= room / width);
  return size;
}

void Canvas::copyTo(Image& image, int x, int y) const {
  cairo_surface_flush(surface_.get());
  const unsigned char* data = cairo_image_surface_get_data(surface_.get());
  if (data == nullptr || cairo_status(cairo()) != CAIRO_STATUS_SUCCESS) return;
  const int stride = cairo_image_surface_get_stride(surface_.get());
  for (int line = 0; line < height_; ++line) {
    const auto* row =
        reinterpret_cast<const std::uint32_t*>(data + static_cast<std::ptrdiff_t>(line) * stride);
    const std::size_t first = static_cast<std::size_t>(y + line) * static_cast<std::size_t>(image.width) +
                              static_cast<std::size_t>(x);
    std::uint8_t* out = &image.pixels[first * 4];
    for (int column = 0; column < width_; ++column, out += 4) {
      for (int channel = 0; channel < 3; ++channel)
        out[channel] = static_cast<std::uint8_t>(row[column] >> (16 - 8 * channel));
    }
  }
}

void drawCaption(const std::string& caption, Image& image) {
  const int height = std::max(image.height / 22, 1);
  const int gap = std::min(image.width, image.height) / 60;
  const double room = std::max(image.width - 2 * gap, 1);
  const Canvas measure(1, 1);
  const double wanted = 0.7 * height;
  const double size = measure.fitFont(caption.c_str(), wanted, room - height);
  const int width = std::max(static_cast<int>(std::min(measure.widthOf(caption.c_str()) + height, room)), 1);
  Canvas canvas(width, height);
  canvas.paper();
  canvas.ink();
  cairo_set_font_size(canvas.cairo(), size);
  cairo_move_to(canvas.cairo(), height / 2.0, height / 2.0 + 0.36 * size);
  cairo_show_text(canvas.cairo(), caption.c_str());
  canvas.copyTo(image, std::min(gap, image.width - width), std::min(gap, image.height - height));
}

}  // namespace isoreel::inspect
