// SPDX-License-Identifier: BSD-3-Clause
// Checksums and compression are made to agree before an input is tried: a fuzzer that only ever meets
// checksum errors tests nothing else. (That damage is found at all is what tests/container and tests/codec
// prove, bit by bit.)
#pragma once

#include <isoreel/base/bytes.h>

namespace isoreel::fuzz {

/// The last four bytes become the CRC-32C of those before (spec codec 2).
void repairTrailingCrc(Bytes& bytes);

/// A packet in which every CRC is right, that of the configuration record inside it too, and whose last
/// section is as long as what is left for it (spec codec 3). Bytes that have no header come back as they are.
Bytes repairPacket(ByteSpan packet);

/// An `.isr` file in which every CRC of signature and chunks is right. Payloads of TAGS and INDX that are not
/// zstd are compressed, and the footer moves with them, so that a fuzzer can change what is inside.
Bytes repairFile(ByteSpan file);

/// The other way: TAGS and INDX payloads decompressed, as seeds for repairFile().
Bytes openedFile(ByteSpan file);

}  // namespace isoreel::fuzz
