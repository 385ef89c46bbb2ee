// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/base/bytes.h>
#include <isoreel/base/status.h>
#include <isoreel/container/byte_source.h>

#include <memory>
#include <string>

namespace isoreel::lavf {

/// Containers of others that keep our packets as they are (spec mappings 2).
enum class Carrier { kNut, kMov, kMp4, kMatroska, kAvi };

/// "NUT", "MOV", "MP4", "Matroska", "AVI".
const char* carrierName(Carrier carrier);

/// By the extension of a file's name, in any case: .nut, .mov or .qt, .mp4 or .m4v, .mkv, .avi.
/// kUnsupported, with the reason, for one of a container that would lose or refuse packets (.ts, .webm, .ogg,
/// .flv …); kInvalidArgument for any other.
Result<Carrier> carrierOf(const std::string& file_name);

/// A source that was looked at, and gives the bytes that were read once more.
struct Sniffed {
  std::unique_ptr<ByteSource> source;
  bool carrier = false;  // it is in one of these containers, whatever it carries
};
/// Reads the first 4096 bytes. Errors of the source.
Result<Sniffed> sniff(std::unique_ptr<ByteSource> source);

}  // namespace isoreel::lavf
