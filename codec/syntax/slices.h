// SPDX-License-Identifier: BSD-3-Clause
// The streams of slices in a section (spec codec 11.10).
#pragma once

#include <isoreel/base/bytes.h>
#include <isoreel/base/status.h>

#include <span>
#include <vector>

namespace isoreel {

/// Appends the section of some slices' streams: of several, their lengths but the last one's first.
Status writeSlices(std::span<const Bytes> streams, Bytes& out);

/// The streams of `count` slices in a section, whose bytes they refer to. Fails when they do not fit into it.
Result<std::vector<ByteSpan>> readSlices(ByteSpan section, std::size_t count);

}  // namespace isoreel
