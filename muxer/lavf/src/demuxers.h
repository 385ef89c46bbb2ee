// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/lavf/carrier.h>

#include <string>

namespace isoreel::lavf {

struct Demuxer {
  const char* name;  // libavformat's
  Carrier carrier;
};
/// Null for those that are not ours.
const Demuxer* demuxerOf(const std::string& name);

/// For AVFormatContext::format_whitelist: no other demuxer ever sees the bytes.
inline constexpr const char* kDemuxerNames = "nut,mov,mp4,m4a,3gp,3g2,mj2,matroska,webm,avi";

}  // namespace isoreel::lavf
