// SPDX-License-Identifier: BSD-3-Clause
// The sections of a payload, one by one.
#pragma once

#include "encode/frame_coder.h"

namespace isoreel {

/// Appends the stream that `write(coder)` makes to the payload, and its entry to the section table when it
/// has any bytes.
template <class Write>
void addSection(CodedFrame& coded, SectionKind kind, std::uint32_t level, Write write) {
  const std::size_t start = coded.payload.size();
  RangePut coder(coded.payload);
  write(coder);
  coder.finish();
  if (coded.payload.size() > start) {
    coded.sections.push_back(
        {static_cast<std::uint32_t>(kind), level, static_cast<std::uint32_t>(coded.payload.size() - start)});
  }
}

/// Signs and leaf bits of every level, coarse to fine (spec codec 4). Ends where nothing is heterogeneous.
Status writeSigns(const FrameInput& frame, CodedFrame& coded);

}  // namespace isoreel
