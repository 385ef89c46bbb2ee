// SPDX-License-Identifier: BSD-3-Clause
// What the mouse does to the camera.
#pragma once

#include <gst/video/navigation.h>

#include <algorithm>
#include <cmath>

namespace isoreel::gst {

/// Degrees to add, and a factor.
struct Change {
  bool handled = false;  // the event has no other use
  double azimuth = 0, elevation = 0, zoom = 1;
  bool any() const { return azimuth != 0 || elevation != 0 || zoom != 1; }
};

/// The first button held: the surface turns with the pointer, half a turn for a picture's width or height.
/// The wheel magnifies. Other events are not handled.
class Drag {
 public:
  Change handle(GstEvent* event, int width, int height) {
    constexpr double kWheelStep = 1.1;
    double x = 0, y = 0, across = 0, along = 0;
    gint button = 0;
    switch (gst_navigation_event_get_type(event)) {
      case GST_NAVIGATION_EVENT_MOUSE_BUTTON_PRESS:
        if (!gst_navigation_event_parse_mouse_button_event(event, &button, &x, &y)) return {};
        if (button == 4 || button == 5)
          return {true, 0, 0, button == 4 ? kWheelStep : 1 / kWheelStep};  // X11's wheel
        if (button != 1) return {};
        held_ = true;
        x_ = x;
        y_ = y;
        return {.handled = true};
      case GST_NAVIGATION_EVENT_MOUSE_BUTTON_RELEASE:
        if (!gst_navigation_event_parse_mouse_button_event(event, &button, &x, &y) || button != 1) return {};
        return {.handled = std::exchange(held_, false)};
      case GST_NAVIGATION_EVENT_MOUSE_MOVE: {
        if (!held_ || !gst_navigation_event_parse_mouse_move_event(event, &x, &y)) return {};
        const double right = x - std::exchange(x_, x), down = y - std::exchange(y_, y);
        return {true, -180 * right / std::max(width, 1), 180 * down / std::max(height, 1)};
      }
      case GST_NAVIGATION_EVENT_MOUSE_SCROLL:
        if (!gst_navigation_event_parse_mouse_scroll_event(event, &x, &y, &across, &along)) return {};
        return {true, 0, 0, std::pow(kWheelStep, std::clamp(along, -100.0, 100.0))};
      default:
        return {};
    }
  }

 private:
  bool held_ = false;
  double x_ = 0, y_ = 0;  // where the pointer was last
};

}  // namespace isoreel::gst
