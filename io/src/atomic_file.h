// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/base/status.h>

#include <filesystem>
#include <string_view>

namespace isoreel::io {

/// Writes `content` to `path`, over what may be there, through a temporary file in the same folder: `path` is
/// never seen half-written, and on failure nothing new is left. Errors: kIo.
Status writeWhole(const std::filesystem::path& path, std::string_view content);

}  // namespace isoreel::io
