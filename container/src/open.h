// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/container/byte_source.h>

#include "src/contents.h"

namespace isoreel::container {

/// Fills `contents` from the index, or else by scan.
Status openContents(ByteSource& source, Contents& contents);

/// `count` bytes, which the caller knows to lie inside the source.
Result<Bytes> readExactly(ByteSource& source, std::uint64_t offset, std::uint64_t count);

}  // namespace isoreel::container
