// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/codec/encoder.h>

#include <cmath>
#include <optional>

#include "encode/facts.h"
#include "encode/frame_coder.h"
#include "encode/height_coder.h"
#include "extract/dual_contouring.h"
#include "lattice/dual_mesh.h"
#include "syntax/packet.h"

namespace isoreel {
namespace {

// A vertex may slide on the surface: its tangential steps are larger. At equal distance to the extracted
// mesh, 3 took about 5 % off the vertex bits of 2 on droplets, splash and head scan; to the volume's
// isosurface more.
constexpr std::uint32_t kTangentialRatio = 3;
// Where the rate is weighed, many residuals are smaller than the nearest: a finer step makes up for it, at
// fewer bits.
constexpr double kWeighedStep = 0.7;

}  // namespace

struct Encoder::State {
  EncoderSettings settings;
  Bytes record;
  // The GOP so far.
  std::uint64_t key = 0;
  std::optional<std::uint64_t> last;  // number of the frame coded last; none: the next frame starts a GOP
  Reference reference;
  PacketModels models;
  HeightFrame heights;
};

Encoder::Encoder(std::unique_ptr<State> state) : state_(std::move(state)) {}
Encoder::Encoder(Encoder&&) noexcept = default;
Encoder& Encoder::operator=(Encoder&&) noexcept = default;
Encoder::~Encoder() = default;

Result<Encoder> Encoder::create(EncoderSettings settings) {
  ISOREEL_TRY(checkGrid(settings.configuration.grid));
  if (settings.gop < 1) return {ErrorCode::kInvalidArgument, "a GOP has one frame at least"};
  if (settings.motion.block_log2 < 2 || settings.motion.block_log2 > 5)
    return {ErrorCode::kInvalidArgument, "motion blocks have 4, 8, 16 or 32 cells a side (spec codec 8.1)"};
  const bool predicts = settings.frame_types == FrameTypes::kAuto && settings.gop > 1;
  const bool main = settings.configuration.profile == Profile::kMain;
  if (predicts && main)
    return {ErrorCode::kUnsupported,
            "profile main has no P packets yet: ask for I packets only (spec codec 11)"};
  settings.configuration.tools = (predicts ? kToolPrediction : 0) |
                                 (main && settings.heights.neighbours ? kToolNeighbours : 0) |
                                 (main && settings.heights.mixed_signs ? kToolMixedSigns : 0);
  ISOREEL_ASSIGN(Bytes record, writeConfiguration(settings.configuration));
  auto state = std::make_unique<State>();
  state->settings = std::move(settings);
  state->record = std::move(record);
  return Encoder(std::move(state));
}

const Bytes& Encoder::configurationRecord() const { return state_->record; }

Result<Packet> Encoder::encode(const Volume& volume, const FrameTiming& timing, PacketSizes* sizes) {
  const EncoderSettings& settings = state_->settings;
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
  const std::vector<Cell> cells = bitmap.activeCells(settings.parallel);
  if (cells.size() > 0xFFFFFFFFu / 4)
    return {ErrorCode::kLimit, "the surface has more than 2^30 vertices (spec codec 3.1)"};

  CellIndex index;
  index.build(cells);
  const auto vertices = placeVertices(volume, timing.isovalue, cells, settings.placement, settings.parallel);
  PacketHeader header;
  header.number = timing.number;
  header.time = timing.time;
  header.duration = timing.duration;
  header.isovalue = timing.isovalue;
  header.step = settings.configuration.step;
  const bool main = settings.configuration.profile == Profile::kMain;
  if (main && settings.heights.weigh_rate)
    header.step = std::max(1u, static_cast<std::uint32_t>(std::lround(kWeighedStep * header.step)));
  header.tangential_step = std::min<std::uint32_t>(kTangentialRatio * header.step, kCell);
  header.vertices = static_cast<std::uint32_t>(cells.size());

  const FrameInput input{
      grid,     bitmap,
      cells,    index,
      vertices, {static_cast<std::int32_t>(header.step), static_cast<std::int32_t>(header.tangential_step)}};
  State& state = *state_;
  ISOREEL_ASSIGN(CodedFrame coded,
                 main ? codeIntraHeights(
                            input, VolumeField(volume, timing.isovalue, settings.configuration.inside, cells),
                            settings.configuration.tools, settings.heights, settings.parallel, state.heights)
                      : codeIntra(input));
  const bool predicts = (settings.configuration.tools & kToolPrediction) != 0;
  if (predicts && state.last && timing.number == *state.last + 1 &&
      timing.number - state.key < settings.gop) {
    ISOREEL_ASSIGN(CodedFrame predicted,
                   codePredicted(input, state.reference, settings.motion, state.models));
    // An I frame is a place to seek to: worth a fiftieth of it.
    if (50 * predicted.payload.size() < 49 * (coded.payload.size() + state.record.size())) {
      coded = std::move(predicted);
      header.type = PacketType::kPredicted;
      header.references = {1};
    }
  }
  if (header.type == PacketType::kIntra) {
    header.configuration = state.record;
    state.key = timing.number;
  }
  header.sections = coded.sections;

  Packet packet;
  // Profile main lets vertices slide: where the extractor had them says nothing of the distance.
  double squares = 0, largest = 0;
  for (std::size_t i = 0; i < cells.size() && !main; ++i) {
    double square = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double error = static_cast<double>(coded.decoded[i][k] - vertices[i][k]) / kCell;
      square += error * error;
    }
    squares += square;
    largest = std::max(largest, square);
  }

  Surface surface;
  surface.grid = grid;
  toGridPositions(cells, coded.decoded);
  surface.vertices = std::move(coded.decoded);
  surface.quads = dualQuads(cells, index);

  FrameHeader& facts = packet.header;
  facts.number = timing.number;
  facts.key = state.key;
  facts.type = header.type;
  facts.time = timing.time;
  facts.duration = timing.duration;
  facts.isovalue = timing.isovalue;
  measureSurface(surface, cells, bitmap.insideCells(), facts);
  facts.error_kind = main ? ErrorKind::kNone : ErrorKind::kExtracted;
  facts.error_rms =
      static_cast<float>(cells.empty() ? 0 : std::sqrt(squares / static_cast<double>(cells.size())));
  facts.error_max = static_cast<float>(std::sqrt(largest));

  header.faces = facts.faces;
  header.surface_hash = facts.surface_hash;
  ISOREEL_ASSIGN(packet.data, writePacket(std::move(header), coded.payload));
  if (sizes != nullptr) {
    *sizes = coded.sizes;
    sizes->other = packet.data.size() - coded.payload.size();
  }
  if (predicts) {
    state.reference.build(surface, cells, index);
    state.models = std::move(coded.models);
    state.last = timing.number;
  }
  return packet;
}

}  // namespace isoreel
