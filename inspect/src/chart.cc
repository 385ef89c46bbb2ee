// SPDX-License-Identifier: BSD-3-Clause
#include <cairo/cairo-svg.h>
#include <isoreel/inspect/chart.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>

namespace isoreel::inspect {
namespace {

// Points of the page.
constexpr double kWidth = 960, kLeft = 76, kRight = 24, kTop = 44, kRow = 148, kGap = 40, kBottom = 46;
constexpr double kSmall = 11.5, kNormal = 13, kLarge = 16;

struct Rgb {
  double r, g, b;
};
constexpr Rgb kInk{0.13, 0.15, 0.19}, kFaint{0.87, 0.88, 0.90}, kGrey{0.42, 0.45, 0.50},
    kMark{0.80, 0.25, 0.20};
constexpr std::array<Rgb, 4> kKinds{
    {{0.85, 0.49, 0.13}, {0.20, 0.45, 0.70}, {0.30, 0.60, 0.35}, {0.55, 0.40, 0.65}}};
constexpr Rgb kLine = kKinds[1];

/// Values that are easy to read, at most `most` steps of 1, 2 or 5 times a power of ten from low to high.
std::vector<double> ticks(double low, double high, int most, bool whole) {
  const double raw = (high - low) / most, power = std::pow(10, std::floor(std::log10(raw)));
  double step = 10 * power;
  for (const double factor : {5.0, 2.0, 1.0}) {
    if (factor * power >= raw * 0.999) step = factor * power;
  }
  if (whole) step = std::max(1.0, std::round(step));
  std::vector<double> result;
  for (double at = std::ceil(low / step - 1e-6); at * step <= high + step * 1e-6; ++at)
    result.push_back(at * step + 0.0);  // not -0
  return result;
}

class Page {
 public:
  Page(const Chart& chart, cairo_t* cairo)
      : chart_(chart), cairo_(cairo), start_(chart.times.front()), end_(chart.end) {
    if (!(end_ > start_)) end_ = start_ + 1;
    cairo_select_font_face(cairo_, "sans", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
    colour({1, 1, 1});
    cairo_paint(cairo_);
    colour(kInk);
    text(kLeft, 26, chart.title, kLarge);
    for (std::size_t i = 0; i < chart.rows.size(); ++i) {
      row(chart.rows[i], kTop + kGap / 2 + static_cast<double>(i) * (kRow + kGap));
    }
    timeAxis(kTop + kGap / 2 + static_cast<double>(chart.rows.size()) * (kRow + kGap) - kGap);
  }

 private:
  void colour(const Rgb& c) { cairo_set_source_rgb(cairo_, c.r, c.g, c.b); }
  double wide(const std::string& what, double size) {
    cairo_set_font_size(cairo_, size);
    cairo_text_extents_t extents;
    cairo_text_extents(cairo_, what.c_str(), &extents);
    return extents.x_advance;
  }
  /// `align`: 0 from x on, 0.5 around it, 1 up to it. Text that is not UTF-8 is an error of the whole page.
  void text(double x, double y, const std::string& what, double size, double align = 0) {
    const double width = wide(what, size);
    cairo_move_to(cairo_, x - align * width, y);
    cairo_show_text(cairo_, what.c_str());
  }
  void line(double x0, double y0, double x1, double y1, double width) {
    cairo_set_line_width(cairo_, width);
    cairo_move_to(cairo_, x0, y0);
    cairo_line_to(cairo_, x1, y1);
    cairo_stroke(cairo_);
  }
  double across(double time) const {
    return kLeft + (time - start_) / (end_ - start_) * (kWidth - kLeft - kRight);
  }
  double ending(std::size_t i) const { return i + 1 < chart_.times.size() ? chart_.times[i + 1] : end_; }

  void timeAxis(double y) {
    for (const double at : ticks(start_, end_, 10, false)) {
      colour(kGrey);
      line(across(at), y, across(at), y + 5, 1);
      colour(kInk);
      text(across(at), y + 18, label(at), kSmall, 0.5);
    }
    text((kLeft + kWidth - kRight) / 2, y + 37, chart_.time_title, kNormal, 0.5);
  }

  static std::string label(double value) {
    char digits[32];
    std::snprintf(digits, sizeof digits, "%.6g", std::abs(value) < 1e-12 ? 0 : value);
    return digits;
  }

  void row(const ChartRow& row, double top) {
    const auto [least, most] = std::minmax_element(row.values.begin(), row.values.end());
    const bool steps = row.style == ChartRow::Style::kSteps;
    double low = *least, high = *most;
    // From 0, unless what there is to see would be squeezed into the upper third.
    if (low >= 0 && (low < high * 2 / 3 || row.style != ChartRow::Style::kCurve || low == high)) low = 0;
    if (!(high > low)) high = low + 1;
    const double room = (high - low) * 0.06;
    high += room;
    if (low != 0) low -= room;
    const auto up = [&](double value) { return top + kRow - (value - low) / (high - low) * kRow; };

    colour(kInk);
    text(kLeft, top - 8, row.title, kNormal);
    colour(kGrey);
    text(kWidth - kRight, top - 8, row.note, kSmall, 1);
    for (const double at : ticks(low, high, 5, steps)) {
      colour(kFaint);
      line(kLeft, up(at), kWidth - kRight, up(at), 1);
      colour(kInk);
      text(kLeft - 8, up(at) + 4, shortNumber(at), kSmall, 1);
    }
    marks(row, top);
    if (row.style == ChartRow::Style::kBars) {
      bars(row, up, wide(row.title, kNormal) + kLeft + 22, top - 8);
    } else {
      curve(row, up, steps);
    }
    colour(kGrey);
    line(kLeft, top + kRow, kWidth - kRight, top + kRow, 1);
  }

  void marks(const ChartRow& row, double top) {
    const double dash = 3;
    colour(kMark);
    cairo_set_dash(cairo_, &dash, 1, 0);
    for (const std::size_t frame : row.marks)
      line(across(chart_.times[frame]), top, across(chart_.times[frame]), top + kRow, 0.8);
    cairo_set_dash(cairo_, nullptr, 0, 0);
  }

  template <class Up>
  void bars(const ChartRow& row, const Up& up, double legend, double base) {
    for (std::size_t kind = 0; kind < row.kind_names.size(); ++kind) {
      colour(kKinds[kind]);
      for (std::size_t i = 0; i < row.values.size(); ++i) {
        if (row.kinds[i] != kind) continue;
        const double x = across(chart_.times[i]), width = across(ending(i)) - x;
        cairo_rectangle(cairo_, x, up(row.values[i]), width > 3 ? width - 1 : width,
                        up(0) - up(row.values[i]));
      }
      cairo_fill(cairo_);
      cairo_rectangle(cairo_, legend, base - 9, 10, 10);
      cairo_fill(cairo_);
      colour(kInk);
      text(legend + 15, base, row.kind_names[kind], kSmall);
      legend += 33 + wide(row.kind_names[kind], kSmall);
    }
  }

  template <class Up>
  void curve(const ChartRow& row, const Up& up, bool steps) {
    colour(kLine);
    cairo_set_line_width(cairo_, 1.6);
    cairo_set_line_join(cairo_, CAIRO_LINE_JOIN_ROUND);
    for (std::size_t i = 0; i < row.values.size(); ++i) {
      const double x = across(chart_.times[i]), y = up(row.values[i]);
      if (i == 0) cairo_move_to(cairo_, x, y);
      cairo_line_to(cairo_, x, y);
      if (steps || i + 1 == row.values.size()) cairo_line_to(cairo_, across(ending(i)), y);
    }
    cairo_stroke(cairo_);
  }

  const Chart& chart_;
  cairo_t* cairo_;
  double start_, end_;
};

Status check(const Chart& chart) {
  if (chart.times.empty()) return {ErrorCode::kInvalidArgument, "there is nothing to draw"};
  for (const ChartRow& row : chart.rows) {
    const bool bars = row.style == ChartRow::Style::kBars;
    if (row.values.size() != chart.times.size() || (bars && row.kinds.size() != row.values.size()) ||
        row.kind_names.size() > kKinds.size()) {
      return {ErrorCode::kInvalidArgument, "'" + row.title + "' does not have a value for each frame"};
    }
  }
  return {};
}

}  // namespace

std::string shortNumber(double value) {
  struct Prefix {
    double factor;
    const char* name;
  };
  constexpr std::array<Prefix, 4> kPrefixes{{{1e3, " k"}, {1e6, " M"}, {1e9, " G"}, {1e12, " T"}}};
  Prefix prefix{1, ""};
  for (const Prefix& larger : kPrefixes) {
    if (std::abs(value) >= larger.factor * 0.9995) prefix = larger;
  }
  char digits[32];
  std::snprintf(digits, sizeof digits, "%.3g%s", value / prefix.factor, prefix.name);
  return digits;
}

Status writeChart(const Chart& chart, const std::filesystem::path& path) {
  ISOREEL_TRY(check(chart).at(path.string()));
  std::filesystem::path temporary = path;
  temporary += ".part";
  const double height = kTop + static_cast<double>(chart.rows.size()) * (kRow + kGap) + kBottom - kGap / 2;
  cairo_surface_t* surface = cairo_svg_surface_create(temporary.c_str(), kWidth, height);
  cairo_t* cairo = cairo_create(surface);
  Page(chart, cairo);
  cairo_show_page(cairo);
  cairo_surface_finish(surface);
  cairo_status_t drawn = cairo_status(cairo);
  if (drawn == CAIRO_STATUS_SUCCESS) drawn = cairo_surface_status(surface);
  cairo_destroy(cairo);
  cairo_surface_destroy(surface);
  std::error_code error;
  Status status;
  if (drawn != CAIRO_STATUS_SUCCESS) {
    status = {ErrorCode::kIo,
              path.string() + ": the chart cannot be written: " + cairo_status_to_string(drawn)};
  } else {
    std::filesystem::rename(temporary, path, error);
    if (!error) return {};
    status = {ErrorCode::kIo, path.string() + ": the chart cannot be written: " + error.message()};
  }
  std::filesystem::remove(temporary, error);
  return status;
}

}  // namespace isoreel::inspect
