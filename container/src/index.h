// SPDX-License-Identifier: BSD-3-Clause
// Seek index and footer (spec container 7 and 8).
#pragma once

#include "src/contents.h"
#include "src/format.h"

namespace isoreel::container {

/// Collects what the index says of each frame while a file is written: some 80 bytes a frame.
class IndexBuilder {
 public:
  /// Frames come in the order in which they stand in the file. kLimit when the index would grow above what
  /// readers take.
  Status add(std::uint64_t track, const FrameHeader& header, std::uint64_t offset, std::uint64_t chunk_bytes);
  /// The INDX and FOOT chunks of a file that is `file_bytes` long so far. Of `info`: UUID, tags, chapters,
  /// attachments.
  Result<Bytes> finish(const FileInfo& info, const std::vector<TrackRecord>& tracks,
                       std::uint64_t file_bytes) const;

 private:
  Bytes entries_;
  std::uint64_t count_ = 0;
  std::uint64_t end_ = Signature::kBytes;  // of the last frame chunk
};

/// The footer in the last Footer::kChunkBytes of a file of `file_bytes`: whole, and pointing into the file.
Result<Footer> readFooter(ByteSpan chunk, std::uint64_t file_bytes);

/// Fills `contents` from the INDX chunk that `footer` points to. kUnsupported when the file's version is not
/// known.
Status readIndex(ByteSpan chunk, const Footer& footer, Contents& contents);

}  // namespace isoreel::container
