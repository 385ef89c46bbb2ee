// SPDX-License-Identifier: BSD-3-Clause
// Cairo, for letters and boxes.
#pragma once

#include <cairo/cairo.h>
#include <isoreel/inspect/render.h>

#include <memory>

namespace isoreel::inspect {

/// An opaque drawing of its own, black at first, with a font that looks the same whatever the machine's
/// settings are.
class Canvas {
 public:
  Canvas(int width, int height);
  /// Starts with the image's pixels.
  explicit Canvas(const Image& image);
  cairo_t* cairo() const { return cairo_.get(); }
  /// Fills it with the near white that text stands on, and takes the colour of text.
  void paper() const;
  void ink() const;
  /// Of one line in the font's present size, in pixels.
  double widthOf(const char* text) const;
  /// Takes the font size at which the line fits into `room` pixels, at most `size`; returns it.
  double fitFont(const char* text, double size, double room) const;
  /// Lays the drawing over the image with its upper left corner at (x, y); it must fit. A drawing that failed
  /// (text that is not UTF-8, no memory) leaves the image as it is.
  void copyTo(Image& image, int x, int y) const;

 private:
  struct Release {
    void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
    void operator()(cairo_t* context) const { cairo_destroy(context); }
  };
  int width_, height_;
  std::unique_ptr<cairo_surface_t, Release> surface_;
  std::unique_ptr<cairo_t, Release> cairo_;
};

}  // namespace isoreel::inspect
