// SPDX-License-Identifier: BSD-3-Clause
#include "output_file.h"

#include <fcntl.h>
#include <unistd.h>

namespace isoreel::lavf {

OutputFile::~OutputFile() {
  if (context_ != nullptr) {
    avio_closep(&context_->pb);
    avformat_free_context(context_);
  }
  std::error_code ignored;
  if (!part_.empty()) std::filesystem::remove(part_, ignored);
}

Status OutputFile::failure(const std::string& why) const {
  return {ErrorCode::kIo, path_.string() + ": cannot be written: " + why};
}

Status OutputFile::check(int code) const { return code < 0 ? failure(reason(code)) : Status(); }

Status OutputFile::open(const std::filesystem::path& path, const char* muxer, bool overwrite) {
  av_log_set_level(AV_LOG_QUIET);  // what goes wrong comes back as a Status
  path_ = path;
  overwrite_ = overwrite;
  std::filesystem::path part = path;
  part += ".part";
  std::error_code ignored;
  for (const std::filesystem::path& there : {path, part}) {
    if (!overwrite && std::filesystem::exists(there, ignored))
      return failure(there.filename().string() + " is there already");
  }
  // "file:" keeps a colon in a name from being read as a protocol.
  const std::string url = "file:" + part.string();
  ISOREEL_TRY(check(avformat_alloc_output_context2(&context_, nullptr, muxer, url.c_str())));
  context_->flags |= AVFMT_FLAG_BITEXACT;
  ISOREEL_TRY(check(avio_open(&context_->pb, context_->url, AVIO_FLAG_WRITE)));
  part_ = std::move(part);
  return {};
}

Status OutputFile::commit() {
  ISOREEL_TRY(check(avio_closep(&context_->pb)));
  const int file = ::open(part_.c_str(), O_RDONLY | O_CLOEXEC);
  const bool flushed = file >= 0 && fsync(file) == 0;
  if (file >= 0) close(file);
  if (!flushed) return failure("the disk does not take it");
  std::error_code error;
  if (!overwrite_ && std::filesystem::exists(path_, error))
    return failure("it has come to be there meanwhile");
  std::filesystem::rename(part_, path_, error);
  if (error) return failure(error.message());
  part_.clear();
  return {};
}

}  // namespace isoreel::lavf
