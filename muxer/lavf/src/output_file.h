// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/base/status.h>

#include <filesystem>

#include "av.h"

namespace isoreel::lavf {

/// A muxer's file, PATH.part until it is finished. One that is not is removed.
class OutputFile {
 public:
  OutputFile() = default;
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  ~OutputFile();

  /// `muxer`: libavformat's name.
  Status open(const std::filesystem::path& path, const char* muxer, bool overwrite);
  AVFormatContext& context() { return *context_; }
  /// Behind the trailer: flushes to disk and renames.
  Status commit();
  /// `code` of libavformat's as an error that names the file; fine for 0 and above.
  Status check(int code) const;

 private:
  Status failure(const std::string& why) const;

  std::filesystem::path path_, part_;
  bool overwrite_ = false;
  AVFormatContext* context_ = nullptr;
};

}  // namespace isoreel::lavf
