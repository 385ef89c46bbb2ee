// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/container/byte_source.h>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <limits>
#include <system_error>
#include <thread>

namespace isoreel {
namespace {

std::string reason(int error) { return std::generic_category().message(error); }

class FileSource final : public ByteSource {
 public:
  FileSource(int file, std::string name, std::optional<std::uint64_t> size)
      : file_(file), name_(std::move(name)), size_(size) {}
  FileSource(const FileSource&) = delete;
  FileSource& operator=(const FileSource&) = delete;
  ~FileSource() override {
    if (file_ != STDIN_FILENO) close(file_);
  }

  Result<std::size_t> read(std::uint64_t offset, std::span<std::uint8_t> out) override {
    if (size_ && offset > static_cast<std::uint64_t>(std::numeric_limits<off_t>::max()) - out.size())
      return std::size_t{0};
    if (!size_) ISOREEL_TRY(skipTo(offset));
    return fill(offset, out);
  }
  std::optional<std::uint64_t> size() const override { return size_; }
  std::string name() const override { return name_; }

 private:
  // A call may give less than was asked for, of a pipe above all; only 0 is the end.
  Result<std::size_t> fill(std::uint64_t offset, std::span<std::uint8_t> out) {
    std::size_t done = 0;
    while (done < out.size()) {
      const std::span<std::uint8_t> rest = out.subspan(done);
      const ssize_t got = size_ ? pread(file_, rest.data(), rest.size(), static_cast<off_t>(offset + done))
                                : ::read(file_, rest.data(), rest.size());
      if (got < 0 && errno == EINTR) continue;
      if (got < 0)
        return {ErrorCode::kIo,
                "cannot read at byte " + std::to_string(offset + done) + ": " + reason(errno)};
      if (got == 0) break;
      done += static_cast<std::size_t>(got);
    }
    if (!size_) position_ += done;
    return done;
  }

  Status skipTo(std::uint64_t offset) {
    if (offset < position_) {
      return {ErrorCode::kInvalidArgument, "cannot go back from byte " + std::to_string(position_) + " to " +
                                               std::to_string(offset) + " in a pipe"};
    }
    Bytes scratch(65536);
    while (position_ < offset) {
      const std::uint64_t count = std::min<std::uint64_t>(scratch.size(), offset - position_);
      ISOREEL_ASSIGN(const std::size_t got,
                     fill(position_, std::span(scratch).first(static_cast<std::size_t>(count))));
      if (got < count) break;
    }
    return {};
  }

  const int file_;
  const std::string name_;
  const std::optional<std::uint64_t> size_;
  std::uint64_t position_ = 0;  // of a pipe
};

class MemorySource final : public ByteSource {
 public:
  MemorySource(Bytes bytes, std::string name) : bytes_(std::move(bytes)), name_(std::move(name)) {}

  Result<std::size_t> read(std::uint64_t offset, std::span<std::uint8_t> out) override {
    if (offset >= bytes_.size()) return std::size_t{0};
    const ByteSpan rest = ByteSpan(bytes_).subspan(static_cast<std::size_t>(offset));
    const std::size_t count = std::min(rest.size(), out.size());
    std::copy_n(rest.begin(), count, out.begin());
    return count;
  }
  std::optional<std::uint64_t> size() const override { return bytes_.size(); }
  std::string name() const override { return name_; }

 private:
  const Bytes bytes_;
  const std::string name_;
};

/// What grows is not seekable: how long it is nobody knows.
class FollowedFile final : public ByteSource {
 public:
  FollowedFile(int file, std::string name, std::function<bool()> stopped)
      : file_(file), name_(std::move(name)), stopped_(std::move(stopped)) {}
  FollowedFile(const FollowedFile&) = delete;
  FollowedFile& operator=(const FollowedFile&) = delete;
  ~FollowedFile() override { close(file_); }

  Result<std::size_t> read(std::uint64_t offset, std::span<std::uint8_t> out) override {
    bool last_look = false;  // the writer is gone, and what it left is looked for once more
    for (std::size_t done = 0;;) {
      const ssize_t got =
          pread(file_, out.data() + done, out.size() - done, static_cast<off_t>(offset + done));
      if (got < 0 && errno == EINTR) continue;
      if (got < 0)
        return {ErrorCode::kIo,
                "cannot read at byte " + std::to_string(offset + done) + ": " + reason(errno)};
      done += static_cast<std::size_t>(got);
      if (done == out.size() || (got == 0 && last_look)) return done;
      if (got > 0) continue;
      last_look = !written();
      if (last_look) continue;
      if (stopped_()) return {ErrorCode::kIo, "interrupted"};
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }
  std::optional<std::uint64_t> size() const override { return std::nullopt; }
  std::string name() const override { return name_; }

 private:
  bool written() const {
    if (flock(file_, LOCK_SH | LOCK_NB) != 0) return errno == EWOULDBLOCK;
    flock(file_, LOCK_UN);
    return false;
  }

  const int file_;
  const std::string name_;
  const std::function<bool()> stopped_;
};

Error openError(const std::filesystem::path& path, int error) {
  std::string message = path.string() + ": cannot open: " + reason(error);
  std::error_code ignored;
  const std::filesystem::path part = path.string() + ".part";
  if (error == ENOENT && std::filesystem::exists(part, ignored)) {
    message += "; " + part.string() + " is there, the frames of a writer that has not finished";
  }
  return {error == ENOENT ? ErrorCode::kNotFound : ErrorCode::kIo, std::move(message)};
}

}  // namespace

Result<std::unique_ptr<ByteSource>> openFile(const std::filesystem::path& path) {
  const bool standard_input = path == "-";
  const std::string name = standard_input ? "standard input" : path.string();
  const int file = standard_input ? STDIN_FILENO : open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return openError(path, errno);
  struct stat facts {};
  const int error = fstat(file, &facts) == 0 ? 0 : errno;
  if (error != 0 || S_ISDIR(facts.st_mode)) {
    if (!standard_input) close(file);
    return {ErrorCode::kIo, name + ": " + (error != 0 ? reason(error) : std::string("is a directory"))};
  }
  std::optional<std::uint64_t> size;
  if (S_ISREG(facts.st_mode)) size = static_cast<std::uint64_t>(facts.st_size);
  return std::unique_ptr<ByteSource>(std::make_unique<FileSource>(file, name, size));
}

Result<std::unique_ptr<ByteSource>> followFile(const std::filesystem::path& path,
                                               std::function<bool()> stopped) {
  std::filesystem::path there = path;
  int file = open(there.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0 && errno == ENOENT) {
    there += ".part";
    file = open(there.c_str(), O_RDONLY | O_CLOEXEC);
  }
  if (file < 0) return openError(path, errno);
  return std::unique_ptr<ByteSource>(
      std::make_unique<FollowedFile>(file, there.string(), std::move(stopped)));
}

std::unique_ptr<ByteSource> openMemory(Bytes bytes, std::string name) {
  return std::make_unique<MemorySource>(std::move(bytes), std::move(name));
}

}  // namespace isoreel
