// SPDX-License-Identifier: BSD-3-Clause
// Decoder::decode on arbitrary bytes: the packet with its checksums put right, cut short, at coarser levels,
// and with the counts of its header put right too, so that changed signs do not end before the vertices are
// read. In front of it may be the packet that it goes on from, which is decoded first each time: two bytes
// give its length (0: there is none), then come the two packets.
#include <isoreel/codec/decoder.h>

#include <cstdlib>

#include "repair.h"
#include "syntax/packet.h"

namespace {

using isoreel::Bytes;
using isoreel::ByteSpan;
using isoreel::Surface;

/// Enough for any seed; the limit is what keeps a small packet from asking for much memory.
constexpr std::uint32_t kMostVertices = 1u << 16;

/// What every surface promises, however it came about.
void check(const Surface& surface) {
  for (const auto& vertex : surface.vertices) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int64_t border = std::int64_t{surface.grid.nodes[axis] - 1} * isoreel::kCell;
      if (vertex[axis] < 0 || vertex[axis] > border) std::abort();
    }
  }
  for (const auto& quad : surface.quads) {
    for (const std::uint32_t corner : quad) {
      if (corner >= surface.vertices.size()) std::abort();
    }
  }
  if (surface.triangles().size() != 2 * surface.quads.size()) std::abort();
  if (surface.normals().size() != surface.vertices.size()) std::abort();
}

/// One decoder for all inputs, as in a player: what a bad packet leaves behind must not harm the next.
isoreel::Result<Surface> decode(ByteSpan packet, const isoreel::DecodeOptions& options) {
  static isoreel::Decoder decoder;
  auto surface = decoder.decode(packet, options);
  if (surface.ok()) check(*surface);
  return surface;
}

isoreel::DecodeOptions options(std::optional<std::uint32_t> level, bool prefix) {
  isoreel::DecodeOptions result;
  result.level = level;
  result.allow_prefix = prefix;
  result.max_vertices = kMostVertices;
  result.max_bytes = 1u << 26;
  return result;
}

/// Where vertex residuals start in the payload, or its end. Signs stand before them, and in P packets the
/// motion that the finer ones are predicted with.
std::size_t vertexStart(const isoreel::PacketHeader& header, std::size_t payload_bytes) {
  std::size_t start = 0;
  for (const auto& section : header.sections) {
    if (section.kind == static_cast<std::uint32_t>(isoreel::SectionKind::kVertices)) break;
    start += section.bytes;
  }
  return std::min(start, payload_bytes);
}

/// Decodes the packet right after the one before it, if there is any.
isoreel::Result<Surface> decodeAfter(ByteSpan before, ByteSpan packet, const isoreel::DecodeOptions& with) {
  if (!before.empty()) static_cast<void>(decode(before, options({}, false)));
  return decode(packet, with);
}

/// Decodes the signs alone, and then everything with the counts that they give.
void decodeWithTrueCounts(ByteSpan before, const Bytes& packet) {
  std::size_t offset = 0;
  auto header = isoreel::readPacketHeader(packet, &offset);
  if (!header.ok()) return;
  const ByteSpan payload = ByteSpan(packet).subspan(offset);
  header->vertices = kMostVertices;
  auto roomy = isoreel::writePacket(*header, payload);
  if (!roomy.ok()) return;
  const std::size_t signs = vertexStart(*header, payload.size());
  const ByteSpan cut = ByteSpan(*roomy).first(roomy->size() - payload.size() + signs);
  const auto surface = decodeAfter(before, cut, options({}, true));
  if (!surface.ok()) return;
  header->vertices = static_cast<std::uint32_t>(surface->vertices.size());
  header->faces = static_cast<std::uint32_t>(surface->quads.size());
  const auto whole = isoreel::writePacket(*header, payload);
  if (whole.ok()) static_cast<void>(decodeAfter(before, *whole, options({}, false)));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  isoreel::ByteReader in(ByteSpan(data, size));
  const std::size_t length = in.fixed<std::uint16_t>();
  if (in.truncated() || length > in.left()) return 0;
  const Bytes before = isoreel::fuzz::repairPacket(in.bytes(length));
  const Bytes packet = isoreel::fuzz::repairPacket(in.bytes(in.left()));
  static_cast<void>(decodeAfter(before, packet, options({}, false)));
  static_cast<void>(decodeAfter(before, packet, options(size % 4, true)));
  const ByteSpan cut = ByteSpan(packet).first(packet.size() - packet.size() / 4);
  static_cast<void>(decodeAfter(before, cut, options({}, true)));
  decodeWithTrueCounts(before, packet);
  return 0;
}
