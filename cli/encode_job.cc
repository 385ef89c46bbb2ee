// SPDX-License-Identifier: BSD-3-Clause
#include "encode_job.h"

#include <fmt/format.h>
#include <isoreel/codec/decoder.h>
#include <isoreel/inspect/distance.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "parallel.h"
#include "step_search.h"

namespace isoreel::cli {
namespace {

constexpr double kNearEnough = 0.97;  // of the limit: a larger step would save next to nothing

}  // namespace

/// On its way through the encoder: frames [begin, end) of the volumes or isovalues, of one track.
struct EncodeRun::Gop {
  std::uint64_t begin = 0, end = 0;
  std::size_t track = 0;
  std::vector<CodedFrame> frames;
  Status status;  // why there are fewer
};

/// The frame that is furthest from its isosurface.
struct EncodeRun::Worst {
  std::uint64_t frame = 0;
  double rms = -1;  // cells; infinite when one of the two has no surface
};

Result<std::shared_ptr<const Volume>> EncodeRun::volumeAt(std::size_t index) {
  const std::lock_guard lock(reading_);
  if (only_) return only_;
  ISOREEL_ASSIGN(Volume volume, job_.volumes->read(index));
  auto shared = std::make_shared<const Volume>(std::move(volume));
  if (job_.volumes->size() == 1) only_ = shared;
  return shared;
}

/// All frames of the GOP, as far as they go. Where there is a thread for it, each is read and prepared while
/// the one before it is coded.
Status EncodeRun::encode(Gop& gop, std::uint32_t step) {
  gop.frames.clear();
  EncoderSettings settings = job_.settings;
  settings.configuration.step = step;
  ISOREEL_ASSIGN(Encoder encoder, Encoder::create(settings));
  struct Ahead {
    PreparedFrame frame;
    std::shared_ptr<const Volume> volume;
    Status status;
  };
  std::array<Ahead, 2> ahead;
  const auto indexOf = [&](std::uint64_t frame) {
    return job_.volumes->size() == 1 ? 0 : static_cast<std::size_t>(frame);
  };
  const auto numberOf = [&](std::uint64_t frame) {
    return job_.tracks[gop.track].number + frame - job_.range.begin;
  };
  const auto prepare = [&](std::uint64_t frame, Ahead& to) -> Status {
    if (interrupted) return {ErrorCode::kIo, "interrupted"};
    to.volume = nullptr;
    ISOREEL_ASSIGN(to.volume, volumeAt(indexOf(frame)));
    const FrameTiming timing{job_.shard ? frame : numberOf(frame), job_.times.times[frame],
                             job_.times.durations[frame], job_.isovalues[gop.track][frame]};
    return encoder.prepare(*to.volume, timing, to.frame).at(job_.volumes->name(indexOf(frame)));
  };
  const auto code = [&](std::uint64_t frame, Ahead& from) -> Status {
    CodedFrame coded;
    Result<Packet> packet = encoder.encode(from.frame, &coded.sizes);
    from.volume = nullptr;
    if (!packet) return packet.status().at(job_.volumes->name(indexOf(frame)));
    coded.packet = *std::move(packet);
    coded.packet.header.number = numberOf(frame);
    gop.frames.push_back(std::move(coded));
    return {};
  };
  const bool side_by_side = threadCount(job_.jobs) > 1;
  for (std::uint64_t frame = gop.begin; frame < gop.end; ++frame) {
    Ahead &now = ahead[side_by_side ? frame % 2 : 0], &next = ahead[(frame + 1) % 2];
    if (!side_by_side || frame == gop.begin) now.status = prepare(frame, now);
    ISOREEL_TRY(now.status);
    if (side_by_side && frame + 1 < gop.end) {
      Status coded;
      parallelWithin(2, [&](std::size_t i) {
        if (i == 0) {
          coded = code(frame, now);
        } else {
          next.status = prepare(frame + 1, next);
        }
      });
      ISOREEL_TRY(coded);
    } else {
      ISOREEL_TRY(code(frame, now));
    }
  }
  return {};
}

/// Tells each frame's distance in its header.
Result<EncodeRun::Worst> EncodeRun::measureAll(Gop& gop) {
  Decoder decoder(parallelWithin);
  Worst worst;
  for (std::size_t i = 0; i < gop.frames.size(); ++i) {
    if (interrupted) return {ErrorCode::kIo, "interrupted"};
    Packet& packet = gop.frames[i].packet;
    const auto frame = static_cast<std::size_t>(gop.begin) + i;
    const std::size_t index = job_.volumes->size() == 1 ? 0 : frame;
    ISOREEL_ASSIGN(const Surface decoded, decoder.decode(packet.data));  // as anybody will see it
    ISOREEL_ASSIGN(const std::shared_ptr<const Volume> volume, volumeAt(index));
    const inspect::Mesh mesh = inspect::meshOf(decoded, volume->grid);
    const inspect::Mesh wanted = inspect::volumeIsosurface(*volume, job_.isovalues[gop.track][frame],
                                                           job_.settings.configuration.inside);
    double cell = 1;  // of the volume's, in the mean
    for (std::size_t k = 0; k < 3; ++k)
      cell *= std::cbrt(static_cast<double>(volume->grid.nodes[k] - 1) / (decoded.grid.nodes[k] - 1));
    const inspect::Distance found =
        inspect::distance(mesh, wanted, inspect::samplesFor(mesh, wanted), parallelFor).symmetric;
    if (found.rms > worst.rms) worst = {frame, found.rms};
    if (!std::isfinite(found.rms)) continue;
    packet.header.error_kind = ErrorKind::kVolume;
    packet.header.error_rms = static_cast<float>(found.rms / cell);  // cells of the file's grid
    packet.header.error_max = static_cast<float>(found.max / cell);
  }
  return worst;
}

/// With the largest step at which no frame is further than `limit` from its isosurface, nearly.
Status EncodeRun::encodeWithin(Gop& gop, double limit) {
  StepSearch search(kNearEnough * limit, limit, 0.5);
  std::vector<CodedFrame> best;
  std::string last;  // of the steps tried; where none will do, that is the finest
  while (const auto step = search.next()) {
    const Status status = encode(gop, *step);
    const Result<Worst> worst = status.ok() ? measureAll(gop) : Result<Worst>(status);
    if (!worst) {
      gop.frames.clear();
      return worst.status();
    }
    search.add(*step, worst->rms);
    last = fmt::format("frame {} is {:.4f} cells RMS from the volume's isosurface with a step of 1/{}",
                       worst->frame, worst->rms, kCell / static_cast<std::int32_t>(*step));
    if (search.best() == step) best = std::move(gop.frames);
  }
  gop.frames = std::move(best);
  if (gop.frames.empty())
    return {ErrorCode::kInvalidArgument,
            fmt::format("{}: --max-error {:g} cannot be kept on this grid", last, limit)};
  return {};
}

Status EncodeRun::run(std::uint32_t step, const std::function<Status(const CodedFrame&, std::size_t)>& write,
                      const std::function<Status()>& end) {
  std::uint64_t next = job_.range.begin;
  std::size_t next_track = 0;
  // GOPs are closed: each has an encoder of its own. They begin where those of a whole encode do. Those of
  // several tracks take turns.
  const auto begin = [&](Gop& gop) -> Result<bool> {
    const std::uint64_t length = job_.settings.gop;
    gop.begin = next;
    gop.end = std::min<std::uint64_t>(next - next % length + length, job_.range.end);
    gop.track = next_track++;
    if (next_track == job_.tracks.size()) {
      next_track = 0;
      next = gop.end;
    }
    return gop.begin < gop.end;
  };
  const auto work = [&](Gop& gop) -> Status {
    if (job_.error.limit) {
      gop.status = encodeWithin(gop, *job_.error.limit);
    } else {
      gop.status = encode(gop, step);
      if (gop.status.ok() && job_.error.measure) gop.status = measureAll(gop).status();
    }
    return {};
  };
  std::uint64_t written = 0;
  const auto out = [&](Gop& gop) -> Status {
    for (const CodedFrame& frame : gop.frames) {
      ISOREEL_TRY(write(frame, gop.track));
      ++written;
    }
    ISOREEL_TRY(end());
    return gop.status;
  };
  ISOREEL_TRY(forEachFrame<Gop>(job_.jobs, begin, work, out));
  if (written < job_.frameCount()) return {ErrorCode::kIo, "interrupted"};
  return {};
}

}  // namespace isoreel::cli
