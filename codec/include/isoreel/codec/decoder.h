// SPDX-License-Identifier: BSD-3-Clause
#pragma once

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
  /// Refuse packets that say they hold more. A surface takes about 60 bytes a vertex while it is
  /// decoded, 120 where P packets may follow, 180 in profile main.
  std::uint32_t max_vertices = 1u << 27;
};

/// Turns packets into surfaces. Integer throughout: the same surface on every machine. Safe for untrusted
/// input: it fails, or gives some surface, but neither crashes nor takes memory out of proportion to the
/// packet's size. One decoder per thread.
class Decoder {
 public:
  Decoder();
  Decoder(Decoder&&) noexcept;
  Decoder& operator=(Decoder&&) noexcept;
  ~Decoder();

  /// Decodes one packet. A P packet must come right after the packet that it is predicted from, decoded by
  /// this decoder and not as a prefix. Errors: kNotFound (a P packet where that is not so), kBadData (a rule
  /// is broken, a CRC or the surface hash does not agree), kTruncated, kUnsupported (a newer version, profile
  /// or tool). The full surface is checked against the packet's hash.
  Result<Surface> decode(ByteSpan packet, const DecodeOptions& options = {});

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace isoreel
