// SPDX-License-Identifier: BSD-3-Clause
// What verbs share when they write and print.
#pragma once

#include <fmt/format.h>
#include <isoreel/base/status.h>

#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>

namespace isoreel::cli {

/// Fails when `path` must not be written: it is there and `force` is false, or it is there and is no file. A
/// finished file is renamed over it, and --force on a device such as /dev/null must not do that.
inline Status mayWrite(const std::filesystem::path& path, bool force) {
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) return {};
  if (!std::filesystem::is_regular_file(path, ignored)) {
    return {ErrorCode::kIo, path.string() + ": is there already, and is not a file"};
  }
  if (!force) return {ErrorCode::kIo, path.string() + ": is there already (--force replaces it)"};
  return {};
}

/// fmt::print throws when stderr cannot be written, and then there is nobody to tell.
template <class... Values>
void complain(fmt::format_string<Values...> format, Values&&... values) {
  std::fputs(fmt::format(format, std::forward<Values>(values)...).c_str(), stderr);
}

/// "1 frame", "2 frames".
inline std::string counted(std::uint64_t count, std::string_view noun) {
  return fmt::format("{} {}{}", count, noun, count == 1 ? "" : "s");
}

}  // namespace isoreel::cli
