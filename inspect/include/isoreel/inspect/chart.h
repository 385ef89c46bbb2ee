// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/base/status.h>

#include <filesystem>
#include <string>
#include <vector>

namespace isoreel::inspect {

/// One row of a chart, above the axis of time that all rows share.
struct ChartRow {
  enum class Style {
    kBars,   // from 0, one for each frame, coloured by `kinds`
    kCurve,  // points joined by straight lines
    kSteps,  // each value held until the next frame
  };
  std::string title;  // with the unit; UTF-8
  std::string note;   // at the right of the title
  Style style = Style::kCurve;
  std::vector<double> values;           // one for each frame, finite
  std::vector<std::size_t> kinds;       // of bars: which of `kind_names` each is
  std::vector<std::string> kind_names;  // at most 4, for the legend
  std::vector<std::size_t> marks;       // frames that get a dashed line through the row
};

/// Values of a sequence over time.
struct Chart {
  std::string title;
  std::string time_title;
  std::vector<double> times;  // when frames begin, rising
  double end = 0;             // when the last ends
  std::vector<ChartRow> rows;
};

/// Writes the chart as SVG, by way of a temporary file (".part" added); letters become outlines, so that it
/// looks the same everywhere. kInvalidArgument when a row has not a value for each time; kIo.
Status writeChart(const Chart& chart, const std::filesystem::path& path);

/// A number with three digits and a prefix: "12.3 k", "0.5", "2.25 M".
std::string shortNumber(double value);

}  // namespace isoreel::inspect
