// SPDX-License-Identifier: BSD-3-Clause
// Parity for files that may be damaged, and what brings damaged files back (spec container 6.4). Library
// isoreel::repair, on ISA-L.
#pragma once

#include <isoreel/container/byte_source.h>
#include <isoreel/container/writer.h>

#include <map>
#include <memory>
#include <string>
#include <vector>

namespace isoreel {

/// Reed-Solomon parity of `percent` (1 to 100) of what it protects, for WriterOptions. Restores damage of up
/// to that part of a run if it is contiguous; scattered, each damaged place costs a block, of which a run has
/// up to 250.
ParityMaker reedSolomonParity(unsigned percent);

/// What parity says of a file.
struct ParityReport {
  std::uint64_t runs = 0;                   // protected runs that were found
  std::uint64_t bytes = 0;                  // of the file that they protect
  std::uint64_t damaged = 0, restored = 0;  // blocks
  std::map<std::uint64_t, Bytes> patches;   // restored blocks by offset
  std::vector<std::string> lines;           // one for each damaged run, for a person
};

/// Finds all PRTY chunks of a seekable source, checks what they protect, and restores what is damaged if
/// there are good parity blocks enough. Nothing is written. Safe for untrusted input; time is linear in the
/// source's length, memory in the longest run.
Result<ParityReport> checkParity(ByteSource& source);

/// `source` with `patches` laid over it; owns both.
std::unique_ptr<ByteSource> patchedSource(std::unique_ptr<ByteSource> source,
                                          std::map<std::uint64_t, Bytes> patches);

}  // namespace isoreel
