// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/base/status.h>

#include <cstdint>
#include <string>

namespace isoreel::io {

/// OpenVDB trusts the lengths in a file, allocates by them, and reads zeros past the end. This walks the
/// file's header, its list of grids and their metadata, and sees that every length and offset lies within the
/// file's `size` bytes. The trees themselves are left to OpenVDB. Errors: kTruncated, kBadData, kUnsupported
/// (older than file version 222).
Status checkVdbLayout(const std::string& path, std::uint64_t size);

}  // namespace isoreel::io
