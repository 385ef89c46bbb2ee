// SPDX-License-Identifier: BSD-3-Clause
// libavformat's objects, owned.
#pragma once

#include <isoreel/base/status.h>

extern "C" {
#include <libavformat/avformat.h>
}

#include <memory>
#include <string>

namespace isoreel::lavf {

struct Release {
  void operator()(AVPacket* p) const { av_packet_free(&p); }
  void operator()(AVIOContext* p) const { avio_closep(&p); }
};
template <class T>
using Owner = std::unique_ptr<T, Release>;

/// Options for libavformat; those it did not take stay in it.
class Options {
 public:
  Options() = default;
  Options(const Options&) = delete;
  Options& operator=(const Options&) = delete;
  ~Options() { av_dict_free(&entries_); }
  void set(const char* key, const std::string& value) { av_dict_set(&entries_, key, value.c_str(), 0); }
  AVDictionary** get() { return &entries_; }

 private:
  AVDictionary* entries_ = nullptr;
};

inline std::string reason(int code) {
  char text[AV_ERROR_MAX_STRING_SIZE];
  return av_strerror(code, text, sizeof text) == 0 ? text : "unknown error";
}

inline constexpr std::uint32_t kFourCc = MKTAG('I', 'S', 'R', 'L');

}  // namespace isoreel::lavf
