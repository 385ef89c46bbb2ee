// SPDX-License-Identifier: BSD-3-Clause
#include "src/compress.h"

#include <zstd.h>

namespace isoreel::container {
namespace {

constexpr int kLevel =
    9;  // the index of 10,000 frames takes some 20 ms; higher levels gain next to nothing on it

std::string zstdError(std::size_t code) {
  return std::string("zstd: ") + ZSTD_getErrorName(code) + " (spec container 1.1)";
}

}  // namespace

Result<Bytes> compress(ByteSpan content) {
  Bytes out(ZSTD_compressBound(content.size()));
  const std::size_t size = ZSTD_compress(out.data(), out.size(), content.data(), content.size(), kLevel);
  if (ZSTD_isError(size)) return {ErrorCode::kLimit, zstdError(size)};
  out.resize(size);
  return out;
}

Result<Bytes> decompress(ByteSpan payload, std::uint64_t max) {
  const unsigned long long size = ZSTD_getFrameContentSize(payload.data(), payload.size());
  if (size == ZSTD_CONTENTSIZE_ERROR) return {ErrorCode::kBadData, "not a zstd frame (spec container 1.1)"};
  if (size == ZSTD_CONTENTSIZE_UNKNOWN) {
    return {ErrorCode::kBadData, "the zstd frame does not state its content's size (spec container 1.1)"};
  }
  if (size > max) {
    return {ErrorCode::kLimit, "content of " + std::to_string(size) + " bytes is above " +
                                   std::to_string(max) + " (spec container 10)"};
  }
  const std::size_t frame_bytes = ZSTD_findFrameCompressedSize(payload.data(), payload.size());
  if (ZSTD_isError(frame_bytes)) return {ErrorCode::kBadData, zstdError(frame_bytes)};
  if (frame_bytes != payload.size()) {
    return {ErrorCode::kBadData, "bytes follow the zstd frame (spec container 1.1)"};
  }
  Bytes content(static_cast<std::size_t>(size));
  const std::size_t got = ZSTD_decompress(content.data(), content.size(), payload.data(), payload.size());
  if (ZSTD_isError(got)) return {ErrorCode::kBadData, zstdError(got)};
  if (got != content.size()) return {ErrorCode::kBadData, "zstd content is short (spec container 1.1)"};
  return content;
}

}  // namespace isoreel::container
