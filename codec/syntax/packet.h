// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/codec/packet_header.h>

namespace isoreel {

/// The packet: header with its CRC, then the payload that its section table describes. Sets
/// header.payload_crc.
Result<Bytes> writePacket(PacketHeader header, ByteSpan payload);

}  // namespace isoreel
