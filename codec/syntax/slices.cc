// SPDX-License-Identifier: BSD-3-Clause
#include "syntax/slices.h"

#include <isoreel/base/syntax.h>

namespace isoreel {
namespace {

/// In front of the streams of several slices.
struct SliceTable {
  static constexpr const char* kName = "slices";
  static constexpr const char* kSpec = "codec 11.10";
  std::vector<std::uint32_t> lengths;  // of all slices but the last

  template <class V>
  void fields(V& v) {
    for (std::uint32_t& length : lengths) v.varint("slice bytes", length, 0, (1u << 28) - 1);
  }
};

}  // namespace

Status writeSlices(std::span<const Bytes> streams, Bytes& out) {
  SliceTable table;
  for (const Bytes& stream : streams.first(streams.size() - 1))
    table.lengths.push_back(static_cast<std::uint32_t>(stream.size()));
  ISOREEL_TRY(writeSyntax(out, table));
  for (const Bytes& stream : streams) out.insert(out.end(), stream.begin(), stream.end());
  return {};
}

Result<std::vector<ByteSpan>> readSlices(ByteSpan section, std::size_t count) {
  SliceTable table;
  table.lengths.resize(count - 1);
  ByteReader in(section);
  ISOREEL_TRY(readSyntax(in, table));
  std::vector<ByteSpan> streams;
  for (const std::uint32_t length : table.lengths) {
    if (length > in.left()) {
      return {ErrorCode::kBadData, "slices: longer together than the " + std::to_string(section.size()) +
                                       " bytes of their section (spec codec 11.10)"};
    }
    streams.push_back(in.bytes(length));
  }
  streams.push_back(in.bytes(in.left()));
  return streams;
}

}  // namespace isoreel
