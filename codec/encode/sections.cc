// SPDX-License-Identifier: BSD-3-Clause
#include "encode/sections.h"

#include "extract/octree.h"
#include "intra/sign_tree.h"

namespace isoreel {

Status writeSigns(const FrameInput& frame, CodedFrame& coded) {
  const SparseOctree octree(frame.cells, octreeDepth(frame.grid));
  SignTree<RangePut, OctreeTruth> tree(frame.grid, OctreeTruth(frame.bitmap, octree), frame.cells.size(),
                                       coded.models.signs);
  for (std::uint32_t level = 0; level <= tree.depth(); ++level) {
    Bytes leaf_bytes;
    RangePut leaves(leaf_bytes);
    Status status;
    addSection(coded, SectionKind::kSigns, level, [&](RangePut& signs) {
      status = level == 0 ? tree.codeRoot(signs, leaves) : tree.codeLevel(level, signs, leaves);
    });
    ISOREEL_TRY(status);
    leaves.finish();
    if (!leaf_bytes.empty()) {
      coded.sections.push_back({static_cast<std::uint32_t>(SectionKind::kLeaves), level,
                                static_cast<std::uint32_t>(leaf_bytes.size())});
      coded.payload.insert(coded.payload.end(), leaf_bytes.begin(), leaf_bytes.end());
    }
    if (tree.cells().empty()) break;
  }
  coded.sizes.signs = coded.payload.size();
  return {};
}

}  // namespace isoreel
