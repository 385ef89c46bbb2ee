// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/base/bytes.h>
#include <isoreel/base/status.h>

#include <filesystem>
#include <memory>
#include <string>

namespace isoreel::container {

/// A file that grows as PATH.part and becomes PATH when it is whole. The part is locked (flock) while it is
/// open, so a second writer can tell one at work from what a killed one left. Messages name the file.
class FileOutput {
 public:
  static Result<std::unique_ptr<FileOutput>> create(const std::filesystem::path& path, bool overwrite);
  ~FileOutput();
  FileOutput(const FileOutput&) = delete;
  FileOutput& operator=(const FileOutput&) = delete;

  /// Appends with one call to the system, if that takes it all. After an error the file ends where it ended
  /// before.
  Status append(ByteSpan bytes);
  /// Flushes to disk, renames PATH.part to PATH, flushes the folder.
  Status commit();
  /// Removes the part.
  void remove();
  std::uint64_t bytes() const { return bytes_; }
  std::string name() const { return part_.string(); }

 private:
  FileOutput(std::filesystem::path path, std::filesystem::path part, int file, bool overwrite);
  Status error(const char* doing, int number) const;
  Status rename() const;
  void release();

  const std::filesystem::path path_;
  const std::filesystem::path part_;
  const bool overwrite_;
  int file_;
  std::uint64_t bytes_ = 0;
};

}  // namespace isoreel::container
