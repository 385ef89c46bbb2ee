// SPDX-License-Identifier: BSD-3-Clause
#include "times.h"

#include <gtest/gtest.h>

#include <limits>

namespace isoreel::lavf {
namespace {

constexpr TimeBase kMilliseconds{1, 1000};

TEST(CarrierTimes, AreThePacketsOwnWhereTheCarrierRounds) {
  std::vector<Timing> timings;
  for (std::int64_t i = 0; i < 100; ++i) timings.push_back({i, 1, (i * 1001 * 1000 + 15000) / 30000, 0});
  const TrackTimes times = reconcileTimes(timings, {1001, 30000}, kMilliseconds);
  EXPECT_EQ(times.base, (TimeBase{1001, 30000}));
  for (std::int64_t i = 0; i < 100; ++i) EXPECT_EQ(times.times[static_cast<std::size_t>(i)], i);
}

TEST(CarrierTimes, AreMovedByWholeTicksBehindCutsAndJoins) {
  // Frames 50 to 54, and behind them frames 10 and 11.
  std::vector<Timing> timings;
  for (std::int64_t i = 0; i < 5; ++i) timings.push_back({50 + i, 1, i * 40, 0});
  for (std::int64_t i = 0; i < 2; ++i) timings.push_back({10 + i, 1, 200 + i * 40, 0});
  const TrackTimes times = reconcileTimes(timings, {1, 25}, kMilliseconds);
  EXPECT_EQ(times.times, (std::vector<std::int64_t>{0, 1, 2, 3, 4, 5, 6}));
}

TEST(CarrierTimes, AreTheCarriersWhereItTellsOthers) {
  // Played at half the speed by somebody.
  std::vector<Timing> timings;
  for (std::int64_t i = 0; i < 4; ++i) timings.push_back({i, 1, i * 50 + 3, i < 3 ? 50 : 0});
  const TrackTimes times = reconcileTimes(timings, {1, 25}, kMilliseconds);
  EXPECT_EQ(times.base, kMilliseconds);
  EXPECT_EQ(times.times, (std::vector<std::int64_t>{3, 53, 103, 153}));
  EXPECT_EQ(times.durations, (std::vector<std::uint64_t>{50, 50, 50, 50}));
}

TEST(CarrierTimes, RiseWhateverTheCarrierSays) {
  const std::vector<Timing> joined{{0, 2, 0, 0}, {2, 2, 80, 0}, {0, 2, 80, 0}, {2, 2, 160, 0}};
  EXPECT_EQ(reconcileTimes(joined, {1, 25}, kMilliseconds).times, (std::vector<std::int64_t>{0, 2, 4, 6}));
  constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
  const std::vector<Timing> wild{
      {kMost, 1, -kMost, kMost}, {-kMost, 0, kMost, -5}, {3, kMost, std::nullopt, 0}};
  const TrackTimes times = reconcileTimes(wild, {1, 25}, {1, 4000000000u});
  for (std::size_t i = 1; i < times.times.size(); ++i) EXPECT_GT(times.times[i], times.times[i - 1]);
}

}  // namespace
}  // namespace isoreel::lavf
