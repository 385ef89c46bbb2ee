// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/codec/encoder.h>

#include <cmath>
#include <new>
#include <optional>

#include "encode/facts.h"
#include "encode/frame_coder.h"
#include "encode/height_coder.h"
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

struct Encoder::State {
  EncoderSettings settings;
  Bytes record;
  // The GOP so far.
  std::uint64_t key = 0;
  std::optional<std::uint64_t> last;  // number of the frame coded last; none: the next frame starts a GOP
  Reference reference;
  PacketModels models;
  double intra_rate = 0;  // bytes a vertex of the frame that was coded by itself last
  HeightFrame heights;

  /// What `code` gives, or that there is no memory for it; then the next frame starts a GOP.
  template <class Code>
  Result<Packet> guarded(const FrameTiming& timing, Code code) {
    try {
      return code();
    } catch (const std::bad_alloc&) {
      last.reset();
      return {ErrorCode::kLimit,
              "frame " + std::to_string(timing.number) + ": takes more memory to encode than there is"};
    }
  }
  Result<Packet> encode(const Volume& volume, const FrameTiming& timing, PacketSizes* sizes);
  Result<Packet> encodeAgain(const Surface& surface, std::span<const Cell> cells, bool filled,
                             const FrameTiming& timing, PacketSizes* sizes);
  /// The vertices' cells: the active ones, or their sheets.
  std::vector<Cell> verticesOf(std::span<const Cell> active) const {
    std::vector<Cell> cells(active.begin(), active.end());
    if ((settings.configuration.tools & kToolSheets) == 0) return cells;
    CellIndex index;
    index.build(active);
    return splitSheets(std::move(cells), index);
  }
  /// Whether heights are chosen without knowing where the extractor would put vertices.
  bool placesItself() const {
    return settings.configuration.profile == Profile::kMain && settings.heights.fit == Fit::kVolume &&
           !settings.heights.refine;
  }
  /// `cells`: as above; `vertices` in them, none when placesItself(). `volume`: what they are from; null when
  /// that is not known.
  Result<Packet> code(const Volume* volume, const SignBitmap& bitmap, std::span<const Cell> active,
                      std::span<const Cell> cells, std::span<const std::array<std::int32_t, 3>> vertices,
                      const FrameTiming& timing, PacketSizes* sizes);
};

void usePreset(Preset preset, EncoderSettings& settings) {
  settings.motion.range = preset == Preset::kFast ? 0 : MotionSettings{}.range;
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
  if (settings.gop < 1) return {ErrorCode::kInvalidArgument, "a GOP has one frame at least"};
  const std::uint32_t block = settings.motion.block_log2;
  if (block != MotionSettings::kAnySize && (block < 2 || block > 5))
    return {ErrorCode::kInvalidArgument, "motion blocks have 4, 8, 16 or 32 cells a side (spec codec 8.1)"};
  const bool predicts = settings.frame_types == FrameTypes::kAuto && settings.gop > 1;
  const bool main = settings.configuration.profile == Profile::kMain;
  settings.configuration.tools = (predicts ? kToolPrediction : 0) |
                                 (main && settings.heights.neighbours ? kToolNeighbours : 0) |
                                 (main && settings.heights.mixed_signs ? kToolMixedSigns : 0) |
                                 (main && settings.heights.sheets ? kToolSheets : 0);
  ISOREEL_ASSIGN(Bytes record, writeConfiguration(settings.configuration));
  auto state = std::make_unique<State>();
  state->settings = std::move(settings);
  state->record = std::move(record);
  return Encoder(std::move(state));
}

const Bytes& Encoder::configurationRecord() const { return state_->record; }

Result<Packet> Encoder::encode(const Volume& volume, const FrameTiming& timing, PacketSizes* sizes) {
  return state_->guarded(timing, [&] { return state_->encode(volume, timing, sizes); });
}

Result<Packet> Encoder::encodeAgain(const Surface& surface, std::span<const Cell> cells, bool filled,
                                    const FrameTiming& timing, PacketSizes* sizes) {
  return state_->guarded(timing, [&] { return state_->encodeAgain(surface, cells, filled, timing, sizes); });
}

Result<Packet> Encoder::State::encode(const Volume& volume, const FrameTiming& timing, PacketSizes* sizes) {
  const Grid& grid = settings.configuration.grid;
  if (volume.grid.nodes != grid.nodes) {
    return {ErrorCode::kInvalidArgument,
            "frame " + std::to_string(timing.number) + ": its grid differs in size from the sequence's"};
  }
  if (volume.samples.size() != grid.nodeCount()) {
    return {ErrorCode::kInvalidArgument,
            "frame " + std::to_string(timing.number) + ": fewer or more samples than its grid has nodes"};
  }
  if (!std::isfinite(timing.isovalue)) return {ErrorCode::kInvalidArgument, "the isovalue is not finite"};

  ISOREEL_ASSIGN(const SignBitmap bitmap,
                 SignBitmap::make(volume, timing.isovalue, settings.configuration.inside, settings.non_finite,
                                  settings.parallel));
  const std::vector<Cell> active = bitmap.activeCells(settings.parallel), cells = verticesOf(active);
  if (cells.size() > 0xFFFFFFFFu / 4)
    return {ErrorCode::kLimit, "the surface has more than 2^30 vertices (spec codec 3.1)"};
  std::vector<std::array<std::int32_t, 3>> vertices;
  if (!placesItself())
    vertices = placeVertices(volume, timing.isovalue, cells, settings.placement, settings.parallel);
  return code(&volume, bitmap, active, cells, vertices, timing, sizes);
}

Result<Packet> Encoder::State::encodeAgain(const Surface& surface, std::span<const Cell> cells, bool filled,
                                           const FrameTiming& timing, PacketSizes* sizes) {
  const Grid& grid = settings.configuration.grid;
  if (surface.grid.nodes != grid.nodes || cells.size() != surface.vertices.size()) {
    return {ErrorCode::kInvalidArgument, "frame " + std::to_string(timing.number) +
                                             ": its grid or its cells are not those of the surface"};
  }
  std::vector<std::array<std::int32_t, 3>> vertices(cells.size());
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
  const std::vector<Cell> active = uniteSheets(cells);
  const std::vector<Cell> ours = verticesOf(active);
  if (!std::equal(ours.begin(), ours.end(), cells.begin(), cells.end(),
                  [](const Cell& a, const Cell& b) { return sameCell(a, b) && a.corners == b.corners; })) {
    return {ErrorCode::kInvalidArgument,
            "frame " + std::to_string(timing.number) +
                ": its vertices are not those of the cells, or of their sheets (spec codec 5.5)"};
  }
  ISOREEL_ASSIGN(Packet packet, code(nullptr, SignBitmap::fromCells(grid.nodes, active, filled), active,
                                     cells, vertices, timing, sizes));
  packet.header.error_kind = ErrorKind::kNone;  // what the surface was made from is not known here
  packet.header.error_rms = packet.header.error_max = 0;
  return packet;
}

Result<Packet> Encoder::State::code(const Volume* volume, const SignBitmap& bitmap,
                                    std::span<const Cell> active, std::span<const Cell> cells,
                                    std::span<const std::array<std::int32_t, 3>> vertices,
                                    const FrameTiming& timing, PacketSizes* sizes) {
  const Grid& grid = settings.configuration.grid;
  CellIndex index;
  index.build(active);
  index.repeat(cells);
  PacketHeader header;
  header.number = timing.number;
  header.time = timing.time;
  header.duration = timing.duration;
  header.isovalue = timing.isovalue;
  header.step = settings.configuration.step;
  const bool main = settings.configuration.profile == Profile::kMain;
  if (main && volume != nullptr && settings.heights.weigh_rate)
    header.step = std::max(1u, static_cast<std::uint32_t>(std::lround(kWeighedStep * header.step)));
  header.tangential_step = std::min<std::uint32_t>(kTangentialRatio * header.step, kCell);
  header.vertices = static_cast<std::uint32_t>(cells.size());

  const FrameInput input{
      grid,
      bitmap,
      active,
      cells,
      index,
      vertices,
      {static_cast<std::int32_t>(header.step), static_cast<std::int32_t>(header.tangential_step)}};
  std::optional<VolumeField> field;
  if (main && volume != nullptr)
    field.emplace(*volume, timing.isovalue, settings.configuration.inside, active);
  std::optional<HeightCoder> coder;
  if (main)
    coder.emplace(input, field ? &*field : nullptr, settings.configuration.tools, settings.heights,
                  settings.parallel, heights);
  std::optional<CodedFrame> coded;
  Errors errors;
  const auto intra = [&]() -> Status {
    ISOREEL_ASSIGN(coded, main ? coder->codeIntra() : codeIntra(input));
    if (!main) errors = errorsOf(coded->decoded, vertices);
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
      ISOREEL_ASSIGN(CodedFrame other, main ? coder->codePredicted(reference, motion, models)
                                            : codePredicted(with_reference, reference, motion, models));
      if (log2 == smallest || other.bytes() < predicted.bytes()) predicted = std::move(other);
    }
    const Errors predicted_errors = main ? Errors{} : errorsOf(predicted.decoded, vertices);
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
  surface.grid = grid;
  toGridPositions(cells, coded->decoded);
  surface.vertices = std::move(coded->decoded);
  surface.quads = dualQuads(cells, index);

  FrameHeader& facts = packet.header;
  facts.number = timing.number;
  facts.position = timing.number;
  facts.back = timing.number - key;
  facts.type = header.type;
  facts.time = timing.time;
  facts.duration = timing.duration;
  facts.isovalue = timing.isovalue;
  measureSurface(surface, cells, bitmap.insideCells(), facts);
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
    reference.build(surface, cells, settings.parallel);
    models = std::move(coded->models);
    last = timing.number;
  }
  return packet;
}

}  // namespace isoreel
