// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <isoreel/inspect/chart.h>
#include <unistd.h>

#include <filesystem>

namespace isoreel::inspect {
namespace {

TEST(Chart, ShortNumbers) {
  for (const auto& [value, text] : std::vector<std::pair<double, std::string>>{{0, "0"},
                                                                               {0.125, "0.125"},
                                                                               {999, "999"},
                                                                               {999.6, "1 k"},
                                                                               {12345, "12.3 k"},
                                                                               {-2.5e6, "-2.5 M"},
                                                                               {3e9, "3 G"}})
    EXPECT_EQ(shortNumber(value), text);
}

TEST(Chart, RefusesRowsThatDoNotFit) {
  const auto path =
      std::filesystem::temp_directory_path() / ("isoreel-chart-" + std::to_string(getpid()) + ".svg");
  Chart chart;
  EXPECT_FALSE(writeChart(chart, path).ok()) << "nothing to draw";
  chart.times = {0, 1, 4};
  chart.end = 5;
  chart.rows.push_back(
      {.title = "row", .note = "", .values = {1, 2, 2}, .kinds = {}, .kind_names = {}, .marks = {1}});
  const Status status = writeChart(chart, path);
  EXPECT_TRUE(status.ok()) << status.message();
  EXPECT_GT(std::filesystem::file_size(path), 1000u);
  std::filesystem::remove(path);
  chart.rows[0].values.pop_back();
  EXPECT_EQ(writeChart(chart, path).error().code, ErrorCode::kInvalidArgument);
  chart.rows[0].values.push_back(2);
  chart.rows[0].style = ChartRow::Style::kBars;
  EXPECT_EQ(writeChart(chart, path).error().code, ErrorCode::kInvalidArgument) << "bars without kinds";
  EXPECT_FALSE(std::filesystem::exists(path));
}

}  // namespace
}  // namespace isoreel::inspect
