// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/container/byte_source.h>

#include "src/contents.h"

namespace isoreel::container {

/// Fills `contents` from the index, or else by scan.
Status openContents(ByteSource& source, Contents& contents);

/// `count` bytes, which the caller knows to lie inside the source.
Result<Bytes> readExactly(ByteSource& source, std::uint64_t offset, std::uint64_t count);

/// The packet in the chunk that `frame` lists, everything checked. One read.
Result<Bytes> readPacket(ByteSource& source, std::uint64_t track, const FrameEntry& frame);
/// The same of a chunk that was read already.
Result<Bytes> packetOf(Bytes chunk, std::uint64_t track, const FrameEntry& frame);

}  // namespace isoreel::container
