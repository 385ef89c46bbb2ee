// SPDX-License-Identifier: BSD-3-Clause
#include "spool.h"

#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <system_error>

namespace isoreel::cli {
namespace {

constexpr const char* kName = "temporary file";

Status failure() {
  return {ErrorCode::kIo, std::string(kName) + ": " + std::generic_category().message(errno)};
}

class SpoolSink final : public ByteSink {
 public:
  explicit SpoolSink(std::shared_ptr<std::FILE> file) : file_(std::move(file)) {}
  Status append(ByteSpan bytes) override {
    if (std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) == bytes.size()) return {};
    return failure();
  }
  Status commit() override { return {}; }
  void discard() override {}
  std::string name() const override { return kName; }

 private:
  std::shared_ptr<std::FILE> file_;
};

class SpoolSource final : public ByteSource {
 public:
  explicit SpoolSource(std::shared_ptr<std::FILE> file) : file_(std::move(file)) {}
  Result<std::size_t> read(std::uint64_t offset, std::span<std::uint8_t> out) override {
    if (std::fflush(file_.get()) != 0) return failure();
    std::size_t done = 0;
    while (done < out.size()) {
      const ssize_t got =
          pread(fileno(file_.get()), out.data() + done, out.size() - done, static_cast<off_t>(offset + done));
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) return failure();
      if (got == 0) break;
      done += static_cast<std::size_t>(got);
    }
    return done;
  }
  std::optional<std::uint64_t> size() const override {
    std::fflush(file_.get());
    const off_t end = lseek(fileno(file_.get()), 0, SEEK_END);
    if (end < 0) return std::nullopt;
    return static_cast<std::uint64_t>(end);
  }
  std::string name() const override { return kName; }

 private:
  std::shared_ptr<std::FILE> file_;
};

}  // namespace

Result<Spool> makeSpool() {
  std::FILE* opened = std::tmpfile();
  if (opened == nullptr) return failure();
  const std::shared_ptr<std::FILE> file(opened, [](std::FILE* f) { std::fclose(f); });
  return Spool{std::make_unique<SpoolSink>(file), std::make_unique<SpoolSource>(file)};
}

}  // namespace isoreel::cli
