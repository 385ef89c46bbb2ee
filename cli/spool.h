// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/container/byte_sink.h>
#include <isoreel/container/byte_source.h>

#include <memory>

namespace isoreel::cli {

/// A file without a name in the folder for such things: what one side appends, the other reads. It is gone
/// with both.
struct Spool {
  std::unique_ptr<ByteSink> sink;
  std::unique_ptr<ByteSource> source;  // of what was appended before it is read
};
Result<Spool> makeSpool();

}  // namespace isoreel::cli
