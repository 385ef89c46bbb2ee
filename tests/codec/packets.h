// SPDX-License-Identifier: BSD-3-Clause
// Packets taken apart and put together again, with every checksum made right: damage that parsing can get to.
#pragma once

#include <isoreel/codec/packet_header.h>
#include <isoreel/codec/surface.h>

#include <gtest/gtest.h>

#include "syntax/packet.h"

namespace isoreel::made {

/// A packet's header and the bytes of its sections.
struct Parts {
  PacketHeader header;
  std::vector<Bytes> sections;
};

inline Parts taken(ByteSpan packet) {
  Parts parts;
  std::size_t at = 0;
  auto header = readPacketHeader(packet, &at);
  EXPECT_TRUE(header.ok()) << header.status().message();
  if (!header) return parts;
  parts.header = *std::move(header);
  for (const Section& s : parts.header.sections) {
    const ByteSpan content = packet.subspan(at, s.bytes);
    parts.sections.emplace_back(content.begin(), content.end());
    at += s.bytes;
  }
  return parts;
}

/// The packet of these parts; lengths and CRCs are made to fit.
inline Bytes joined(Parts parts) {
  Bytes payload;
  for (std::size_t i = 0; i < parts.sections.size(); ++i) {
    parts.header.sections[i].bytes = static_cast<std::uint32_t>(parts.sections[i].size());
    payload.insert(payload.end(), parts.sections[i].begin(), parts.sections[i].end());
  }
  auto packet = writePacket(parts.header, payload);
  EXPECT_TRUE(packet.ok()) << packet.status().message();
  return packet ? *std::move(packet) : Bytes{};
}

/// The section of this kind with the most bytes.
inline std::size_t largestSection(const Parts& parts, SectionKind kind) {
  std::size_t best = parts.sections.size();
  for (std::size_t i = 0; i < parts.sections.size(); ++i) {
    if (parts.header.sections[i].kind != static_cast<std::uint32_t>(kind)) continue;
    if (best == parts.sections.size() || parts.sections[i].size() > parts.sections[best].size()) best = i;
  }
  return best;
}

/// The bytes become a configuration record with another byte at `at`, its CRC made right.
inline void changeRecord(Bytes& record, std::size_t at, std::uint8_t value) {
  record[at] = value;
  const std::size_t end = record.size() - 4;
  const std::uint32_t crc = crc32c(ByteSpan(record).first(end));
  for (std::size_t i = 0; i < 4; ++i) record[end + i] = static_cast<std::uint8_t>(crc >> (8 * i));
}

/// A copy of the packet whose header has gone through change(Bytes&): headers that no writer makes.
template <class Change>
Bytes withHeader(ByteSpan packet, Change change) {
  ByteReader in(packet);
  in.fixed<std::uint32_t>();
  const ByteSpan old = in.bytes(static_cast<std::size_t>(in.varint()));
  Bytes fields(old.begin(), old.end());
  change(fields);
  Bytes head;
  ByteWriter out(head);
  out.varint(fields.size());
  out.bytes(fields);
  Bytes result;
  ByteWriter whole(result);
  whole.fixed(crc32c(head));
  whole.bytes(head);
  whole.bytes(packet.subspan(in.position()));
  return result;
}

/// A copy of the packet whose header has `extra` bytes behind its fields, as a later minor version may.
inline Bytes withLongerHeader(ByteSpan packet, std::size_t extra) {
  return withHeader(packet, [&](Bytes& fields) { fields.resize(fields.size() + extra, 0xA5); });
}

/// Whatever the decoder gave must be safe to use.
inline void expectUsable(const Surface& surface) {
  for (const Quad& quad : surface.quads) {
    for (const std::uint32_t i : quad) ASSERT_LT(i, surface.vertices.size());
  }
  for (const GridPosition& p : surface.vertices) {
    for (std::size_t k = 0; k < 3; ++k) {
      ASSERT_GE(p[k], 0);
      ASSERT_LE(p[k], static_cast<std::int32_t>(surface.grid.nodes[k] - 1) * kCell);
    }
  }
}

}  // namespace isoreel::made
