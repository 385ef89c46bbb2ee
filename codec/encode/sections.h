// SPDX-License-Identifier: BSD-3-Clause
// The sections of a payload, one by one.
#pragma once

#include "encode/frame_coder.h"
#include "extract/octree.h"
#include "intra/sign_tree.h"
#include "motion/motion_search.h"

namespace isoreel {

/// Appends the stream that `write(coder)` makes to the payload, and its entry to the section table when it
/// has any bytes.
template <class Write>
void addSection(CodedFrame& coded, SectionKind kind, std::uint32_t level, Write write) {
  const std::size_t start = coded.payload.size();
  RangePut coder(coded.payload);
  write(coder);
  coder.finish();
  if (coded.payload.size() > start) {
    coded.sections.push_back(
        {static_cast<std::uint32_t>(kind), level, static_cast<std::uint32_t>(coded.payload.size() - start)});
  }
}

/// Signs and leaf bits, level by level, coarse to fine (spec codec 4). Ends where nothing is heterogeneous.
class SignWriter {
 public:
  SignWriter(const FrameInput& frame, CodedFrame& coded)
      : octree_(frame.active, octreeDepth(frame.grid)),
        tree_(frame.grid, OctreeTruth(frame.bitmap, octree_), frame.active.size(), coded.models.signs),
        coded_(coded) {}

  std::uint32_t depth() const { return tree_.depth(); }
  const std::vector<Cell>& cells() const { return tree_.cells(); }

  /// The next level; `moved` as SignTree has it.
  template <class Moved>
  Status write(std::uint32_t level, Moved& moved) {
    if (level > 0 && tree_.cells().empty()) return {};
    const std::size_t start = coded_.payload.size();
    Bytes leaf_bytes;
    RangePut leaves(leaf_bytes);
    Status status;
    addSection(coded_, SectionKind::kSigns, level, [&](RangePut& signs) {
      status = level == 0 ? tree_.codeRoot(signs, leaves) : tree_.codeLevel(level, signs, leaves, moved);
    });
    ISOREEL_TRY(status);
    leaves.finish();
    if (!leaf_bytes.empty()) {
      coded_.sections.push_back({static_cast<std::uint32_t>(SectionKind::kLeaves), level,
                                 static_cast<std::uint32_t>(leaf_bytes.size())});
      coded_.payload.insert(coded_.payload.end(), leaf_bytes.begin(), leaf_bytes.end());
    }
    coded_.sizes.signs += coded_.payload.size() - start;
    return {};
  }
  /// All levels, by the signs alone.
  Status writeAll() {
    NothingMoved nothing;
    for (std::uint32_t level = 0; level <= depth(); ++level) ISOREEL_TRY(write(level, nothing));
    return {};
  }

 private:
  SparseOctree octree_;
  SignTree<RangePut, OctreeTruth> tree_;
  CodedFrame& coded_;
};

/// All levels of a P frame's signs and, in front of those that need it, its motion section: header and
/// vectors, which are searched for. `before`: in profile main, the blocks of the packet before, else null.
/// chosen(motion) may change the header before it is written.
template <class Header, class Chosen>
Result<MotionField> writeMovedSigns(const FrameInput& frame, const Reference& reference,
                                    const MotionSettings& settings, Header& header, SignWriter& signs,
                                    CodedFrame& coded, const MotionField* before, Chosen chosen) {
  NothingMoved nothing;
  const std::uint32_t block_level = blockLevel(signs.depth(), header.block_log2);
  for (std::uint32_t level = 0; level <= block_level; ++level) ISOREEL_TRY(signs.write(level, nothing));

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
  searchMotion(reference, points, settings, header.vector_step, before, motion);
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

  MovedSigns moved(reference.field(), motion, coded.models.moved_signs);
  for (std::uint32_t level = block_level + 1; level <= signs.depth(); ++level) {
    moved.start(signs.depth() - level);
    ISOREEL_TRY(signs.write(level, moved));
  }
  return motion;
}

}  // namespace isoreel
