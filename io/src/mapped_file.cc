// SPDX-License-Identifier: BSD-3-Clause
#include "src/mapped_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace isoreel::io {

Result<std::shared_ptr<const MappedFile>> MappedFile::open(const std::string& path, std::size_t size) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return {ErrorCode::kIo, fmt::format("{}: {}", path, std::strerror(errno))};
  // Asked of the open file, since its name may mean another one by now.
  struct stat facts = {};
  const bool sized = ::fstat(file, &facts) == 0;
  const bool same = sized && S_ISREG(facts.st_mode) && static_cast<std::size_t>(facts.st_size) == size;
  void* data = same ? ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file, 0) : MAP_FAILED;
  const int error = errno;
  ::close(file);
  if (sized && !same) {
    return {ErrorCode::kTruncated, fmt::format("{}: expected {} bytes, found {}", path, size, facts.st_size)};
  }
  if (data == MAP_FAILED)
    return {ErrorCode::kIo, fmt::format("{}: cannot be mapped: {}", path, std::strerror(error))};
  return std::shared_ptr<const MappedFile>(new MappedFile(data, size));
}

MappedFile::~MappedFile() { ::munmap(data_, size_); }

}  // namespace isoreel::io
