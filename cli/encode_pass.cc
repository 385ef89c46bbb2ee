// SPDX-License-Identifier: BSD-3-Clause
#include "encode_pass.h"

#include <fmt/format.h>

#include "facts.h"
#include "parallel.h"
#include "progress.h"
#include "step_search.h"

namespace isoreel::cli {
namespace {

constexpr double kFull = 0.985;  // of the length asked for: near enough

/// Takes a file's bytes, and counts them.
class CountingSink final : public ByteSink {
 public:
  Status append(ByteSpan) override { return {}; }
  Status commit() override { return {}; }
  void discard() override {}
  std::string name() const override { return "the length of the file"; }
};

}  // namespace

void EncodeTotals::add(const CodedFrame& frame, const std::string& track) {
  const FrameHeader& header = frame.packet.header;
  ++frames;
  predicted += header.type == PacketType::kPredicted;
  vertices += header.vertices;
  sizes.signs += frame.sizes.signs;
  sizes.motion += frame.sizes.motion;
  sizes.vertices += frame.sizes.vertices;
  list.push_back({{"number", header.number},
                  {"type", header.type == PacketType::kPredicted ? "P" : "I"},
                  {"vertices", header.vertices},
                  {"bytes",
                   {{"total", frame.packet.data.size()},
                    {"signs", frame.sizes.signs},
                    {"motion", frame.sizes.motion},
                    {"vertices", frame.sizes.vertices},
                    {"other", frame.sizes.other}}}});
  if (!track.empty()) list.back()["track"] = track;
  if (header.error_kind == ErrorKind::kNone) return;
  error_kind = header.error_kind;
  error_squares += std::pow(static_cast<double>(header.error_rms), 2) * header.vertices;
  error_max = std::max(error_max, static_cast<double>(header.error_max));
  list.back()["error"] = errorJson(header.error_kind, static_cast<double>(header.error_rms),
                                   static_cast<double>(header.error_max));
}

Status EncodePass::run(EncodeTarget& to, std::uint32_t step, const std::string& name, EncodeTotals& totals,
                       std::unique_ptr<ByteSink> instead) const {
  const bool for_good = instead == nullptr;
  EncoderSettings settings = job.settings;
  settings.configuration.step = step;
  ISOREEL_ASSIGN(const Encoder encoder, Encoder::create(settings));
  if (Status begun = to.begin(encoder.configuration(), encoder.configurationRecord(), job.tracks, tags,
                              tags_given, std::move(instead));
      !begun.ok()) {
    to.giveUp(0);
    return begun;
  }
  Progress progress(name, job.frameCount());
  const Status status = EncodeRun(job).run(
      step,
      [&](const CodedFrame& frame, std::size_t track) -> Status {
        ISOREEL_TRY(to.writer().write(frame.packet, job.tracks[track].id));
        totals.add(frame, job.tracks[track].name);
        progress.advance();
        return {};
      },
      [&] { return to.writer().endGop(); });
  if (!status.ok() && for_good)
    return {status.error().code, std::string(status.message()) + to.giveUp(totals.frames)};
  return status.ok() ? to.finish() : status;
}

Result<std::uint32_t> stepForSize(const EncodePass& pass, std::uint64_t wanted) {
  const auto size = static_cast<double>(wanted);
  StepSearch search(kFull * size, size, -0.5);
  double bytes = 0;
  int number = 0;
  while (const auto step = search.next()) {
    EncodeTarget target(pass.target);
    EncodeTotals totals;
    ISOREEL_TRY(
        pass.run(target, *step, fmt::format("try {}", ++number), totals, std::make_unique<CountingSink>()));
    bytes = static_cast<double>(target.bytesAdded());
    search.add(*step, bytes);
  }
  if (const auto best = search.best()) return *best;
  return {ErrorCode::kInvalidArgument,
          fmt::format("{}: {:.0f} bytes with a step of a whole cell, so --size {} cannot be kept",
                      pass.target.output, bytes, wanted)};
}

Result<double> cellForError(const EncodePass& pass, EncodeJob& job) {
  const FrameRange whole = job.range;
  job.range.end = std::min(whole.end, whole.begin - whole.begin % job.settings.gop + job.settings.gop);
  double best = 1;
  std::uint64_t fewest = 0;
  for (const double cell : {1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0}) {
    job.settings.cell = cell;
    EncodeTarget target(pass.target);
    EncodeTotals totals;
    const Status tried = pass.run(target, job.settings.configuration.step, fmt::format("cells of {:g}", cell),
                                  totals, std::make_unique<CountingSink>());
    if (interrupted || (!tried.ok() && cell == 1)) return tried;
    if (!tried.ok() || (cell > 1 && target.bytesAdded() >= fewest)) break;  // nor would larger ones do
    best = cell;
    fewest = target.bytesAdded();
  }
  job.range = whole;
  return best;
}

}  // namespace isoreel::cli
