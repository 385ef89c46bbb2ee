// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/base/status.h>

#include "src/format.h"

namespace isoreel::container {

/// The 32 bytes that a file starts with, CRC included.
Result<Bytes> makeSignature(const Uuid& uuid);

/// A name for a file made of its track record and its first frame chunk's payload: the same content has the
/// same UUID (version 8 of RFC 9562, spec container 2.3). `first_frame` is empty for a file without frames.
Uuid makeUuid(ByteSpan track_record, ByteSpan first_frame);

struct SignatureFacts {
  Signature signature;
  bool crc_good = false;  // when not, nothing but the magic can be relied on
};
/// `bytes` are the file's first Signature::kBytes, or all when it has fewer. Fails when this is no `.isr`
/// file (and says what a transfer in text mode did to it, if that was it), when it is cut, and when a good
/// signature names a version that this reader does not know.
Result<SignatureFacts> readSignature(ByteSpan bytes);

/// kUnsupported when this reader does not know `version`, kBadData for 0.
Status checkVersion(std::uint8_t version);

}  // namespace isoreel::container
