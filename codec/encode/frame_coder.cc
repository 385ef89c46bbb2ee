// SPDX-License-Identifier: BSD-3-Clause
#include "encode/frame_coder.h"

#include <cmath>

#include "encode/prediction_fit.h"
#include "encode/sections.h"
#include "inter/vertex_stream.h"

namespace isoreel {
namespace {

/// Components of the extractor's vertex along the axes of its local frame, 1/16384 of a cell.
std::array<double, 3> components(const std::array<std::int32_t, 3>& vertex, const LocalFrame& frame) {
  std::array<double, 3> result{};
  for (std::size_t k = 0; k < 3; ++k) {
    const double offset = static_cast<double>(vertex[k] - frame.vertex[k]) / kCell;
    result[0] += offset * frame.normal[k];
    result[1] += offset * frame.tangent1[k];
    result[2] += offset * frame.tangent2[k];
  }
  return result;
}

std::int32_t rounded(double value, std::int32_t step) {
  return static_cast<std::int32_t>(std::lround(value / step));
}

}  // namespace

Result<CodedFrame> codeIntra(const FrameInput& frame) {
  CodedFrame coded;
  ISOREEL_TRY(SignWriter(frame, coded).writeAll());
  coded.decoded.resize(frame.cells.size());
  addSection(coded, SectionKind::kVertices, 0, [&](RangePut& coder) {
    for (std::size_t i = 0; i < frame.cells.size(); ++i) {
      const LocalFrame& local = kLocalFrames[frame.cells[i].corners];
      const std::array<double, 3> wanted = components(frame.vertices[i], local);
      const Residual residual =
          codeVertex(coder, coded.models.vertices, frame.cells[i].corners,
                     {rounded(wanted[0], frame.steps.normal), rounded(wanted[1], frame.steps.tangential),
                      rounded(wanted[2], frame.steps.tangential)});
      coded.decoded[i] = reconstruct(local, residual, frame.steps);
    }
  });
  coded.sizes.vertices = coded.payload.size() - coded.sizes.signs;
  return coded;
}

Result<CodedFrame> codePredicted(const FrameInput& frame, const Reference& reference,
                                 const MotionSettings& settings, const PacketModels& models) {
  CodedFrame coded;
  coded.models = models;
  SignWriter signs(frame, coded);
  PredictionHeader header;
  header.block_log2 = settings.block_log2;
  std::vector<std::array<double, 3>> wanted(frame.cells.size());
  for (std::size_t i = 0; i < wanted.size(); ++i)
    wanted[i] = components(frame.vertices[i], kLocalFrames[frame.cells[i].corners]);
  std::vector<MovedPlane> planes(frame.cells.size());
  const auto chosen = [&](const MotionField& motion) {
    MovedPlanes moved_planes(reference.field(), motion, frame.cells);
    for (std::uint32_t i = 0; i < planes.size(); ++i) planes[i] = moved_planes(i);
    fitPrediction(frame.cells, frame.index, planes, frame.vertices, wanted, frame.steps.normal, header);
  };
  ISOREEL_ASSIGN(const MotionField motion,
                 writeMovedSigns(frame, reference, settings, header, signs, coded, nullptr, chosen));

  struct Choice {
    const FrameInput& frame;
    const std::vector<std::array<double, 3>>& wanted;
    std::int32_t residual(std::uint32_t i, std::size_t component, std::int32_t expected) const {
      return rounded(wanted[i][component] - expected,
                     component == 0 ? frame.steps.normal : frame.steps.tangential);
    }
  } choice{frame, wanted};
  const auto plane_of = [&](std::uint32_t i) { return planes[i]; };
  coded.decoded.resize(frame.cells.size());
  addSection(coded, SectionKind::kVertices, 0, [&](RangePut& coder) {
    codePredictedVertices(coder, coded.models.vertices, coded.models.predicted, header, frame.cells,
                          frame.index, frame.steps, plane_of, choice, coded.decoded);
  });
  coded.sizes.vertices = coded.payload.size() - coded.sizes.signs - coded.sizes.motion;
  return coded;
}

}  // namespace isoreel
