// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/container/byte_sink.h>

namespace isoreel::container {

/// A file that is written: locked (flock) while it is open, so a second writer can tell one at work from what
/// a killed one left. Messages name the file.
class FileOutput final : public ByteSink {
 public:
  /// A new one, which grows as PATH.part and becomes PATH when it is whole.
  static Result<std::unique_ptr<FileOutput>> create(const std::filesystem::path& path, bool overwrite);
  /// One that is there, to be continued: commit() only flushes it, discard() takes back what was appended.
  static Result<std::unique_ptr<FileOutput>> extend(const std::filesystem::path& path);
  ~FileOutput() override;
  FileOutput(const FileOutput&) = delete;
  FileOutput& operator=(const FileOutput&) = delete;

  /// Of a file that is continued, before anything is appended: cuts off what stands behind its first `bytes`.
  Status keepFirst(std::uint64_t bytes);
  /// Appends with one call to the system, if that takes it all. After an error the file ends where it ended
  /// before.
  Status append(ByteSpan bytes) override;
  Status sync() override;
  Status commit() override;
  void discard() override;
  std::string name() const override { return part_.string(); }

 private:
  FileOutput(std::filesystem::path path, std::filesystem::path part, int file, bool overwrite);
  Status error(const char* doing, int number) const;
  Status rename() const;
  void release();

  const std::filesystem::path path_;  // the same as part_ for a file that is continued
  const std::filesystem::path part_;
  const bool overwrite_;
  int file_;
  std::uint64_t start_ = 0;  // bytes that were there
  std::uint64_t bytes_ = 0;
};

}  // namespace isoreel::container
