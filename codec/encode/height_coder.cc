// SPDX-License-Identifier: BSD-3-Clause
#include "encode/height_coder.h"

#include <cmath>
#include <utility>

#include "encode/height_fit.h"
#include "encode/sections.h"
#include "inter/vertex_stream.h"
#include "lattice/dual_mesh.h"

namespace isoreel {
namespace {

// More rounds follow the noise of the samples: bits, and no gain in distance.
constexpr int kFitRounds = 1;
// Where little time is to be spent, one of so many vertices is looked at for the weights.
constexpr std::size_t kSparse = 8;
// A bit is worth this many squared steps of one sample; less in even cells, since odd ones are predicted from
// them.
constexpr std::array<double, 2> kBitWorth{0.3, 0.9};
// The same in a single pass, whose costs are less to be trusted.
constexpr std::array<double, 2> kBitWorthOfOnePass{0.1, 0.3};

// Finer vectors cost more than they save.
constexpr std::uint32_t kVectorStep = kCell / 4;

/// Bits of a decision with probability one / 65536 of a 1.
double cost(std::int32_t one, bool bit) {
  static const auto table = [] {
    std::array<float, 1025> bits{};
    for (std::size_t i = 0; i < bits.size(); ++i)
      bits[i] = static_cast<float>(-std::log2((static_cast<double>(i) + 0.5) / 1025.5));
    return bits;
  }();
  const std::int32_t p = bit ? one : 65536 - one;
  return static_cast<double>(table[static_cast<std::size_t>(p >> 6)]);
}

/// What a residual costs as the models stand, about.
class ResidualCosts {
 public:
  /// `largest`: magnitude that will be asked for.
  ResidualCosts(HeightModels& models, const HeightContext& context, std::int32_t largest) {
    if (context.moved) {
      set<3>(models, context, largest);
    } else {
      set<2>(models, context, largest);
    }
  }
  double of(std::int32_t residual) const {
    if (residual == 0) return zero_;
    const std::int32_t magnitude = std::abs(residual);
    const double sign = cost(negative_, residual < 0);
    if (magnitude == 1) return sign + ones_;
    if (magnitude == 2) return sign + twos_;
    return sign + rest_ + 2 * std::log2(magnitude - 1) + 1;
  }

 private:
  template <std::size_t N>
  void set(HeightModels& models, const HeightContext& context, std::int32_t largest) {
    const std::int32_t zero = models.zero<N>(context).one(), more1 = models.more<N>(context, 1).one();
    negative_ = models.negative(context).one;
    zero_ = cost(zero, true);
    ones_ = cost(zero, false) + cost(more1, false);
    if (largest < 2) return;
    const std::int32_t more2 = models.more<N>(context, 2).one();
    twos_ = cost(zero, false) + cost(more1, true) + cost(more2, false);
    rest_ = cost(zero, false) + cost(more1, true) + cost(more2, true);
  }

  std::int32_t negative_;
  double zero_, ones_, twos_ = 0, rest_ = 0;
};

/// How far along its normal a vertex lies from its predicted point, in cells.
float heightOf(const SignPrediction& predicted, std::size_t i, const std::array<std::int32_t, 3>& vertex) {
  double height = 0;
  for (std::size_t k = 0; k < 3; ++k)
    height += static_cast<double>((vertex[k] - 8 * predicted.points[i].v[k]) * predicted.normals[i].v[k]);
  return static_cast<float>(height / kCell / kCell);
}

std::int32_t limited(double value) {
  return static_cast<std::int32_t>(std::lround(std::clamp(value, -65535.0, 65535.0)));
}

}  // namespace

HeightCoder::HeightCoder(const FrameInput& frame, const VolumeField* field, std::uint32_t tools,
                         const HeightSettings& settings, const ParallelFor& parallel, HeightFrame& heights)
    : frame_(frame), tools_(tools), settings_(settings), heights_(heights) {
  heights.build(frame.cells, frame.index, frame.grid, frame.slices, parallel);
  quads_ = dualQuads(frame.cells, frame.index);
  if (field == nullptr) {
    for (std::size_t i = 0; i < frame.cells.size(); ++i)
      wanted_.push_back(heightOf(heights.predicted, i, frame.vertices[i]));
    return;
  }
  if (settings.fit == Fit::kVolume) {
    target_ = std::make_unique<VolumeTarget>(*field, !settings.refine);
  } else {
    target_ = std::make_unique<MeshTarget>(frame.cells, frame.vertices, quads_, frame.grid);
  }
  fit_.emplace(*target_, frame.cells, heights, quads_, frame.grid, !settings.refine, parallel);
  fit_->toSurface();
  if (settings.fit_triangles) fit_->optimise(kFitRounds, settings.refine ? 2 : 1);
  wanted_ = fit_->heights();
  if (!frame_.vertices.empty()) return;
  for (std::uint32_t i = 0; i < frame.cells.size(); ++i) vertices_.push_back(fit_->vertex(i));
  frame_.vertices = vertices_;
}

Result<CodedFrame> HeightCoder::codeIntra() {
  CodedFrame coded;
  coded.models.mixSigns((tools_ & kToolMixedSigns) != 0);
  ISOREEL_TRY(SignWriter(frame_, coded).writeAll());
  heights_.moved.clear();
  ISOREEL_TRY(codeVertices(coded));
  return coded;
}

Result<CodedFrame> HeightCoder::codePredicted(const Reference& reference, const MotionSettings& settings,
                                              const PacketModels& models) {
  CodedFrame coded;
  coded.models = models;
  SignWriter signs(frame_, coded);
  MotionHeader header;
  header.block_log2 = settings.block_log2;
  header.vector_step = kVectorStep;
  ISOREEL_ASSIGN(MotionField motion, writeMovedSigns(frame_, reference, settings, header, signs, coded,
                                                     &models.blocks, [](const MotionField&) {}));
  coded.models.blocks = motion;
  moveHeights(reference.field(), motion, frame_.cells, heights_, frame_.parallel);
  ISOREEL_TRY(codeVertices(coded));
  return coded;
}

Status HeightCoder::codeVertices(CodedFrame& coded) {
  if (frame_.cells.empty()) return {};
  for (std::size_t i = 0; i < wanted_.size(); ++i) {
    heights_.heights[i] =
        static_cast<std::int16_t>(std::clamp(std::lround(wanted_[i] * kCell), -32767L, 32767L));
    heights_.parts[1 + i] =
        heights::partOf(heights_.heights[i], 0, heights_.moved.empty() ? nullptr : &heights_.moved[i]);
  }
  const std::int32_t step = frame_.steps.normal;
  const double step_in_cells = static_cast<double>(step) / kCell;
  const HeightWeights weights = fitHeights(heights_, tools_, step_in_cells, settings_.refine ? 1 : kSparse,
                                           coded.models.slices[0].heights.weights, frame_.parallel);
  const std::size_t slices = heights_.around.sliceCount();
  coded.models.haveSlices(slices);
  HeightModels* costs_by = nullptr;  // what the slice at hand's residuals are taken to cost by
  const auto nearest = [&](std::uint32_t i, std::int32_t expected, const HeightContext&) {
    return limited((static_cast<double>(wanted_[i]) * kCell - expected) / step);
  };
  const std::array<double, 2>& bit_worth = settings_.refine ? kBitWorth : kBitWorthOfOnePass;
  const auto cheapest = [&](std::uint32_t i, std::int32_t expected, const HeightContext& context) {
    const SurfaceFit::Bowl bowl = fit_->bowl(i);
    const double exact = (static_cast<double>(bowl.best) * kCell - expected) / step;
    const std::int32_t middle = limited(exact);
    std::int32_t best = 0;
    if (middle != 0) {  // nothing is cheaper than 0
      const std::int32_t towards_0 = middle > 0 ? middle - 1 : middle + 1;
      const ResidualCosts costs(*costs_by, context, std::abs(middle));
      double least = 1e30;
      for (const std::int32_t residual : {middle, towards_0, 0}) {
        const double error = (exact - residual) * step_in_cells;
        const double sum = static_cast<double>(bowl.curvature) * error * error +
                           bit_worth[context.colour] * step_in_cells * step_in_cells * costs.of(residual);
        if (sum < least) {
          least = sum;
          best = residual;
        }
        if (residual == 0) break;
      }
    }
    fit_->set(i, static_cast<float>(std::clamp(expected + best * step, -32767, 32767)) / kCell);
    return best;
  };
  const std::size_t start = coded.payload.size();
  std::vector<Bytes> streams(slices);
  const auto write = [&](std::size_t n, const auto& choose) {
    streams[n].clear();
    RangePut coder(streams[n]);
    HeightModels& models = coded.models.slices[n].heights;
    if (n == 0) models.codeWeights(coder, weights, !heights_.moved.empty());
    codeHeights(coder, models, coded.models.slices[0].heights.weights, heights_.around.slice(n), frame_.cells,
                heights_, step, tools_, choose);
    coder.finish();
  };
  if (fit_ && settings_.weigh_rate) {
    if (settings_.refine || !settings_.fit_triangles) {
      fit_->setAll(wanted_);
      fit_->linearise();  // once is near enough for both passes
    } else {              // nor are the fit's own slopes far off
      for (std::uint32_t i = 0; i < wanted_.size(); ++i) fit_->set(i, wanted_[i]);
    }
    for (std::size_t n = 0; n < slices; ++n) {
      HeightModels& models = coded.models.slices[n].heights;
      const HeightModels before = models;
      const bool intra = heights_.moved.empty();
      // What is cheap is chosen, and then gets cheaper: ones would be, to more bytes in the end.
      if (!settings_.refine) {
        HeightModels unlearnt = before;
        unlearnt.expectNoOnes();
        costs_by = intra ? &unlearnt : &models;  // those of an I frame are too young to go by
        write(n, cheapest);
        continue;
      }
      if (intra) models.expectNoOnes();
      costs_by = &models;
      write(n, cheapest);
      // Once more, at the costs that this ended with; a vertex sees what it made of those behind it.
      HeightModels learnt = std::exchange(models, before);
      costs_by = &learnt;
      write(n, cheapest);
    }
  } else {
    for (std::size_t n = 0; n < slices; ++n) write(n, nearest);
  }
  ISOREEL_TRY(addSlices(coded, SectionKind::kVertices, 0, streams));
  coded.sizes.vertices = coded.payload.size() - start;
  coded.decoded.resize(frame_.cells.size());
  for (std::size_t i = 0; i < frame_.cells.size(); ++i)
    coded.decoded[i] =
        atHeight(heights_.predicted.points[i], heights_.predicted.normals[i], heights_.heights[i]);
  return {};
}

}  // namespace isoreel
