// SPDX-License-Identifier: BSD-3-Clause
#include "src/file_output.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdio>
#include <system_error>
#include <thread>

namespace isoreel::container {
namespace {

Status ioError(const std::filesystem::path& path, const std::string& what) {
  return {ErrorCode::kIo, path.string() + ": " + what};
}
std::string reason(int error) { return std::generic_category().message(error); }

Status existsError(const std::filesystem::path& path) {
  return ioError(path, "exists already, and overwriting was not asked for");
}

bool isThere(const std::filesystem::path& path) {
  struct stat facts {};
  return lstat(path.c_str(), &facts) == 0;
}

// Whether no other writer has the file. Who follows it looks at the lock now and then, for a moment each
// time.
bool lockForWriting(int file) {
  for (int i = 0; i < 10; ++i) {
    if (flock(file, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return false;
}

// Whether `path` still names the file that is open: another writer may have renamed it before we had the
// lock.
bool isOpenFile(const std::filesystem::path& path, int file) {
  struct stat named {
  }, opened{};
  return lstat(path.c_str(), &named) == 0 && fstat(file, &opened) == 0 && named.st_ino == opened.st_ino &&
         named.st_dev == opened.st_dev;
}

}  // namespace

Result<std::unique_ptr<FileOutput>> FileOutput::create(const std::filesystem::path& path, bool overwrite) {
  if (!overwrite && isThere(path)) return existsError(path);
  if (std::error_code ignored; std::filesystem::is_directory(path, ignored))
    return ioError(path, "is a directory");
  const std::filesystem::path part = path.string() + ".part";
  const int flags = O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | (overwrite ? 0 : O_EXCL);
  const int file = open(part.c_str(), flags, 0666);
  if (file < 0 && errno == EEXIST) {
    return ioError(part,
                   "exists already: another writer is at work on it, or one did not finish; "
                   "overwriting was not asked for");
  }
  if (file < 0) return ioError(part, "cannot create: " + reason(errno));
  std::unique_ptr<FileOutput> output(new FileOutput(path, part, file, overwrite));
  if (!lockForWriting(file)) {
    return ioError(part, "another writer is at work on it");
  }
  if (!isOpenFile(part, file)) return ioError(part, "another writer is at work on it");
  if (ftruncate(file, 0) != 0) return ioError(part, "cannot empty: " + reason(errno));
  return output;
}

Result<std::unique_ptr<FileOutput>> FileOutput::extend(const std::filesystem::path& path) {
  const int file = open(path.c_str(), O_RDWR | O_CLOEXEC);
  if (file < 0) return ioError(path, "cannot open for writing: " + reason(errno));
  std::unique_ptr<FileOutput> output(new FileOutput(path, path, file, false));
  struct stat facts {};
  if (fstat(file, &facts) != 0 || !S_ISREG(facts.st_mode)) return ioError(path, "is not a file");
  if (!lockForWriting(file)) {
    return ioError(path, "another writer is at work on it");
  }
  output->start_ = output->bytes_ = static_cast<std::uint64_t>(facts.st_size);
  return output;
}

Status FileOutput::keepFirst(std::uint64_t bytes) {
  if (bytes < bytes_ && ftruncate(file_, static_cast<off_t>(bytes)) != 0) return error("cut", errno);
  start_ = bytes_ = bytes;
  return {};
}

FileOutput::FileOutput(std::filesystem::path path, std::filesystem::path part, int file, bool overwrite)
    : path_(std::move(path)), part_(std::move(part)), overwrite_(overwrite), file_(file) {}

FileOutput::~FileOutput() { release(); }

void FileOutput::release() {
  if (file_ >= 0) close(file_);
  file_ = -1;
}

Status FileOutput::error(const char* doing, int number) const {
  return ioError(
      part_, std::string("cannot ") + doing + " at byte " + std::to_string(bytes_) + ": " + reason(number));
}

Status FileOutput::append(ByteSpan bytes) {
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t put =
        pwrite(file_, bytes.data() + done, bytes.size() - done, static_cast<off_t>(bytes_ + done));
    if (put < 0 && errno == EINTR) continue;
    if (put < 0) {
      const int number = errno;
      // What was written of it is no whole chunk. If cutting it off fails too, readers skip it as any cut
      // chunk.
      [[maybe_unused]] const int ignored = ftruncate(file_, static_cast<off_t>(bytes_));
      return error("write", number);
    }
    done += static_cast<std::size_t>(put);
  }
  bytes_ += bytes.size();
  return {};
}

Status FileOutput::sync() { return fsync(file_) == 0 ? Status() : error("flush", errno); }

Status FileOutput::commit() {
  ISOREEL_TRY(sync());
  if (path_ == part_) {
    release();
    return {};
  }
  ISOREEL_TRY(rename());
  const std::filesystem::path folder =
      path_.has_parent_path() ? path_.parent_path() : std::filesystem::path(".");
  const int directory = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (directory >= 0) {
    const int number = fsync(directory) == 0 ? 0 : errno;
    close(directory);
    if (number != 0 && number != EINVAL) return ioError(folder, "cannot flush: " + reason(number));
  }
  const int closed = close(file_);
  file_ = -1;
  return closed == 0 ? Status() : ioError(path_, "cannot close: " + reason(errno));
}

// Never replaces a file that came to exist meanwhile unless that was asked for: the check and the rename are
// one step.
Status FileOutput::rename() const {
  int result = 0;
  if (overwrite_) {
    result = std::rename(part_.c_str(), path_.c_str());
  } else {
    result = renameat2(AT_FDCWD, part_.c_str(), AT_FDCWD, path_.c_str(), RENAME_NOREPLACE);
    if (result != 0 &&
        (errno == EINVAL || errno == ENOSYS)) {  // a file system that cannot: a hard link does the same
      result = link(part_.c_str(), path_.c_str());
      if (result == 0) result = unlink(part_.c_str());
    }
  }
  if (result == 0) return {};
  if (errno == EEXIST) {
    return ioError(path_, "came to exist meanwhile, and overwriting was not asked for; " + part_.string() +
                              " is complete and kept");
  }
  return ioError(path_, "cannot rename " + part_.string() + " to it: " + reason(errno));
}

void FileOutput::discard() {
  if (file_ < 0) return;
  if (path_ != part_) {
    unlink(part_.c_str());
  } else {
    // What stays if this fails is found by scan, as after a kill.
    [[maybe_unused]] const int ignored = ftruncate(file_, static_cast<off_t>(start_));
  }
  release();
}

}  // namespace isoreel::container
