// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/codec/encoder.h>

#include <cmath>
#include <new>
#include <optional>

#include "encode/facts.h"
#include "encode/frame_coder.h"
#include "encode/height_coder.h"
#include "extract/coarser.h"
#include "extract/dual_contouring.h"
#include "lattice/dual_mesh.h"
#include "lattice/sheets.h"
#include "syntax/packet.h"

namespace isoreel {
namespace {

// A vertex may slide on the surface: its tangential steps are larger. At equal distance to the extracted
// mesh, 3 took about 5 % off the vertex bits of 2 on droplets, splash and head scan; to the volume's
// isosurface more.
constexpr std::uint32_t kTangentialRatio = 3;
// P frames predict tangential components well: at 1.5 times these steps their vertices are as far from the
// extractor's as those of I frames (0.037 and 0.037 cells on droplets, 0.051 and 0.050 on the splash).
constexpr std::uint32_t kPredictedTangentialRatio = 9;  // halves
// Where profile main weighs the rate, many residuals are smaller than the nearest: a finer step makes up for
// it, at fewer bits.
constexpr double kWeighedStep = 0.7;

// A predicted frame with less than this part of the bytes a vertex that the last one took by itself is the
// smaller one.
constexpr double kNoDoubt = 0.95;

/// Squared distances of decoded vertices from the extractor's, in cells squared.
struct Errors {
  double mean = 0, largest = 0;
};

Errors errorsOf(std::span<const std::array<std::int32_t, 3>> decoded,
                std::span<const std::array<std::int32_t, 3>> vertices) {
  Errors errors;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    double square = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double error = static_cast<double>(decoded[i][k] - vertices[i][k]) / kCell;
      square += error * error;
    }
    errors.mean += square;
    errors.largest = std::max(errors.largest, square);
  }
  if (!vertices.empty()) errors.mean /= static_cast<double>(vertices.size());
  return errors;
}

/// Bytes that a frame of so many vertices would take more at the error that is wanted: a bit for each
/// component halves it.
double bytesToReach(const Errors& wanted, const Errors& reached, std::size_t vertices) {
  if (reached.mean <= wanted.mean || wanted.mean == 0) return 0;
  return 3.0 / 8 * static_cast<double>(vertices) * std::log2(reached.mean / wanted.mean) / 2;
}

}  // namespace

/// Its parts know each other: it stays where it is.
struct PreparedFrame::State {
  FrameTiming timing;
  SignBitmap bitmap;
  std::vector<Cell> active;  // cells
  std::vector<Cell> cells;   // the vertices': these, or their sheets
  // The extractor's, or none, where heights are chosen without knowing them.
  std::vector<std::array<std::int32_t, 3>> vertices;
  CellIndex index;
  std::optional<FrameInput> input;
  // Profile main.
  HeightFrame heights;
  std::optional<VolumeField> field;  // none: the volume is not known
  std::optional<HeightCoder> coder;
};

PreparedFrame::PreparedFrame() : state_(std::make_unique<State>()) {}
PreparedFrame::PreparedFrame(PreparedFrame&&) noexcept = default;
PreparedFrame& PreparedFrame::operator=(PreparedFrame&&) noexcept = default;
PreparedFrame::~PreparedFrame() = default;

struct Encoder::State {
  using Prepared = PreparedFrame::State;

  EncoderSettings settings;  // the grid is the one that is coded
  std::array<std::uint32_t, 3> volume_nodes{};
  Bytes record;
  // The GOP so far.
  std::uint64_t key = 0;
  std::optional<std::uint64_t> last;  // number of the frame coded last; none: the next frame starts a GOP
  Reference reference;
  PacketModels models;
  double intra_rate = 0;  // bytes a vertex of the frame that was coded by itself last
  PreparedFrame only;     // of callers that have none of their own

  /// What `code` gives, or that there is no memory for it.
  template <class Code>
  static auto guarded(const FrameTiming& timing, const Code& code) -> decltype(code()) {
    try {
      return code();
    } catch (const std::bad_alloc&) {
      return Status(ErrorCode::kLimit,
                    "frame " + std::to_string(timing.number) + ": takes more memory to encode than there is");
    }
  }
  bool main() const { return settings.configuration.profile == Profile::kMain; }
  Status prepare(const Volume& volume, Prepared& frame) const;
  Status prepareAgain(const Surface& surface, std::span<const Cell> cells, bool filled,
                      Prepared& frame) const;
  /// What follows from its cells and vertices. `volume`: what they are from; null when that is not known.
  void finish(const Volume* volume, Prepared& frame) const;
  /// The vertices' cells: the active ones, or their sheets.
  std::vector<Cell> verticesOf(std::span<const Cell> active) const {
    std::vector<Cell> cells(active.begin(), active.end());
    if ((settings.configuration.tools & kToolSheets) == 0) return cells;
    CellIndex index;
    index.build(active);
    return splitSheets(std::move(cells), index);
  }
  Result<Packet> code(Prepared& frame, PacketSizes* sizes);
};

void usePreset(Preset preset, EncoderSettings& settings) {
  settings.motion.range = preset == Preset::kFast ? 0 : MotionSettings{}.range;
  settings.motion.every = preset == Preset::kFast ? 2 : MotionSettings{}.every;
  settings.motion.block_log2 =
      preset == Preset::kBest ? MotionSettings::kAnySize : MotionSettings{}.block_log2;
  settings.heights.refine = preset != Preset::kFast;
}

Encoder::Encoder(std::unique_ptr<State> state) : state_(std::move(state)) {}
Encoder::Encoder(Encoder&&) noexcept = default;
Encoder& Encoder::operator=(Encoder&&) noexcept = default;
Encoder::~Encoder() = default;

Result<Encoder> Encoder::create(EncoderSettings settings) {
  ISOREEL_TRY(checkGrid(settings.configuration.grid));
  if (!(settings.cell >= 1 && settings.cell <= kMaxCell))
    return {ErrorCode::kInvalidArgument, "coded cells are 1 to 64 times as large as the volumes'"};
  if (settings.gop < 1) return {ErrorCode::kInvalidArgument, "a GOP has one frame at least"};
  const std::uint32_t block = settings.motion.block_log2;
  if (block != MotionSettings::kAnySize && (block < 2 || block > 5))
    return {ErrorCode::kInvalidArgument, "motion blocks have 4, 8, 16 or 32 cells a side (spec codec 8.1)"};
  const bool predicts = settings.frame_types == FrameTypes::kAuto && settings.gop > 1;
  const bool main = settings.configuration.profile == Profile::kMain;
  if (!main) settings.configuration.slices = {};
  settings.configuration.tools = (predicts ? kToolPrediction : 0) |
                                 (main && settings.heights.neighbours ? kToolNeighbours : 0) |
                                 (main && settings.heights.mixed_signs ? kToolMixedSigns : 0) |
                                 (main && settings.heights.sheets ? kToolSheets : 0) |
                                 (main && settings.configuration.slices.most > 1 ? kToolSlices : 0);
  auto state = std::make_unique<State>();
  state->volume_nodes = settings.configuration.grid.nodes;
  settings.configuration.grid = coarserGrid(settings.configuration.grid, settings.cell);
  ISOREEL_ASSIGN(Bytes record, writeConfiguration(settings.configuration));
  state->settings = std::move(settings);
  state->record = std::move(record);
  return Encoder(std::move(state));
}

const Configuration& Encoder::configuration() const { return state_->settings.configuration; }
const Bytes& Encoder::configurationRecord() const { return state_->record; }

Status Encoder::prepare(const Volume& volume, const FrameTiming& timing, PreparedFrame& frame) const {
  frame.state_->timing = timing;
  return State::guarded(timing, [&] { return state_->prepare(volume, *frame.state_); });
}

Result<Packet> Encoder::encode(PreparedFrame& frame, PacketSizes* sizes) {
  const FrameTiming timing = frame.state_->timing;
  Result<Packet> packet = State::guarded(timing, [&] { return state_->code(*frame.state_, sizes); });
  if (!packet.ok()) state_->last.reset();
  frame.state_->coder.reset();  // large, and of no use to the next frame
  return packet;
}

Result<Packet> Encoder::encode(const Volume& volume, const FrameTiming& timing, PacketSizes* sizes) {
  if (Status status = prepare(volume, timing, state_->only); !status.ok()) {
    if (status.error().code == ErrorCode::kLimit) state_->last.reset();
    return status;
  }
  return encode(state_->only, sizes);
}

Result<Packet> Encoder::encodeAgain(const Surface& surface, std::span<const Cell> cells, bool filled,
                                    const FrameTiming& timing, PacketSizes* sizes) {
  State::Prepared& frame = *state_->only.state_;
  frame.timing = timing;
  ISOREEL_TRY(State::guarded(timing, [&] { return state_->prepareAgain(surface, cells, filled, frame); }));
  ISOREEL_ASSIGN(Packet packet, encode(state_->only, sizes));
  packet.header.error_kind = ErrorKind::kNone;  // what the surface was made from is not known here
  packet.header.error_rms = packet.header.error_max = 0;
  return packet;
}

Status Encoder::State::prepare(const Volume& volume, Prepared& frame) const {
  const FrameTiming& timing = frame.timing;
  const Grid& grid = settings.configuration.grid;
  if (volume.grid.nodes != volume_nodes) {
    return {ErrorCode::kInvalidArgument,
            "frame " + std::to_string(timing.number) + ": its grid differs in size from the sequence's"};
  }
  if (volume.samples.size() != volume.grid.nodeCount()) {
    return {ErrorCode::kInvalidArgument,
            "frame " + std::to_string(timing.number) + ": fewer or more samples than its grid has nodes"};
  }
  if (!std::isfinite(timing.isovalue)) return {ErrorCode::kInvalidArgument, "the isovalue is not finite"};

  const bool coarser = grid.nodes != volume_nodes;
  if (coarser && settings.non_finite == NonFinite::kRefuse) {
    ISOREEL_TRY(SignBitmap::make(volume, timing.isovalue, settings.configuration.inside, settings.non_finite,
                                 settings.parallel)
                    .status());
  }
  const Volume lattice = coarser ? resampled(volume, grid, settings.parallel) : volume;
  ISOREEL_ASSIGN(frame.bitmap, SignBitmap::make(lattice, timing.isovalue, settings.configuration.inside,
                                                settings.non_finite, settings.parallel));
  frame.active = frame.bitmap.activeCells(settings.parallel);
  frame.cells = verticesOf(frame.active);
  if (frame.cells.size() > 0xFFFFFFFFu / 4)
    return {ErrorCode::kLimit, "the surface has more than 2^30 vertices (spec codec 3.1)"};
  frame.vertices.clear();
  if (!main() || settings.heights.fit == Fit::kExtracted)
    frame.vertices =
        placeVertices(lattice, timing.isovalue, frame.cells, settings.placement, settings.parallel);
  finish(&volume, frame);
  return {};
}

Status Encoder::State::prepareAgain(const Surface& surface, std::span<const Cell> cells, bool filled,
                                    Prepared& frame) const {
  const FrameTiming& timing = frame.timing;
  const Grid& grid = settings.configuration.grid;
  if (surface.grid.nodes != grid.nodes || cells.size() != surface.vertices.size()) {
    return {ErrorCode::kInvalidArgument, "frame " + std::to_string(timing.number) +
                                             ": its grid or its cells are not those of the surface"};
  }
  std::vector<std::array<std::int32_t, 3>>& vertices = frame.vertices;
  vertices.resize(cells.size());
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const std::array<std::int32_t, 3> corner{cells[i].x, cells[i].y, cells[i].z};
    for (std::size_t k = 0; k < 3; ++k) {
      vertices[i][k] = surface.vertices[i][k] - corner[k] * kCell;
      if (corner[k] + 1 >= static_cast<std::int32_t>(grid.nodes[k]) || vertices[i][k] < 0 ||
          vertices[i][k] > kCell) {
        return {ErrorCode::kInvalidArgument, "frame " + std::to_string(timing.number) + ": vertex " +
                                                 std::to_string(i) + " is not in its cell of the grid"};
      }
    }
  }
  frame.active = uniteSheets(cells);
  frame.cells = verticesOf(frame.active);
  if (!std::equal(frame.cells.begin(), frame.cells.end(), cells.begin(), cells.end(),
                  [](const Cell& a, const Cell& b) { return sameCell(a, b) && a.corners == b.corners; })) {
    return {ErrorCode::kInvalidArgument,
            "frame " + std::to_string(timing.number) +
                ": its vertices are not those of the cells, or of their sheets (spec codec 5.5)"};
  }
  frame.bitmap = SignBitmap::fromCells(grid.nodes, frame.active, filled);
  finish(nullptr, frame);
  return {};
}

void Encoder::State::finish(const Volume* volume, Prepared& frame) const {
  frame.index.build(frame.active);
  frame.index.repeat(frame.cells);
  ResidualSteps steps;
  std::uint32_t step = settings.configuration.step;
  if (main() && volume != nullptr && settings.heights.weigh_rate)
    step = std::max(1u, static_cast<std::uint32_t>(std::lround(kWeighedStep * step)));
  steps.normal = static_cast<std::int32_t>(step);
  steps.tangential = static_cast<std::int32_t>(std::min<std::uint32_t>(kTangentialRatio * step, kCell));
  frame.coder.reset();
  frame.field.reset();
  frame.input.emplace(FrameInput{settings.configuration.grid, frame.bitmap, frame.active, frame.cells,
                                 frame.index, frame.vertices, steps, settings.configuration.slices,
                                 settings.parallel});
  if (!main()) return;
  if (volume != nullptr)
    frame.field.emplace(*volume, frame.timing.isovalue, settings.configuration.inside,
                        settings.configuration.grid, frame.active);
  frame.coder.emplace(*frame.input, frame.field ? &*frame.field : nullptr, settings.configuration.tools,
                      settings.heights, settings.parallel, frame.heights);
}

Result<Packet> Encoder::State::code(Prepared& frame, PacketSizes* sizes) {
  const FrameTiming& timing = frame.timing;
  const FrameInput& input = *frame.input;
  const std::vector<Cell>& cells = frame.cells;
  const bool main = this->main();
  PacketHeader header;
  header.number = timing.number;
  header.time = timing.time;
  header.duration = timing.duration;
  header.isovalue = timing.isovalue;
  header.step = static_cast<std::uint32_t>(input.steps.normal);
  header.tangential_step = static_cast<std::uint32_t>(input.steps.tangential);
  header.vertices = static_cast<std::uint32_t>(cells.size());

  std::optional<CodedFrame> coded;
  Errors errors;
  const auto intra = [&]() -> Status {
    ISOREEL_ASSIGN(coded, main ? frame.coder->codeIntra() : codeIntra(input));
    if (!main) errors = errorsOf(coded->decoded, frame.vertices);
    intra_rate = cells.empty() ? 0 : coded->bytes() / static_cast<double>(cells.size());
    return {};
  };
  const bool predicts = (settings.configuration.tools & kToolPrediction) != 0;
  if (predicts && last && timing.number == *last + 1 && timing.number - key < settings.gop) {
    FrameInput with_reference = input;
    if (!main) {
      with_reference.steps.tangential = static_cast<std::int32_t>(
          std::min<std::uint32_t>(kPredictedTangentialRatio * header.step / 2, kCell));
    }
    CodedFrame predicted;
    const bool any_size = settings.motion.block_log2 == MotionSettings::kAnySize;
    const std::uint32_t smallest = any_size ? 3 : settings.motion.block_log2,
                        largest = any_size ? 5 : smallest;
    for (std::uint32_t log2 = smallest; log2 <= largest; ++log2) {
      MotionSettings motion = settings.motion;
      motion.block_log2 = log2;
      ISOREEL_ASSIGN(CodedFrame other, main ? frame.coder->codePredicted(reference, motion, models)
                                            : codePredicted(with_reference, reference, motion, models));
      if (log2 == smallest || other.bytes() < predicted.bytes()) predicted = std::move(other);
    }
    const Errors predicted_errors = main ? Errors{} : errorsOf(predicted.decoded, frame.vertices);
    // In main both kinds of frame come equally close, so the I frame's bytes need not be known where there is
    // no doubt.
    bool better = main && predicted.bytes() < kNoDoubt * intra_rate * static_cast<double>(cells.size());
    if (!better) {
      ISOREEL_TRY(intra());
      // Where little is predicted, classic's coarser steps of a P frame must not pass for a saving. An I
      // frame is a place to seek to: worth a fiftieth of it.
      const double bytes =
          predicted.bytes() + (main ? 0 : bytesToReach(errors, predicted_errors, cells.size()));
      better = 50 * bytes < 49 * (coded->bytes() + static_cast<double>(record.size()));
    }
    if (better) {
      errors = predicted_errors;
      coded = std::move(predicted);
      header.type = PacketType::kPredicted;
      header.references = {1};
      header.tangential_step = static_cast<std::uint32_t>(with_reference.steps.tangential);
    }
  }
  if (!coded) {
    ISOREEL_TRY(intra());
  }
  if (header.type == PacketType::kIntra) {
    header.configuration = record;
    key = timing.number;
  }
  header.sections = coded->sections;

  Packet packet;
  Surface surface;
  surface.grid = input.grid;
  toGridPositions(cells, coded->decoded);
  surface.vertices = std::move(coded->decoded);
  surface.quads = main ? frame.coder->takeQuads() : dualQuads(cells, frame.index);

  FrameHeader& facts = packet.header;
  facts.number = timing.number;
  facts.position = timing.number;
  facts.back = timing.number - key;
  facts.type = header.type;
  facts.time = timing.time;
  facts.duration = timing.duration;
  facts.isovalue = timing.isovalue;
  settings.parallel(predicts ? 2 : 1, [&](std::size_t i) {
    if (i == 0) {
      measureSurface(surface, cells, frame.bitmap.insideCells(), facts);
    } else {
      reference.build(surface, cells, settings.parallel);
    }
  });
  if (!main) {  // vertices of main slide: where the extractor had them says nothing of the distance
    facts.error_kind = ErrorKind::kExtracted;
    facts.error_rms = static_cast<float>(std::sqrt(errors.mean));
    facts.error_max = static_cast<float>(std::sqrt(errors.largest));
  }

  header.faces = facts.faces;
  header.surface_hash = facts.surface_hash;
  ISOREEL_ASSIGN(packet.data, writePacket(std::move(header), coded->payload));
  if (sizes != nullptr) {
    *sizes = coded->sizes;
    sizes->other = packet.data.size() - coded->payload.size();
  }
  if (predicts) {
    models = std::move(coded->models);
    last = timing.number;
  }
  return packet;
}

}  // namespace isoreel
