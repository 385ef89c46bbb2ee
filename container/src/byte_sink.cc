// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/container/byte_sink.h>

#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "src/contents.h"
#include "src/file_output.h"

namespace isoreel {
namespace {

class StandardOutput final : public ByteSink {
 public:
  Status append(ByteSpan bytes) override {
    for (std::size_t done = 0; done < bytes.size();) {
      const ssize_t put = ::write(STDOUT_FILENO, bytes.data() + done, bytes.size() - done);
      if (put < 0 && errno == EINTR) continue;
      if (put < 0)
        return {ErrorCode::kIo, name() + ": cannot write: " + std::generic_category().message(errno)};
      done += static_cast<std::size_t>(put);
    }
    return {};
  }
  Status commit() override { return {}; }
  void discard() override {}
  std::string name() const override { return "standard output"; }
};

class MemorySink final : public ByteSink {
 public:
  explicit MemorySink(Bytes& bytes) : bytes_(bytes) {}
  Status append(ByteSpan bytes) override {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    return {};
  }
  Status commit() override { return {}; }
  void discard() override { bytes_.clear(); }
  std::string name() const override { return "memory"; }

 private:
  Bytes& bytes_;
};

}  // namespace

Result<std::unique_ptr<ByteSink>> createFile(const std::filesystem::path& path, bool overwrite) {
  ISOREEL_ASSIGN(auto file,
                 container::withoutThrowing([&] { return container::FileOutput::create(path, overwrite); }));
  return std::unique_ptr<ByteSink>(std::move(file));
}

Status copyAll(ByteSource& source, ByteSink& sink) {
  const auto copy = [&]() -> Status {
    Bytes buffer(std::size_t{1} << 20);
    for (std::uint64_t offset = 0;;) {
      ISOREEL_ASSIGN(const std::size_t got, source.read(offset, buffer));
      if (got == 0) return sink.commit();
      ISOREEL_TRY(sink.append(ByteSpan(buffer).first(got)));
      offset += got;
    }
  };
  Status status = container::withoutThrowing(copy);
  if (!status.ok()) sink.discard();
  return status;
}

std::unique_ptr<ByteSink> openStandardOutput() { return std::make_unique<StandardOutput>(); }

std::unique_ptr<ByteSink> openMemorySink(Bytes& bytes) { return std::make_unique<MemorySink>(bytes); }

}  // namespace isoreel
