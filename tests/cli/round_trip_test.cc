// SPDX-License-Identifier: BSD-3-Clause
// encode, info, verify, decode and compare, one after the other, on surfaces whose facts are known.
#include <cmath>
#include <set>

#include "support.h"

namespace isoreel::cli {
namespace {

constexpr double kPi = 3.14159265358979323846;

std::set<std::string> keys(const nlohmann::json& object) {
  std::set<std::string> result;
  for (const auto& [key, value] : object.items()) result.insert(key);
  return result;
}

class RoundTripTest : public CliTest {};

TEST_F(RoundTripTest, EncodeEndsWithTotalsThatAddUp) {
  sequence();
  const auto totals = json("isoreel encode seq.json -o seq.isr --iso 0 --json");
  EXPECT_EQ(keys(totals), (std::set<std::string>{"frames", "predicted_frames", "cell", "vertices", "bytes",
                                                 "seconds", "frame_list"}));
  const auto& parts = totals["bytes"];
  EXPECT_EQ(keys(parts), (std::set<std::string>{"total", "signs", "motion", "vertices", "other"}));
  EXPECT_EQ(totals["frames"], 8);
  EXPECT_EQ(parts["total"], bytes("seq.isr"));
  std::uint64_t sum = 0;
  for (const char* part : {"signs", "motion", "vertices", "other"}) sum += parts[part].get<std::uint64_t>();
  EXPECT_EQ(sum, bytes("seq.isr"));
  EXPECT_GT(parts["signs"], 0);
  EXPECT_GT(parts["vertices"], 0);
  EXPECT_GT(parts["motion"], 0);
  ASSERT_EQ(totals["frame_list"].size(), 8u);
  std::uint64_t motion = 0, predicted = 0;
  for (std::size_t i = 0; i < 8; ++i) {
    const auto& frame = totals["frame_list"][i];
    EXPECT_EQ(frame["number"], i);
    predicted += frame["type"] == "P";
    motion += frame["bytes"]["motion"].get<std::uint64_t>();
  }
  EXPECT_EQ(parts["motion"], motion);
  EXPECT_EQ(totals["predicted_frames"], predicted);
  EXPECT_GT(predicted, 4);
  EXPECT_GE(totals["seconds"], 0.0);

  const auto info = json("isoreel info seq.isr --frames --json");
  EXPECT_EQ(info["vertices"], totals["vertices"]);
  std::uint64_t vertices = 0;
  for (const auto& frame : info["frame_list"]) vertices += frame["vertices"].get<std::uint64_t>();
  EXPECT_EQ(totals["vertices"], vertices);
  EXPECT_FALSE(there("seq.isr.part"));
}

TEST_F(RoundTripTest, InfoTellsTheShapeOfEveryFrame) {
  sequence();
  ok("isoreel encode seq.json -o seq.isr --iso 0");
  const auto info = json("isoreel info seq.isr --frames --json");
  EXPECT_EQ(info["frames"], 8);
  EXPECT_EQ(info["bytes"], bytes("seq.isr"));
  EXPECT_EQ(info["indexed"], true);
  EXPECT_EQ(info["profile"], "main");
  EXPECT_EQ(info["inside"], "above");
  EXPECT_EQ(info["step"], 1.0 / 16);
  EXPECT_EQ(info["grid"]["nodes"], (std::vector<int>{25, 25, 25}));
  EXPECT_EQ(info["damage"].size(), 0u);
  EXPECT_EQ(info["tags"]["source"], "seq.json");
  EXPECT_NEAR(info["seconds"].get<double>(), 8 / 25.0, 1e-12);
  const auto& frames = info["frame_list"];
  ASSERT_EQ(frames.size(), 8u);
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(frames[i]["number"], i);
    EXPECT_TRUE(frames[i]["type"] == "I" || (i > 0 && frames[i]["type"] == "P"));
    EXPECT_EQ(frames[i]["isovalue"], 0.0);
    EXPECT_NEAR(frames[i]["time"].get<double>(), static_cast<double>(i) / 25, 1e-12);
  }
  EXPECT_EQ(frames[0]["components"], 2);
  EXPECT_EQ(frames[0]["euler"], 4);
  EXPECT_EQ(frames[4]["components"], 1);  // merged
  EXPECT_EQ(frames[4]["euler"], 2);
  EXPECT_EQ(frames[5]["components"], 1);  // one has vanished
  const double radius = 4.2;
  EXPECT_NEAR(frames[5]["area"].get<double>(), 4 * kPi * radius * radius, 10);
  EXPECT_NEAR(frames[5]["volume"].get<double>(), 4 / 3.0 * kPi * std::pow(radius, 3), 12);
  EXPECT_NEAR(frames[5]["box"]["min"][0].get<double>(), 7.3 + 3.5 - radius, 0.3);
  EXPECT_NEAR(frames[5]["box"]["max"][0].get<double>(), 7.3 + 3.5 + radius, 0.3);
  EXPECT_EQ(frames[7]["faces"], 0);
  EXPECT_EQ(frames[7]["box"], nullptr);
  EXPECT_EQ(frames[7]["volume"], 0.0);
}

TEST_F(RoundTripTest, PacketsListSectionsThatFitIntoThem) {
  sequence();
  ok("isoreel encode seq.json -o seq.isr --iso 0 --profile classic --step 1/32");
  const auto info = json("isoreel info seq.isr --packets --json");
  ASSERT_EQ(info["packet_list"].size(), 8u);
  std::uint64_t all = 0;
  for (const auto& packet : info["packet_list"]) {
    std::uint64_t sum = 0;
    for (const auto& section : packet["sections"]) sum += section["bytes"].get<std::uint64_t>();
    EXPECT_LE(sum, packet["bytes"].get<std::uint64_t>());
    EXPECT_EQ(packet["step"], 1.0 / 32);
    all += packet["bytes"].get<std::uint64_t>();
  }
  EXPECT_LT(all, bytes("seq.isr"));
  const std::string text = ok("isoreel info seq.isr --packets --frames");
  EXPECT_NE(text.find("packet     7  I"), std::string::npos) << text;
}

TEST_F(RoundTripTest, VerifyIsContent) {
  sequence();
  ok("isoreel encode seq.json -o seq.isr --iso 0");
  EXPECT_NE(
      ok("isoreel verify seq.isr").find("8 frames, every checksum, hash and surface is right; all are "),
      std::string::npos);
  const auto result = json("isoreel verify seq.isr --json");
  EXPECT_EQ(result["ok"], true);
  EXPECT_EQ(result["frames"], 8);
  EXPECT_EQ(result["problems"].size(), 0u);
}

TEST_F(RoundTripTest, WhereSheetsMeetIsTold) {
  volume("touch", 6, [](double x, double y, double z) {  // two nodes across a face from each other
    return z == 2 && ((x == 2 && y == 2) || (x == 3 && y == 3)) ? 0.5 : -0.6;
  });
  const auto notManifold = [&](const std::string& file) {
    return json("isoreel verify " + file + " --json")["not_manifold"];
  };
  ok("isoreel encode touch.json -o main.isr --iso 0 --fit extracted");
  EXPECT_EQ(notManifold("main.isr").size(), 0u);
  ok("isoreel encode touch.json -o classic.isr --iso 0 --profile classic");
  const auto found = notManifold("classic.isr");
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0]["frame"], 0);
  EXPECT_EQ(found[0]["vertices"], 2);
  EXPECT_NE(ok("isoreel verify classic.isr").find("1 frame is no 2-manifold, at 2 vertices"),
            std::string::npos);
  // Each profile is close to the mesh with as many vertices as it has.
  const auto rms = [&](const std::string& file, const std::string& mesh) -> double {
    return json("isoreel compare " + file + " touch.json --samples 2000 --json" + mesh)["extracted"]["rms"];
  };
  EXPECT_LT(rms("classic.isr", " --mesh cells"), 0.02);
  EXPECT_GT(rms("classic.isr", ""), 0.09);
  EXPECT_LT(rms("main.isr", ""), 0.1);
  EXPECT_GT(rms("main.isr", " --mesh cells"), 0.12);
}

TEST_F(RoundTripTest, TheSameBytesForAnyNumberOfThreads) {
  sequence();
  for (const int jobs : {1, 2, 4})
    ok(fmt::format("isoreel encode seq.json -o jobs{0}.isr --iso 0 --tag run=same --jobs {0}", jobs));
  EXPECT_GT(bytes("jobs1.isr"), 1000u);
  EXPECT_EQ(content("jobs1.isr"), content("jobs2.isr"));
  EXPECT_EQ(content("jobs1.isr"), content("jobs4.isr"));
  ok("isoreel decode jobs1.isr -o one/%d.ply --jobs 1 && isoreel decode jobs1.isr -o four/%d.ply --jobs 4");
  ok("diff -r one four");
}

TEST_F(RoundTripTest, PipesGiveWhatFilesGive) {
  sequence();
  ok("isoreel encode seq.json -o seq.isr --iso 0");
  ok("isoreel decode seq.isr -o file/%05d.ply");
  ok("cat seq.isr | isoreel decode - -o pipe/%05d.ply");
  ok("isoreel decode - -o redirected/%05d.ply < seq.isr");
  EXPECT_EQ(list("file").size(), 8u);
  ok("diff -r file pipe && diff -r file redirected");
  ok("cat seq.isr | isoreel verify -");
  auto from_pipe = json("cat seq.isr | isoreel info - --frames --packets --json");
  auto from_file = json("isoreel info seq.isr --frames --packets --json");
  for (const char* key : {"uuid", "frames", "frame_list", "packet_list", "tags", "grid", "seconds"})
    EXPECT_EQ(from_pipe[key], from_file[key]) << key;
  EXPECT_EQ(from_pipe["bytes"], nullptr);
  ok("cat seq.isr | isoreel render - -o pipe.png --size 32x24 --frames 2");
  ok("isoreel render seq.isr -o file.png --size 32x24 --frames 2");
  EXPECT_EQ(content("pipe.png"), content("file.png"));
}

TEST_F(RoundTripTest, CompareFindsTheDistanceThatIsThere) {
  balls("here", 25, {{{12.1, 11.9, 12.2}, 7}});
  constexpr double kMoved = 0.75;
  balls("moved", 25, {{{12.1 + kMoved, 11.9, 12.2}, 7}});
  ok("isoreel encode here.json -o here.isr --iso 0");
  const std::string options = " --samples 20000 --json";
  const auto same = json("isoreel compare here.isr here.json" + options);
  EXPECT_EQ(same["frames"], 1);
  EXPECT_LT(same["extracted"]["rms"], 0.04);
  EXPECT_LT(same["extracted"]["max"], 0.15);
  EXPECT_LT(same["volume"]["rms"], 0.06);
  EXPECT_LT(same["volume"]["max"], 0.3);
  EXPECT_GT(same["volume"]["rms"], 0.0);
  const auto moved = json("isoreel compare here.isr moved.json" + options);
  for (const char* against : {"volume", "extracted"}) {
    EXPECT_NEAR(moved[against]["rms"].get<double>(), kMoved / std::sqrt(3.0), 0.05) << against;
    EXPECT_NEAR(moved[against]["max"].get<double>(), kMoved, 0.2) << against;
    EXPECT_EQ(keys(moved["frame_list"][0][against]),
              (std::set<std::string>{"rms", "max", "forward", "backward"}));
  }
  EXPECT_EQ(json("isoreel compare here.isr here.json" + options), same);  // the same samples every time
}

TEST_F(RoundTripTest, AFinerStepIsCloserAndLarger) {
  balls("ball", 25, {{{12.1, 11.9, 12.2}, 8}});
  double error = 1e9;
  std::uintmax_t size = 0;
  for (const char* step : {"1/2", "1/8", "0.03125"}) {
    ok(fmt::format("isoreel encode ball.json -o ball.isr --iso 0 --force --step {}", step));
    const double rms = json("isoreel compare ball.isr ball.json --samples 2000 --json")["extracted"]["rms"];
    EXPECT_LT(rms, error) << step;
    EXPECT_GT(bytes("ball.isr"), size) << step;
    error = rms;
    size = bytes("ball.isr");
  }
}

TEST_F(RoundTripTest, CompareRefusesVolumesThatDoNotBelongToTheFile) {
  sequence();
  balls("small", 17, {{{8, 8, 8}, 4}});
  ok("isoreel encode seq.json -o seq.isr --iso 0");
  fails("isoreel compare seq.isr small.json", 1, "small.raw");
  fails("isoreel compare seq.isr step_00.json step_01.json", 1, "8 frames");
  fails("isoreel compare seq.isr seq.json --frames 8", 2, "--frames");
}

}  // namespace
}  // namespace isoreel::cli
