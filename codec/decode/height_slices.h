// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "decode/predicted_part.h"
#include "intra/height_stream.h"
#include "syntax/slices.h"

namespace isoreel {

/// The vertices of a packet of profile main (spec codec 11.5), slice by slice.
class HeightSlices {
 public:
  /// Of a frame whose cells are there; all must outlive it.
  HeightSlices(const std::vector<Cell>& cells, std::int32_t step, std::uint32_t tools, HeightFrame& frame,
               PacketModels& models)
      : cells_(cells), step_(step), tools_(tools), frame_(frame), models_(models) {}

  /// Reads what stands in front of the heights.
  Status open(ByteSpan section) {
    const std::size_t count = frame_.around.sliceCount();
    ISOREEL_ASSIGN(const std::vector<ByteSpan> streams, readSlices(section, count));
    for (const ByteSpan stream : streams) slices_.push_back({RangeGet(stream), {}});
    models_.haveSlices(count);
    if (!cells_.empty()) models_.slices[0].heights.codeWeights(slices_[0].coder, {}, !frame_.moved.empty());
    return {};
  }
  /// Slices may be decoded side by side.
  void decode(std::size_t n, std::vector<std::array<std::int32_t, 3>>& vertices) {
    Slice& slice = slices_[n];
    const std::span<const Surroundings::Run> runs = frame_.around.slice(n);
    codeHeights(slice.coder, models_.slices[n].heights, models_.slices[0].heights.weights, runs, cells_,
                frame_, step_, tools_, [](std::uint32_t, std::int32_t, const HeightContext&) { return 0; });
    for (std::size_t i = runs.front().first; i < runs.back().end; ++i)
      vertices[i] = atHeight(frame_.predicted.points[i], frame_.predicted.normals[i], frame_.heights[i]);
    slice.status = endOf(slice.coder, "vertices");
  }
  Status status() const {
    for (const Slice& slice : slices_) ISOREEL_TRY(slice.status);
    return {};
  }

 private:
  struct alignas(64) Slice {
    RangeGet coder;
    Status status;
  };
  const std::vector<Cell>& cells_;
  std::int32_t step_;
  std::uint32_t tools_;
  HeightFrame& frame_;
  PacketModels& models_;
  std::vector<Slice> slices_;
};

}  // namespace isoreel
