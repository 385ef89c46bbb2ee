// SPDX-License-Identifier: BSD-3-Clause
#include "encode/frame_coder.h"

#include <cmath>

#include "encode/prediction_fit.h"
#include "encode/sections.h"
#include "inter/vertex_stream.h"
#include "motion/motion_search.h"

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
  ISOREEL_TRY(writeSigns(frame, coded));
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
  ISOREEL_TRY(writeSigns(frame, coded));

  PredictionHeader header;
  header.block_log2 = settings.block_log2;
  MotionField motion;
  motion.build(frame.cells, header.block_log2, header.vector_step);
  std::vector<std::array<float, 3>> points(frame.cells.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Cell& cell = frame.cells[i];
    const std::array<std::uint16_t, 3> corner{cell.x, cell.y, cell.z};
    for (std::size_t k = 0; k < 3; ++k)
      points[i][k] = static_cast<float>(corner[k]) + static_cast<float>(frame.vertices[i][k]) / kCell;
  }
  searchMotion(reference, points, settings, header.vector_step, motion);

  std::vector<Residual> residuals(frame.cells.size());
  std::vector<double> wanted(frame.cells.size());
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    const auto along = components(frame.vertices[i], kLocalFrames[frame.cells[i].corners]);
    wanted[i] = along[0];
    residuals[i] = {0, rounded(along[1], frame.steps.tangential), rounded(along[2], frame.steps.tangential)};
  }
  const auto predictions = predictVertices(reference, motion, frame.cells, residuals, frame.steps);
  fitPrediction(frame.cells, frame.index, predictions, frame.vertices, wanted, frame.steps.normal, header);

  const std::size_t motion_start = coded.payload.size();
  ISOREEL_TRY(writeSized(coded.payload, header));
  const auto head = static_cast<std::uint32_t>(coded.payload.size() - motion_start);
  Status status;
  addSection(coded, SectionKind::kMotion, 0,
             [&](RangePut& coder) { status = motion.code(coder, coded.models.motion); });
  ISOREEL_TRY(status);
  if (coded.payload.size() == motion_start + head)
    coded.sections.push_back({static_cast<std::uint32_t>(SectionKind::kMotion), 0, 0});
  coded.sections.back().bytes += head;
  coded.sizes.motion = coded.sections.back().bytes;

  coded.decoded.resize(frame.cells.size());
  addSection(coded, SectionKind::kVertices, 0, [&](RangePut& coder) {
    codeTangents(coder, coded.models.vertices, frame.cells, residuals);
    codeNormals(
        coder, coded.models, header, frame.cells, frame.index, residuals, predictions, frame.steps,
        [&](std::uint32_t i, std::int32_t expected) {
          return rounded(wanted[i] - expected, frame.steps.normal);
        },
        coded.decoded);
  });
  coded.sizes.vertices = coded.payload.size() - coded.sizes.signs - coded.sizes.motion;
  return coded;
}

}  // namespace isoreel
