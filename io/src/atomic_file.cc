// SPDX-License-Identifier: BSD-3-Clause
#include "src/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>

namespace isoreel::io {
namespace {

// 0, or the errno of what failed.
int writeAll(int file, std::string_view content) {
  while (!content.empty()) {
    const ssize_t written = ::write(file, content.data(), content.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    content.remove_prefix(static_cast<std::size_t>(written));
  }
  return 0;
}

}  // namespace

Status writeWhole(const std::filesystem::path& path, std::string_view content) {
  // Unlike mkstemp's, a file opened this way has the permissions that the user's umask gives to new files.
  static std::atomic<unsigned> counter = 0;
  const std::string part = fmt::format("{}.{}-{}.part", path.string(), ::getpid(), counter++);
  const int file = ::open(part.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (file < 0)
    return {ErrorCode::kIo, fmt::format("{}: cannot be created: {}", path.string(), std::strerror(errno))};
  int error = writeAll(file, content);
  if (::close(file) != 0 && error == 0) error = errno;
  if (error == 0 && ::rename(part.c_str(), path.c_str()) != 0) error = errno;
  if (error == 0) return {};
  ::unlink(part.c_str());
  return {ErrorCode::kIo, fmt::format("{}: cannot be written: {}", path.string(), std::strerror(error))};
}

}  // namespace isoreel::io
