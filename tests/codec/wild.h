// SPDX-License-Identifier: BSD-3-Clause
// P packets that keep every rule and that no encoder would write: any prediction header, vectors and
// residuals.
#pragma once

#include "encode/frame_coder.h"
#include "inter/vertex_stream.h"
#include "intra/height_stream.h"
#include "made.h"

namespace isoreel::made {

/// What a wild packet is made of. Vectors and residuals are random, within these limits.
struct Wild {
  PredictionHeader header;  // profile main: its size of blocks and step of vectors
  std::uint32_t step = kCell / 16, tangential_step = kCell / 8;
  std::int32_t farthest = 2 * kCell;  // of vectors, 1/16384 of a cell
  std::int32_t largest = 4;           // of residuals
  std::uint32_t still = 4;            // one block of so many stands still
};

/// A header with weights and levels all over their ranges.
PredictionHeader wildHeader(Random& random, std::uint32_t block_log2, std::uint32_t vector_step);

/// An I packet of profile main with random weights and residuals of up to `largest`.
Bytes wildHeights(const Made& made, std::uint32_t step, std::int32_t largest, std::uint32_t seed);

/// Packets one after the other, the first one an I packet. The volumes must have grids of the same size.
class WildSequence {
 public:
  explicit WildSequence(std::uint32_t seed, Profile profile = Profile::kClassic)
      : random_(seed), main_(profile == Profile::kMain) {}
  Bytes intra(const Made& made, std::uint32_t step = kCell / 16);
  Bytes predicted(const Made& made, const Wild& wild);
  Random& random() { return random_; }
  /// How many vertices of P packets had a prediction of each confidence.
  const std::array<std::size_t, kConfidences>& confidences() const { return confidences_; }

 private:
  Bytes packet(const Made& made, std::span<const Cell> cells, const CellIndex& index, PacketHeader header,
               CodedFrame coded);
  std::int32_t within(std::int32_t limit) {
    return static_cast<std::int32_t>(random_() % (2 * static_cast<std::uint32_t>(limit) + 1)) - limit;
  }

  HeightWeights weights();
  void heights(const Made& made, std::span<const Cell> cells, const CellIndex& index,
               const MotionField& motion, const Wild& wild, CodedFrame& coded);

  Random random_;
  bool main_;
  std::uint64_t number_ = 0;
  isoreel::Reference reference_;
  PacketModels models_;
  std::array<std::size_t, kConfidences> confidences_{};
};

/// Adds what `write(coder)` writes behind `head` to a payload, as a section when it has any bytes.
template <class Write>
void addSection(CodedFrame& coded, SectionKind kind, std::uint32_t level, ByteSpan head, Write write) {
  const std::size_t start = coded.payload.size();
  coded.payload.insert(coded.payload.end(), head.begin(), head.end());
  RangePut coder(coded.payload);
  write(coder);
  coder.finish();
  if (coded.payload.size() == start) return;
  coded.sections.push_back(
      {static_cast<std::uint32_t>(kind), level, static_cast<std::uint32_t>(coded.payload.size() - start)});
}

}  // namespace isoreel::made
