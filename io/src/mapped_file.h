// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/base/bytes.h>
#include <isoreel/base/status.h>

#include <memory>
#include <string>

namespace isoreel::io {

/// A whole file mapped read-only. Who shortens a file while it is mapped gets a bus error from the system.
class MappedFile {
 public:
  /// Maps `path`, which must have exactly `size` > 0 bytes. Errors: kIo, kTruncated (size changed meanwhile).
  static Result<std::shared_ptr<const MappedFile>> open(const std::string& path, std::size_t size);
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;
  ~MappedFile();

  ByteSpan bytes() const { return {static_cast<const std::uint8_t*>(data_), size_}; }

 private:
  MappedFile(void* data, std::size_t size) : data_(data), size_(size) {}

  void* data_;
  std::size_t size_;
};

}  // namespace isoreel::io
