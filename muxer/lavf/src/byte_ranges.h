// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/base/bytes.h>

#include <cstdint>
#include <string>
#include <vector>

namespace isoreel::lavf {

/// A stretch of a file that a server sent.
struct FilePart {
  std::uint64_t offset = 0;
  std::uint64_t file_bytes = 0;  // of the whole file
  Bytes bytes;
};

/// What an HTTP server answers when it is asked for several ranges at once (RFC 9110 14.6). `type`: its
/// Content-Type, which has the boundary. Empty when that is another, or the body breaks a rule or is cut.
std::vector<FilePart> parseByteRanges(const std::string& type, ByteSpan body);

}  // namespace isoreel::lavf
