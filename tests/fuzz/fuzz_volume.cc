// SPDX-License-Identifier: BSD-3-Clause
// Volume files of any format from arbitrary bytes: opened, and the first and last volume read. Beside the
// file lies one of 64 bytes, `a.raw`, for headers whose samples are elsewhere.
#include <isoreel/io/volume_reader.h>

#include "scratch_file.h"

// teem keeps some of what it took for headers that it refuses; LeakSanitizer asks here what not to report.
extern "C" const char* __lsan_default_suppressions() { return "leak:libteem\n"; }

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const isoreel::fuzz::ScratchFolder folder;
  static const std::string beside = folder.write("a.raw", isoreel::Bytes(64, 7));
  const std::string file = folder.write("input", isoreel::ByteSpan(data, size));
  auto sequence = isoreel::io::openVolumes({file});
  if (!sequence.ok()) return 0;
  const std::size_t count = (*sequence)->size();
  for (const std::size_t i : {std::size_t{0}, count - 1}) {
    if (i >= count) std::abort();
    static_cast<void>((*sequence)->name(i));
    static_cast<void>((*sequence)->time(i));
    const auto volume = (*sequence)->read(i);
    if (volume.ok() && volume->grid.nodes != (*sequence)->grid().nodes) std::abort();
  }
  return 0;
}
