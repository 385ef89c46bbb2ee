// SPDX-License-Identifier: BSD-3-Clause
// readConfiguration on arbitrary bytes. What it takes must survive being written and read again.
#include <isoreel/codec/configuration.h>

#include <cstdlib>

#include "repair.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  isoreel::Bytes record(data, data + size);
  isoreel::fuzz::repairTrailingCrc(record);
  const auto configuration = isoreel::readConfiguration(record);
  if (!configuration.ok()) return 0;
  const auto again = isoreel::writeConfiguration(*configuration);
  if (!again.ok()) std::abort();
  const auto read = isoreel::readConfiguration(*again);
  if (!read.ok() || !(*read == *configuration)) std::abort();
  return 0;
}
