// SPDX-License-Identifier: BSD-3-Clause
#include "syntax/packet.h"

namespace isoreel {
namespace {

constexpr std::size_t kCrcBytes = 4;

}  // namespace

Result<Bytes> writePacket(PacketHeader header, ByteSpan payload) {
  header.payload_crc = crc32c(payload);
  Bytes head;
  ISOREEL_TRY(writeSized(head, header));
  if (kCrcBytes + head.size() + payload.size() > kMaxPacketBytes) {
    return {ErrorCode::kLimit, "packet of " + std::to_string(head.size() + payload.size()) +
                                   " bytes is above 268435455 (spec codec 3)"};
  }
  Bytes packet;
  packet.reserve(kCrcBytes + head.size() + payload.size());
  ByteWriter out(packet);
  out.fixed(crc32c(head));
  out.bytes(head);
  out.bytes(payload);
  return packet;
}

Result<PacketHeader> readPacketHeader(ByteSpan packet, std::size_t* payload_offset) {
  ByteReader in(packet);
  const std::uint32_t crc = in.fixed<std::uint32_t>();
  ByteReader length = in;
  const std::uint64_t size = length.varint();
  if (length.truncated() || length.malformed() || size > length.left()) {
    return {ErrorCode::kTruncated, "packet header: cut short, or its length is damaged (spec codec 3.1)"};
  }
  const std::size_t end = length.position() + static_cast<std::size_t>(size);
  if (crc32c(packet.subspan(kCrcBytes, end - kCrcBytes)) != crc) {
    return {ErrorCode::kBadData, "packet header: its CRC does not match (spec codec 3.1)"};
  }
  PacketHeader header;
  ISOREEL_TRY(readSized(in, header));
  if (payload_offset != nullptr) *payload_offset = end;
  return header;
}

}  // namespace isoreel
