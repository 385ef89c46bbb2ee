// SPDX-License-Identifier: BSD-3-Clause
// Payloads that are one zstd frame (spec container 1.1).
#pragma once

#include <isoreel/base/bytes.h>
#include <isoreel/base/status.h>

namespace isoreel::container {

Result<Bytes> compress(ByteSpan content);

/// `payload` must be exactly one zstd frame that states its content's size, at most `max` bytes: nothing is
/// allocated before that is checked (kLimit).
Result<Bytes> decompress(ByteSpan payload, std::uint64_t max);

}  // namespace isoreel::container
