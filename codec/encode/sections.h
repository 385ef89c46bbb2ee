// SPDX-License-Identifier: BSD-3-Clause
// The sections of a payload, one by one.
#pragma once

#include "encode/frame_coder.h"
#include "extract/octree.h"
#include "intra/sign_tree.h"
#include "motion/motion_search.h"
#include "syntax/slices.h"

namespace isoreel {

/// Enters what was appended to the payload from `start` on into the section table, when there is anything.
inline void enterSection(CodedFrame& coded, SectionKind kind, std::uint32_t level, std::size_t start) {
  if (coded.payload.size() == start) return;
  coded.sections.push_back(
      {static_cast<std::uint32_t>(kind), level, static_cast<std::uint32_t>(coded.payload.size() - start)});
}

/// Appends the stream that `write(coder)` makes to the payload.
template <class Write>
void addSection(CodedFrame& coded, SectionKind kind, std::uint32_t level, Write write) {
  const std::size_t start = coded.payload.size();
  RangePut coder(coded.payload);
  write(coder);
  coder.finish();
  enterSection(coded, kind, level, start);
}
/// The streams of slices.
inline Status addSlices(CodedFrame& coded, SectionKind kind, std::uint32_t level,
                        std::span<const Bytes> slices) {
  const std::size_t start = coded.payload.size();
  ISOREEL_TRY(writeSlices(slices, coded.payload));
  enterSection(coded, kind, level, start);
  return {};
}

/// What a slice knows of nodes beyond signs: in I packets, and on coarse levels of P packets.
inline NothingMoved nothingMoved(SliceModels&) { return {}; }

/// Signs and leaf bits, level by level, coarse to fine (spec codec 4). Ends where nothing is heterogeneous.
class SignWriter {
 public:
  SignWriter(const FrameInput& frame, CodedFrame& coded)
      : octree_(frame.active, octreeDepth(frame.grid)),
        tree_(frame.grid, OctreeTruth(frame.bitmap, octree_), frame.active.size(), frame.slices),
        parallel_(frame.parallel),
        coded_(coded) {}

  std::uint32_t depth() const { return tree_.depth(); }
  const std::vector<Cell>& cells() const { return tree_.cells(); }

  /// The next level. movedOf(models) gives what a slice with these knows of nodes from elsewhere (see
  /// SignStreams).
  template <class MovedOf>
  Status write(std::uint32_t level, const MovedOf& movedOf) {
    if (level > 0 && tree_.cells().empty()) return {};
    const std::size_t start = coded_.payload.size(), count = level == 0 ? 1 : tree_.sliceCount();
    std::vector<Bytes> sign_bytes(count), leaf_bytes(count);
    std::vector<RangePut> signs(sign_bytes.begin(), sign_bytes.end()),
        leaves(leaf_bytes.begin(), leaf_bytes.end());
    coded_.models.haveSlices(count);
    if (level == 0) {
      ISOREEL_TRY(tree_.codeRoot(signs[0], leaves[0]));
    } else {
      const auto streams = [&](std::size_t n) {
        SliceModels& models = coded_.models.slices[n];
        return SignStreams{signs[n], leaves[n], models.signs, movedOf(models)};
      };
      ISOREEL_TRY(tree_.codeLevel(level, streams, parallel_));
    }
    for (RangePut& coder : signs) coder.finish();
    for (RangePut& coder : leaves) coder.finish();
    ISOREEL_TRY(addSlices(coded_, SectionKind::kSigns, level, sign_bytes));
    if (level < depth()) ISOREEL_TRY(addSlices(coded_, SectionKind::kLeaves, level, leaf_bytes));
    coded_.sizes.signs += coded_.payload.size() - start;
    return {};
  }
  /// All levels, by the signs alone.
  Status writeAll() {
    for (std::uint32_t level = 0; level <= depth(); ++level) ISOREEL_TRY(write(level, nothingMoved));
    return {};
  }

 private:
  SparseOctree octree_;
  SignTree<RangePut, OctreeTruth> tree_;
  const ParallelFor& parallel_;
  CodedFrame& coded_;
};

/// All levels of a P frame's signs and, in front of those that need it, its motion section: header and
/// vectors, which are searched for. `before`: in profile main, the blocks of the packet before, else null.
/// chosen(motion) may change the header before it is written.
template <class Header, class Chosen>
Result<MotionField> writeMovedSigns(const FrameInput& frame, const Reference& reference,
                                    const MotionSettings& settings, Header& header, SignWriter& signs,
                                    CodedFrame& coded, const MotionField* before, Chosen chosen) {
  const std::uint32_t block_level = blockLevel(signs.depth(), header.block_log2);
  for (std::uint32_t level = 0; level <= block_level; ++level) ISOREEL_TRY(signs.write(level, nothingMoved));

  MotionField motion;
  motion.build(signs.cells(), header.block_log2, header.vector_step);
  motion.assign(frame.cells);
  std::vector<std::array<float, 3>> points(frame.cells.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Cell& cell = frame.cells[i];
    const std::array<std::uint16_t, 3> corner{cell.x, cell.y, cell.z};
    for (std::size_t k = 0; k < 3; ++k)
      points[i][k] = static_cast<float>(corner[k]) + static_cast<float>(frame.vertices[i][k]) / kCell;
  }
  searchMotion(reference, points, settings, header.vector_step, before, motion, frame.parallel);
  chosen(motion);

  const std::size_t motion_start = coded.payload.size();
  ISOREEL_TRY(writeSized(coded.payload, header));
  const auto head = static_cast<std::uint32_t>(coded.payload.size() - motion_start);
  Status status;
  addSection(coded, SectionKind::kMotion, 0,
             [&](RangePut& coder) { status = motion.code(coder, coded.models.motion, before); });
  ISOREEL_TRY(status);
  if (coded.payload.size() == motion_start + head)
    coded.sections.push_back({static_cast<std::uint32_t>(SectionKind::kMotion), 0, 0});
  coded.sections.back().bytes += head;
  coded.sizes.motion = coded.sections.back().bytes;

  for (std::uint32_t level = block_level + 1; level <= signs.depth(); ++level) {
    ISOREEL_TRY(signs.write(level, [&](SliceModels& models) {
      return MovedSigns(reference.field(), motion, models.moved_signs, signs.depth() - level);
    }));
  }
  return motion;
}

}  // namespace isoreel
