// SPDX-License-Identifier: BSD-3-Clause
// Encoding to a length or to a distance, and what presets and targets of the fit do.
#include "../../cli/step_search.h"

#include <cmath>

#include "support.h"

namespace isoreel::cli {
namespace {

/// What a search finds for a step whose y is `law`(step), and how often it asks.
std::pair<std::optional<std::uint32_t>, int> found(StepSearch search, double (*law)(double)) {
  int tries = 0;
  while (const auto step = search.next()) {
    EXPECT_GE(*step, StepSearch::kFinest);
    EXPECT_LE(*step, StepSearch::kCoarsest);
    search.add(*step, law(*step));
    ++tries;
  }
  return {search.best(), tries};
}

TEST(StepSearch, FindsWhatRisesAndWhatFalls) {
  const auto error = [](double step) { return std::sqrt(0.0009 + 1e-10 * step * step); };
  for (const double limit : {0.031, 0.04, 0.1}) {
    const auto [step, tries] = found({0.97 * limit, limit, 0.5}, error);
    ASSERT_TRUE(step.has_value()) << limit;
    EXPECT_LE(error(*step), limit);
    EXPECT_GE(error(*step), 0.97 * limit);
    EXPECT_LE(tries, 8) << limit;
  }
  const auto bytes = [](double step) { return 1000 + 4e6 / std::pow(step, 0.6); };
  for (const double size : {14'000.0, 30'000.0, 300'000.0}) {
    const auto [step, tries] = found({0.985 * size, size, -0.5}, bytes);
    ASSERT_TRUE(step.has_value()) << size;
    EXPECT_LE(bytes(*step), size);
    EXPECT_GE(bytes(*step), 0.985 * size);
    EXPECT_LE(tries, 6) << size;
  }
}

TEST(StepSearch, EndsWhereThereIsNothingToFind) {
  const auto never = [](double) { return 1.0; };
  EXPECT_FALSE(found({0.97 * 0.5, 0.5, 0.5}, never).first.has_value());
  EXPECT_FALSE(found({0.97 * 0.5, 0.5, -0.5}, never).first.has_value());
  // Everything will do: the end of the range.
  EXPECT_EQ(found({1.9, 2, 0.5}, never).first.has_value(), true);
  EXPECT_EQ(found({1.9, 2, -0.5}, never).first.has_value(), true);
  // A jump: the side that keeps to the limit.
  const auto jump = [](double step) { return step < 1000 ? 0.1 : 10.0; };
  EXPECT_EQ(found({0.97, 1, 0.5}, jump).first.value_or(9999) < 1000, true);
}

using RateTest = CliTest;

TEST_F(RateTest, ALengthIsKeptAndFilled) {
  sequence();
  const auto length = [&](const std::string& options) {
    ok("isoreel encode seq.json -o x.isr --iso 0 --force " + options);
    return bytes("x.isr");
  };
  const auto finest = length("--step 1/256"), coarsest = length("--step 1/2");
  ASSERT_LT(coarsest, finest);
  const auto wanted = (finest + coarsest) / 2;
  const auto got = length(fmt::format("--size {}", wanted));
  EXPECT_LE(got, wanted);
  EXPECT_GE(static_cast<double>(got), 0.98 * static_cast<double>(wanted));
  EXPECT_NE(ok("isoreel verify x.isr").find("is right"), std::string::npos);
  EXPECT_LE(length("--size 4kB --parity 5 --jobs 1"), 4000u);  // parity counts too
  fails("isoreel encode seq.json -o y.isr --iso 0 --size 300", 1, "--size 300 cannot be kept");
  EXPECT_FALSE(there("y.isr"));
  EXPECT_FALSE(there("y.isr.part"));
  fails("isoreel encode seq.json -o y.isr --iso 0 --size 3000 --step 1/8", 2, "--step");
  fails("isoreel encode seq.json -o y.isr --iso 0 --size 3000 --append", 2, "--append");
}

TEST_F(RateTest, NoFrameIsFurtherThanTheLimit) {
  balls("a", 11, {{{5, 5, 5}, 3.1}});
  balls("b", 11, {{{5.4, 5, 4.8}, 3.6}});
  describe("two", 11, {"a.raw", "b.raw"});
  const auto totals = json("isoreel encode two.json -o x.isr --iso 0 --gop 1 --max-error 0.08 --json");
  EXPECT_EQ(totals["error"]["against"], "volume");
  const auto compared = json("isoreel compare x.isr two.json --json");
  const auto info = json("isoreel info x.isr --frames --json");
  for (std::size_t i = 0; i < 2; ++i) {
    const auto& found = compared["frame_list"][i]["volume"];
    EXPECT_LE(found["rms"].get<double>(), 0.08) << i;
    EXPECT_GT(found["rms"].get<double>(), 0.07) << i;
    // What compare finds stands in the file.
    const auto& error = info["frame_list"][i]["error"];
    EXPECT_NEAR(error["rms"].get<double>(), found["rms"].get<double>(), 1e-6) << i;
    EXPECT_NEAR(error["max"].get<double>(), found["max"].get<double>(), 1e-6) << i;
  }
  // The same file whatever the number of threads.
  ok("isoreel encode two.json -o y.isr --iso 0 --gop 1 --max-error 0.08 --jobs 1 && cmp x.isr y.isr");
  fails("isoreel encode a.json -o z.isr --iso 0 --max-error 0.0001", 1, "cannot be kept on this grid");
  EXPECT_FALSE(there("z.isr"));
  fails("isoreel encode a.json -o z.isr --iso 0 --max-error 0", 2, "--max-error");
  fails("isoreel encode a.json -o z.isr --iso 0 --max-error 0.1 --size 1000", 2, "--max-error");
}

TEST_F(RateTest, CodedCellsMayBeLarger) {
  balls("a", 21, {{{10, 10, 10}, 7.1}});
  balls("b", 21, {{{10.4, 10, 9.8}, 7.6}});
  describe("two", 21, {"a.raw", "b.raw"});
  describe("one", 21, {"a.raw"});
  ok("isoreel encode two.json -o fine.isr --iso 0 --step 1/4");
  ok("isoreel encode two.json -o x.isr --iso 0 --step 1/8 --cell 2 --measure");
  EXPECT_LT(bytes("x.isr"), bytes("fine.isr"));
  const auto compared = json("isoreel compare x.isr two.json --json");
  const auto info = json("isoreel info x.isr --frames --json");
  EXPECT_EQ(info["grid"]["nodes"], nlohmann::json({11, 11, 11}));
  for (std::size_t i = 0; i < 2; ++i) {
    // compare tells cells of the volume, the file those of its own grid.
    const double rms = compared["frame_list"][i]["volume"]["rms"];
    EXPECT_LT(rms, 0.1);
    EXPECT_NEAR(2 * info["frame_list"][i]["error"]["rms"].get<double>(), rms, 1e-6) << i;
  }
  // Where it was is where it is.
  ok("isoreel render x.isr -o x.png --frames 0 --color error --volumes two.json --size 64x64");
  const auto fine_box = json("isoreel info fine.isr --frames --json")["frame_list"][0]["box"];
  const auto box = info["frame_list"][0]["box"];
  for (const char* end : {"min", "max"}) {
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_NEAR(box[end][k].get<double>(), fine_box[end][k].get<double>(), 0.5) << end << k;
  }
  ok("isoreel encode two.json -o y.isr --iso 0 --cell 2 --max-error 0.08");
  EXPECT_LE(json("isoreel compare y.isr two.json --json")["volume"]["rms"].get<double>(), 0.08);
  for (const char* side : {"0.5", "65", "1,2", "x", "auto"})
    fails(fmt::format("isoreel encode two.json -o z.isr --iso 0 --cell {}", side), 2, "--cell");
  const auto plain = json("isoreel encode one.json -o z.isr --iso 0 --max-error 0.3 --json");
  const auto chosen =
      json("isoreel encode one.json -o z.isr --force --iso 0 --max-error 0.3 --cell auto --json");
  EXPECT_GE(chosen["cell"].get<double>(), 2);
  EXPECT_LT(chosen["bytes"]["total"].get<int>(), plain["bytes"]["total"].get<int>());
  EXPECT_LE(json("isoreel compare z.isr one.json --json")["volume"]["rms"].get<double>(), 0.3);
  balls("c", 17, {{{8, 8, 8}, 5}});
  describe("other", 17, {"c.raw", "c.raw"});
  fails("isoreel compare x.isr other.json", 1, "the grid of c.raw is not that of x.isr");
  fails("isoreel encode two.json -o x.isr --iso 0 --append", 1, "it has another grid");
  ok("isoreel encode two.json -o x.isr --iso 0 --append --cell 2");
}

TEST_F(RateTest, MeasuringChangesNoPacket) {
  sequence();
  ok("isoreel encode seq.json -o x.isr --iso 0 && isoreel encode seq.json -o y.isr --iso 0 --measure");
  const auto x = json("isoreel info x.isr --frames --json"), y = json("isoreel info y.isr --frames --json");
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(x["frame_list"][i]["hash"], y["frame_list"][i]["hash"]);
    EXPECT_EQ(x["frame_list"][i]["error"]["against"], "none");
    // The last frame is empty: there is nothing to measure, and nothing to be wrong.
    EXPECT_EQ(y["frame_list"][i]["error"]["against"], "volume") << i;
  }
}

TEST_F(RateTest, TheFitIsToWhatWasAskedFor) {
  sequence();
  const auto distances = [&](const std::string& options) {
    ok("isoreel encode seq.json -o x.isr --iso 0 --force --step 1/32 " + options);
    const auto found = json("isoreel compare x.isr seq.json --json --samples 20000");
    return std::pair<double, double>{found["volume"]["rms"], found["extracted"]["rms"]};
  };
  const auto to_volume = distances("--fit volume"), to_mesh = distances("--fit extracted");
  EXPECT_LT(to_volume.first, to_mesh.first);
  EXPECT_LT(to_mesh.second, 0.8 * to_volume.second);
}

TEST_F(RateTest, PresetsDecodeAndExplicitOptionsWin) {
  sequence();
  for (const std::string preset : {"fast", "default", "best"}) {
    ok("isoreel encode seq.json -o " + preset + ".isr --iso 0 --preset " + preset);
    EXPECT_NE(ok("isoreel verify " + preset + ".isr").find("is right"), std::string::npos);
  }
  ok("isoreel encode seq.json -o plain.isr --iso 0 && cmp plain.isr default.isr");
  ok("isoreel encode seq.json -o x.isr --iso 0 --preset best --block 8 && cmp x.isr default.isr");
  EXPECT_LE(bytes("best.isr"), bytes("default.isr"));
  fails("isoreel encode seq.json -o y.isr --iso 0 --preset slow", 2, "slow");
}

TEST_F(RateTest, SlicesDecodeOnAnyThreads) {
  const std::string data = std::string(ISOREEL_DATA) + "/droplets";
  ok("isoreel encode " + data + " -o one.isr --frames 0:4 && isoreel encode " + data +
     " -o four.isr --frames 0:4 --slices 4");
  EXPECT_NE(ok("isoreel verify four.isr").find("is right"), std::string::npos);
  EXPECT_NE(bytes("one.isr"), bytes("four.isr"));
  for (const std::string jobs : {"1", "3"})
    ok("isoreel decode four.isr --frames 3 -o " + jobs + ".ply --jobs " + jobs);
  ok("cmp 1.ply 3.ply");
  ok("isoreel trim four.isr --from 2 -o cut.isr && isoreel verify cut.isr");
  fails("isoreel encode " + data + " -o y.isr --slices 17", 2, "--slices");
}

}  // namespace
}  // namespace isoreel::cli
