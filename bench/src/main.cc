// SPDX-License-Identifier: BSD-3-Clause
// Measures Isoreel and other coders on one set, and prints JSON. bench/run.py calls it, and makes tables and
// plots.
//
//   isoreel_bench JOB.json
//
// The job is a set (sequence.h) with "steps": Isoreel's quantiser steps, in 1/16384 of a cell; "speeds" and
// "bits": Draco's; "meshopt_bits"; "precisions": OpenCTM's, in cells; "tolerances": zfp's, times the samples'
// contrast at the surface; "runs": timings are medians of so many; "samples": distances and timings are of so
// many frames, evenly spread. A list that is not there leaves a coder out.
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iostream>
#include <map>

#include "coder.h"
#include "isoreel_coder.h"
#include "measure.h"
#include "parallel.h"
#include "sequence.h"

namespace isoreel::bench {
namespace {

constexpr std::size_t kDistanceSamples = 100'000;
constexpr std::size_t kGop = 5;                 // frames, where GOPs go side by side
constexpr std::uint32_t kWholeSequence = 1000;  // frames, everywhere else

struct Distances {
  double extracted = 0, volume = 0;  // mean squares over the frames looked at, in cells
};

/// A frame that is looked at closely, with what the decoded meshes are held against.
struct Sample {
  const Frame* frame;
  inspect::Mesh isosurface;
};

class Bench {
 public:
  Bench(const Sequence& sequence, int runs, std::size_t samples) : sequence_(sequence), runs_(runs) {
    samples = std::clamp<std::size_t>(samples, 1, sequence.frames.size());
    for (std::size_t i = 0; i < samples; ++i) {
      const Frame& frame = sequence.frames[(2 * i + 1) * sequence.frames.size() / (2 * samples)];
      samples_.push_back({&frame, inspect::volumeIsosurface(frame.volume, frame.isovalue, frame.inside)});
      sampled_vertices_ += static_cast<double>(frame.extracted.points.size());
    }
  }

  std::size_t sampleCount() const { return samples_.size(); }

  /// Bytes of all frames; distances, times and memory of the sampled ones.
  Result<Json> point(Coder& coder) {
    std::size_t bytes = 0;
    for (const Frame& frame : sequence_.frames) {
      coder.prepare(frame);
      ISOREEL_TRY(coder.encode());
      bytes += coder.bytes();
    }
    const Label label = coder.label();
    // A coder's parameter alone decides what its meshes look like.
    const auto [known, is_new] = distances_.try_emplace({label.coder, label.parameter});
    Cost encode, decode;
    for (const Sample& sample : samples_) {
      coder.prepare(*sample.frame);
      ISOREEL_TRY(add(encode, [&] { return coder.encode(); }));
      ISOREEL_TRY(add(decode, [&] { return coder.decode(); }));
      if (is_new) addDistances(known->second, coder.mesh(), sample);
    }
    return pointJson(label, bytes, known->second, encode, decode, sampled_vertices_);
  }

  /// Isoreel: bytes, times and memory of all frames, distances of the sampled ones.
  Result<Json> point(IsoreelCoder& coder) const {
    ISOREEL_ASSIGN(const Cost encode, measure(1, [&] { return coder.encode(sequence_.frames); }));
    ISOREEL_ASSIGN(const Cost decode, measure(runs_, [&] { return coder.decode(); }));
    Distances distances;
    ISOREEL_TRY(coder.decode([&](std::size_t frame, const Surface& surface) {
      for (const Sample& sample : samples_) {
        if (sample.frame == &sequence_.frames[frame])
          addDistances(distances, inspect::meshOf(surface), sample);
      }
    }));
    Json result = pointJson(coder.label(), coder.bytes(), distances, encode, decode,
                            static_cast<double>(sequence_.vertices()));
    const PacketSizes& parts = coder.parts();
    result["parts"] = {{"signs", parts.signs},
                       {"motion", parts.motion},
                       {"vertices", parts.vertices},
                       {"other", parts.other}};
    return result;
  }

  /// Dual contouring alone: what mesh coders need before they start.
  Result<double> extractedPerSecond() const {
    Cost sum;
    for (const auto& [frame, isosurface] : samples_) {
      ISOREEL_TRY(
          add(sum, [&] { return extractSurface(frame->volume, frame->isovalue, frame->inside).status(); }));
    }
    return sampled_vertices_ / sum.seconds;
  }

  /// Isoreel with whole GOPs side by side on so many threads, as the command line does it, by the clock on
  /// the wall.
  Result<Json> throughput(std::size_t threads, const EncoderSettings& settings) const {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const std::span<const Frame> frames = sequence_.frames;
    std::vector<IsoreelCoder> gops((frames.size() + kGop - 1) / kGop, IsoreelCoder("", settings));
    std::vector<Status> statuses(gops.size());
    const auto all = [&](const std::function<Status(std::size_t)>& work) {
      parallelFor(gops.size(), [&](std::size_t i) { statuses[i] = work(i); });
      for (const Status& status : statuses) ISOREEL_TRY(status);
      return Status();
    };
    const auto encode = [&](std::size_t i) {
      return gops[i].encode(frames.subspan(i * kGop, std::min(kGop, frames.size() - i * kGop)));
    };
    const auto decode = [&](std::size_t i) { return gops[i].decode([](std::size_t, const Surface&) {}); };
    std::vector<double> encode_seconds, decode_seconds;
    for (int run = 0; run < runs_; ++run) {
      ISOREEL_ASSIGN(encode_seconds.emplace_back(), wallSeconds([&] { return all(encode); }));
      ISOREEL_ASSIGN(decode_seconds.emplace_back(), wallSeconds([&] { return all(decode); }));
    }
    const double vertices = static_cast<double>(sequence_.vertices());
    return Json{{"threads", threads},
                {"encode_vertices_per_second", vertices / median(encode_seconds)},
                {"decode_vertices_per_second", vertices / median(decode_seconds)}};
  }

 private:
  static Json pointJson(const Label& label, std::size_t bytes, const Distances& distances, const Cost& encode,
                        const Cost& decode, double vertices) {
    return Json{{"coder", label.coder},
                {"variant", label.variant},
                {"parameter", label.parameter},
                {"bytes", bytes},
                {"rms_extracted", std::sqrt(distances.extracted)},
                {"rms_volume", std::sqrt(distances.volume)},
                {"encode_vertices_per_second", vertices / encode.seconds},
                {"decode_vertices_per_second", vertices / decode.seconds},
                {"encode_peak_bytes", encode.peak_bytes},
                {"decode_peak_bytes", decode.peak_bytes}};
  }
  Status add(Cost& sum, const std::function<Status()>& call) const {
    ISOREEL_ASSIGN(const Cost cost, measure(runs_, call));
    sum.seconds += cost.seconds;
    sum.peak_bytes = std::max(sum.peak_bytes, cost.peak_bytes);
    return {};
  }
  void addDistances(Distances& sum, const inspect::Mesh& mesh, const Sample& sample) const {
    const double share = 1.0 / static_cast<double>(samples_.size());
    const auto square = [&](const inspect::Mesh& to) {
      const double rms = inspect::distance(mesh, to, kDistanceSamples, parallelFor).symmetric.rms;
      return rms * rms;
    };
    sum.extracted += share * square(sample.frame->extracted);
    sum.volume += share * square(sample.isosurface);
  }

  const Sequence& sequence_;
  int runs_;
  std::vector<Sample> samples_;
  double sampled_vertices_ = 0;
  std::map<std::pair<std::string, double>, Distances> distances_;
};

/// What Isoreel is measured with: its default, the same for the distance to the extracted mesh, the fast
/// preset, and the method of 2003, which codes every frame by itself.
std::vector<IsoreelCoder> isoreelCoders(const Json& job, const Sequence& sequence) {
  EncoderSettings main;
  main.configuration = sequence.configuration;
  main.frame_types = FrameTypes::kAuto;
  main.gop = kWholeSequence;
  EncoderSettings to_mesh = main, fast = main, classic = main;
  to_mesh.heights.fit = Fit::kExtracted;
  usePreset(Preset::kFast, fast);
  classic.configuration.profile = Profile::kClassic;
  classic.frame_types = FrameTypes::kIntra;
  std::vector<IsoreelCoder> coders;
  for (auto& [variant, settings] : {std::pair{"main", main},
                                    {"main to the mesh", to_mesh},
                                    {"main fast", fast},
                                    {"classic I", classic}}) {
    EncoderSettings at_step = settings;
    for (const double step : job.value("steps", std::vector<double>{})) {
      at_step.configuration.step = static_cast<std::uint32_t>(step);
      coders.emplace_back(variant, at_step);
    }
  }
  return coders;
}

Coders codersFor(const Json& job, const Sequence& sequence) {
  const auto list = [&](const char* key) { return job.value(key, std::vector<double>{}); };
  Coders coders;
  for (const double speed : list("speeds")) {
    for (const double bits : list("bits"))
      coders.push_back(dracoCoder(static_cast<int>(speed), static_cast<int>(bits)));
  }
  for (const double bits : list("meshopt_bits")) coders.push_back(meshoptCoder(static_cast<int>(bits)));
  for (const double precision : list("precisions")) coders.push_back(openctmCoder(precision));
  for (const double tolerance : list("tolerances")) coders.push_back(zfpCoder(tolerance, sequence.contrast));
  return coders;
}

Result<Json> run(const Json& job) {
  ISOREEL_ASSIGN(const Sequence sequence, loadSequence(job));
  const int runs = job.value("runs", 3);
  Bench bench(sequence, runs, job.value("samples", std::size_t{6}));
  std::size_t triangles = 0;
  for (const Frame& frame : sequence.frames) triangles += frame.extracted.triangles.size();
  Json result{{"frames", sequence.frames.size()},
              {"nodes", sequence.configuration.grid.nodes},
              {"vertices", sequence.vertices()},
              {"triangles", triangles},
              {"contrast", sequence.contrast},
              {"sampled_frames", bench.sampleCount()},
              {"runs", runs},
              {"throughput", Json::array()},
              {"points", Json::array()}};
  ISOREEL_ASSIGN(result["extracted_vertices_per_second"], bench.extractedPerSecond());
  for (const std::size_t threads : {1u, 2u}) {
    EncoderSettings settings;
    settings.configuration = sequence.configuration;
    settings.frame_types = FrameTypes::kAuto;
    ISOREEL_ASSIGN(result["throughput"].emplace_back(), bench.throughput(threads, settings));
  }
  const auto measured = [&](const Label& label, auto& coder) -> Status {
    std::cerr << label.coder << ' ' << label.variant << ' ' << label.parameter << '\n';
    Result<Json> point = bench.point(coder);
    if (!point) return point.status().at(label.coder + " " + label.variant);
    result["points"].push_back(*std::move(point));
    return {};
  };
  for (IsoreelCoder& coder : isoreelCoders(job, sequence)) ISOREEL_TRY(measured(coder.label(), coder));
  for (const auto& coder : codersFor(job, sequence)) ISOREEL_TRY(measured(coder->label(), *coder));
  return result;
}

}  // namespace
}  // namespace isoreel::bench

int main(int argc, char** argv) {
  using namespace isoreel::bench;
  if (argc != 2) {
    std::cerr << "usage: isoreel_bench JOB.json\n";
    return 2;
  }
  try {
    std::ifstream file(argv[1]);
    const auto result = run(Json::parse(file));
    if (result) {
      std::cout << result->dump(1) << '\n';
      return 0;
    }
    std::cerr << "isoreel_bench: " << result.error().message << '\n';
  } catch (const std::exception& error) {
    std::cerr << "isoreel_bench: " << error.what() << '\n';
  }
  return 1;
}
