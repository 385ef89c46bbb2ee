// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/container/byte_source.h>

#include "src/contents.h"

namespace isoreel::container {

/// Fills `contents` with every whole frame between the signature and `size` bytes, whatever else is damaged
/// (spec container 9.2). What had to be left out is listed in `contents.info.damage`. Time is linear in
/// `size`.
Status scanChunks(ByteSource& source, std::uint64_t size, Contents& contents);

}  // namespace isoreel::container
