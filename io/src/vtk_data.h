// SPDX-License-Identifier: BSD-3-Clause
// The bytes of a DataArray as VTK's XML files hold them: text, base64 or raw, in zlib blocks or whole.
#pragma once

#include <isoreel/base/bytes.h>
#include <isoreel/base/status.h>

#include <bit>
#include <span>
#include <string_view>
#include <vector>

namespace isoreel::io {

/// What the VTKFile element says of all binary data in the file.
struct VtkCoding {
  std::endian order = std::endian::little;
  bool wideHeaders = false;  // counts before the data take 8 bytes, else 4
  bool zlib = false;         // data are zlib blocks
};

/// The `expected` bytes of a binary array that starts at `data` (base64 text or raw bytes, which may go on
/// behind it). Nothing of the size of `expected` is allocated before `data` can hold it. Errors: kTruncated,
/// kBadData.
Result<std::vector<std::uint8_t>> readVtkBinary(ByteSpan data, bool base64, const VtkCoding& coding,
                                                std::uint64_t expected);

/// Exactly out.size() numbers, apart by white space, each rounded to the nearest float; "nan" and "inf" are
/// numbers too. Errors: kTruncated, kBadData.
Status readVtkText(std::string_view text, std::span<float> out);

}  // namespace isoreel::io
