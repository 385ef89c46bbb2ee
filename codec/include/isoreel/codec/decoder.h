// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/base/parallel.h>
#include <isoreel/codec/cell.h>
#include <isoreel/codec/motion_block.h>
#include <isoreel/codec/packet_header.h>
#include <isoreel/codec/surface.h>

#include <memory>
#include <optional>

namespace isoreel {

struct DecodeOptions {
  /// Octree level to stop at: 0 is the root; a level at or above the deepest, or none, gives the full
  /// surface. At a coarser level, cells are larger by a power of two and vertices lie where the signs put
  /// them. Where P packets may follow, the packet is decoded whole all the same, and they can go on from it.
  std::optional<std::uint32_t> level;
  /// Take a packet that was cut short, and decode the levels that are whole.
  bool allow_prefix = false;
  /// Refuse packets that say they hold more.
  std::uint32_t max_vertices = 1u << 27;
  /// Refuse packets (kLimit) whose decoding would take more bytes, beyond the 1.3 megabytes of every decoder.
  /// Each part is reckoned before it is taken, at its most; what is kept from the packet before counts, and
  /// the surface that is given. P frames of a ball (2,252 vertices) are reckoned at 210 bytes a vertex, 420
  /// in profile main; many small pieces at some kilobytes, for the distance field around them.
  std::uint64_t max_bytes = std::uint64_t{8} << 30;
  /// Gets the blocks of a P packet that is decoded whole; emptied for any other packet. On an error it may
  /// hold some. The caller's, may be null.
  std::vector<MotionBlock>* motion = nullptr;

  bool operator==(const DecodeOptions&) const = default;
};

/// Turns packets into surfaces. Integer throughout: the same surface on every machine. Safe for untrusted
/// input: it fails, or gives some surface, but neither crashes nor takes memory out of proportion to the
/// packet's size. One decoder per thread. A copy goes on from the same packet.
class Decoder {
 public:
  Decoder();
  /// With `parallel`, parts of each packet are decoded side by side; the surfaces are the same.
  explicit Decoder(ParallelFor parallel);
  Decoder(const Decoder&);
  Decoder& operator=(const Decoder&);
  Decoder(Decoder&&) noexcept;
  Decoder& operator=(Decoder&&) noexcept;
  ~Decoder();

  /// Decodes one packet. A P packet must come right after the packet that it is predicted from, decoded by
  /// this decoder and not as a prefix. Errors: kNotFound (a P packet where that is not so), kBadData (a rule
  /// is broken, a CRC or the surface hash does not agree), kTruncated, kUnsupported (a newer version, profile
  /// or tool), kLimit (more than `options` allow, or
  /// than there is). The full surface is checked against the packet's hash.
  Result<Surface> decode(ByteSpan packet, const DecodeOptions& options = {});

  /// Of the full surface decoded last: the cell that each vertex lies in, with its signs; of a cell with
  /// several vertices, with the signs of each one's sheet (spec codec 5.5). Empty when there is none, as
  /// after a coarser level alone or an error. Stays good until the next decode().
  const std::vector<Cell>& cells() const;

  /// Memory that a copy takes, about 0.8 megabytes and 24 bytes for each vertex where P packets may follow;
  /// and what it will be, about, after a packet of so many vertices.
  std::uint64_t bytes() const;
  std::uint64_t bytes(std::uint64_t vertices) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace isoreel
