// SPDX-License-Identifier: BSD-3-Clause
// What a reader holds of a file, found by index or by scan, and the boundary where exceptions end.
#pragma once

#include <isoreel/container/reader.h>

#include <exception>
#include <string>
#include <vector>

namespace isoreel::container {

struct FrameEntry {
  FrameHeader header;
  std::uint64_t offset = 0;  // of the chunk
  std::uint64_t bytes = 0;   // of the whole chunk
};

struct Contents {
  FileInfo info;
  std::uint64_t track = 0;  // the one that is read: frames of others are passed over (spec container 5)
  std::vector<FrameEntry> frames;
};

/// "frame 17 at byte 48213"
inline std::string framePlace(std::uint64_t number, std::uint64_t offset) {
  return "frame " + std::to_string(number) + " at byte " + std::to_string(offset);
}

/// Runs `body` and turns what libraries and callers' sources throw, out of memory for one, into an error.
template <class Body>
auto withoutThrowing(Body body) -> decltype(body()) {
  try {
    return body();
  } catch (const std::exception& e) {
    return Error{ErrorCode::kLimit, std::string("failed: ") + e.what()};
  }
}

}  // namespace isoreel::container
