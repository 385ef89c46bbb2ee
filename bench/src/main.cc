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
#include <isoreel/codec/decoder.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iostream>
#include <map>

#include "coder.h"
#include "measure.h"
#include "parallel.h"
#include "sequence.h"

namespace isoreel::bench {
namespace {

constexpr std::size_t kDistanceSamples = 100'000;

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
    PacketSizes parts;
    for (const Frame& frame : sequence_.frames) {
      coder.prepare(frame);
      ISOREEL_TRY(coder.encode());
      bytes += coder.bytes();
      parts.signs += coder.parts().signs;
      parts.vertices += coder.parts().vertices;
      parts.other += coder.parts().other;
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
    Json result{{"coder", label.coder},
                {"variant", label.variant},
                {"parameter", label.parameter},
                {"bytes", bytes},
                {"rms_extracted", std::sqrt(known->second.extracted)},
                {"rms_volume", std::sqrt(known->second.volume)},
                {"encode_vertices_per_second", sampled_vertices_ / encode.seconds},
                {"decode_vertices_per_second", sampled_vertices_ / decode.seconds},
                {"encode_peak_bytes", encode.peak_bytes},
                {"decode_peak_bytes", decode.peak_bytes}};
    if (parts.signs != 0)
      result["parts"] = {{"signs", parts.signs}, {"vertices", parts.vertices}, {"other", parts.other}};
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

  /// Isoreel with whole frames side by side on so many threads, as the command line does it, by the clock on
  /// the wall.
  Result<Json> throughput(std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const auto& frames = sequence_.frames;
    std::vector<Bytes> packets(frames.size());
    std::vector<Status> statuses(frames.size());
    const auto all = [&](const std::function<Status(std::size_t)>& work) {
      parallelFor(frames.size(), [&](std::size_t i) { statuses[i] = work(i); });
      for (const Status& status : statuses) ISOREEL_TRY(status);
      return Status();
    };
    const auto encode = [&](std::size_t i) -> Status {
      ISOREEL_ASSIGN(Encoder encoder, Encoder::create({.configuration = sequence_.configuration}));
      ISOREEL_ASSIGN(Packet packet, encoder.encode(frames[i].volume, {.isovalue = frames[i].isovalue}));
      packets[i] = std::move(packet.data);
      return {};
    };
    const auto decode = [&](std::size_t i) -> Status { return Decoder().decode(packets[i]).status(); };
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

Coders codersFor(const Json& job, const Sequence& sequence) {
  const auto list = [&](const char* key) { return job.value(key, std::vector<double>{}); };
  Coders coders;
  for (const double step : list("steps"))
    coders.push_back(isoreelCoder(sequence.configuration, static_cast<std::uint32_t>(step)));
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
    ISOREEL_ASSIGN(result["throughput"].emplace_back(), bench.throughput(threads));
  }
  for (const auto& coder : codersFor(job, sequence)) {
    const Label label = coder->label();
    std::cerr << label.coder << ' ' << label.variant << ' ' << label.parameter << '\n';
    Result<Json> point = bench.point(*coder);
    if (!point) return point.status().at(label.coder + " " + label.variant);
    result["points"].push_back(*std::move(point));
  }
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
