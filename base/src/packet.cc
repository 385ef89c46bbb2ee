// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/base/packet.h>

#include <string>

namespace isoreel {

Result<std::uint64_t> keyEntry(const PacketSource& source, std::uint64_t frame) {
  const std::uint64_t entry = source.entryOf(frame);
  const FrameHeader* after = &source.entryHeader(entry);
  for (std::uint64_t at = entry; after->back > 0; --at) {
    // Nothing between the two may be missing (spec container 4.3).
    const FrameHeader* before = at > 0 ? &source.entryHeader(at - 1) : nullptr;
    if (before == nullptr || before->back + 1 != after->back || before->position + 1 != after->position) {
      return {ErrorCode::kNotFound, "frame " + std::to_string(source.header(frame).number) +
                                        ": a packet that it depends on is not there"};
    }
    after = before;
  }
  return entry - source.entryHeader(entry).back;
}

}  // namespace isoreel
