// SPDX-License-Identifier: BSD-3-Clause
#include "src/vdb_layout.h"

#include <fmt/format.h>
#include <openvdb/io/Compression.h>
#include <openvdb/io/io.h>
#include <openvdb/math/Transform.h>
#include <openvdb/version.h>

#include <algorithm>
#include <sstream>
#include <string_view>

#include "src/mapped_file.h"

namespace isoreel::io {
namespace {

constexpr std::uint32_t kOldestVersion = 222;  // OpenVDB 1.2: compression flags are stored per grid
constexpr std::size_t kUuidBytes = 36;
constexpr std::uint32_t kAllCompressions =
    openvdb::io::COMPRESS_ZIP | openvdb::io::COMPRESS_ACTIVE_MASK | openvdb::io::COMPRESS_BLOSC;
constexpr std::size_t kLeafMaskBytes = 64;
constexpr std::size_t kCoordBytes = 12;
constexpr std::size_t kRootChildBytes = kCoordBytes + 2 * 4096;  // and two masks of 32^3 bits
constexpr std::size_t kTransformBytes = 4096;                    // above any that OpenVDB has
constexpr std::uint32_t kNoSizes = ~std::uint32_t{0};

std::string_view readString(ByteReader& in) {
  const ByteSpan text = in.bytes(in.fixed<std::uint32_t>());
  return {reinterpret_cast<const char*>(text.data()), text.size()};
}

// Nothing, or a number of leaves and two lists with a value for each: a byte, and 8 bytes unless that list is
// left out. Each list stands after its compressed size, 0 when it is not compressed.
Status checkDelayedLoad(ByteReader& value, std::size_t fileBytes) {
  if (value.left() == 0) return {};
  const std::size_t leaves = value.fixed<std::uint32_t>();
  if (leaves > fileBytes / kLeafMaskBytes) {
    return {ErrorCode::kBadData, "the delayed-load metadata counts more leaves than the file can hold"};
  }
  const auto masks = value.fixed<std::uint32_t>();
  value.bytes(masks != 0 ? masks : leaves);
  const auto sizes = value.fixed<std::uint32_t>();
  if (sizes != kNoSizes) value.bytes(sizes != 0 ? sizes : 8 * leaves);
  if (value.truncated()) return {ErrorCode::kBadData, "the delayed-load metadata goes past its end"};
  return {};
}

// A list of (name, type, size, value).
Status checkMetadata(ByteReader& in, std::size_t fileBytes) {
  const auto count = in.fixed<std::uint32_t>();
  for (std::uint32_t i = 0; i < count && !in.truncated(); ++i) {
    readString(in);
    const std::string_view type = readString(in);
    ByteReader value(in.bytes(in.fixed<std::uint32_t>()));
    if (type == "__delayedload") ISOREEL_TRY(checkDelayedLoad(value, fileBytes));
  }
  if (in.truncated()) return {ErrorCode::kTruncated, "the metadata goes past its end"};
  return {};
}

// The counts in a tree's root: OpenVDB goes through as many entries as they say, past the end too. `grid`
// stands at the transform, whose length only OpenVDB knows.
Status checkRoot(ByteReader grid, std::uint32_t version, std::size_t valueBytes) {
  const ByteSpan head = ByteReader(grid).bytes(std::min(grid.left(), kTransformBytes));
  std::istringstream stream(std::string(head.begin(), head.end()));
  const openvdb::VersionId library(openvdb::OPENVDB_LIBRARY_MAJOR_VERSION,
                                   openvdb::OPENVDB_LIBRARY_MINOR_VERSION);
  openvdb::io::setVersion(stream, library, version);
  openvdb::math::Transform transform;
  transform.read(stream);
  if (!stream) return {ErrorCode::kTruncated, "its transform goes past its end"};
  if (!transform.isLinear()) return {};  // no tree of such a grid is ever read
  grid.bytes(static_cast<std::size_t>(stream.tellg()));
  grid.fixed<std::uint32_t>();  // number of buffers
  grid.bytes(valueBytes);       // background
  const std::uint64_t tiles = grid.fixed<std::uint32_t>(), children = grid.fixed<std::uint32_t>();
  if (grid.truncated() || tiles * (kCoordBytes + valueBytes + 1) + children * kRootChildBytes > grid.left()) {
    return {ErrorCode::kTruncated,
            fmt::format("its root counts {} tiles and {} nodes, more than the file holds", tiles, children)};
  }
  return {};
}

// One entry of the list of grids; `list` goes on to the next, which follows this grid's data.
Status checkGrid(ByteReader& list, std::uint32_t version, ByteSpan file) {
  std::string name(readString(list).substr(0, 80));
  std::replace_if(
      name.begin(), name.end(), [](char c) { return c < ' ' || c > '~'; }, '?');  // for messages
  const std::string_view type = readString(list);
  readString(list);  // the grid that shares its tree
  const auto begin = list.fixed<std::uint64_t>(), blocks = list.fixed<std::uint64_t>(),
             end = list.fixed<std::uint64_t>();
  if (list.truncated()) return {ErrorCode::kTruncated, "the file ends within its list of grids"};
  if (begin > blocks || blocks > end)
    return {ErrorCode::kBadData, fmt::format("grid \"{}\" has offsets out of order", name)};
  if (end > file.size()) {
    return {ErrorCode::kTruncated,
            fmt::format("grid \"{}\" ends at byte {}, but the file has {} bytes", name, end, file.size())};
  }
  ByteReader grid(file.subspan(begin, end - begin));
  if (grid.fixed<std::uint32_t>() > kAllCompressions) {
    return {ErrorCode::kUnsupported, fmt::format("grid \"{}\" is compressed in an unknown way", name)};
  }
  ISOREEL_TRY(checkMetadata(grid, file.size()).at(fmt::format("grid \"{}\"", name)));
  const ByteReader transform = grid;
  readString(grid);  // its kind
  if (grid.truncated())
    return {ErrorCode::kTruncated, fmt::format("grid \"{}\": its transform goes past its end", name)};
  const std::size_t valueBytes = type.starts_with("Tree_float") ? 4 : type.starts_with("Tree_double") ? 8 : 0;
  if (valueBytes != 0)
    ISOREEL_TRY(checkRoot(transform, version, valueBytes).at(fmt::format("grid \"{}\"", name)));
  list = ByteReader(file.subspan(end));
  return {};
}

Status checkFile(ByteSpan file) {
  ByteReader in(file);
  in.fixed<std::uint64_t>();  // magic
  const auto version = in.fixed<std::uint32_t>();
  if (version < kOldestVersion || version > openvdb::OPENVDB_FILE_VERSION) {
    return {ErrorCode::kUnsupported, fmt::format("file version {}; {} to {} can be read", version,
                                                 kOldestVersion, +openvdb::OPENVDB_FILE_VERSION)};
  }
  in.fixed<std::uint64_t>();  // the library's version
  const bool hasOffsets = in.fixed<std::uint8_t>() != 0;
  in.bytes(kUuidBytes);
  ISOREEL_TRY(checkMetadata(in, file.size()));
  const auto grids = in.fixed<std::uint32_t>();
  if (in.truncated()) return {ErrorCode::kTruncated, "the file ends within its header"};
  if (!hasOffsets)
    return {ErrorCode::kUnsupported, "written as a stream, without a list of grids; rewrite it as a file"};
  for (std::uint32_t i = 0; i < grids; ++i) ISOREEL_TRY(checkGrid(in, version, file));
  return {};
}

}  // namespace

Status checkVdbLayout(const std::string& path, std::uint64_t size) {
  ISOREEL_ASSIGN(const std::shared_ptr<const MappedFile> map, MappedFile::open(path, size));
  return checkFile(map->bytes()).at(path);
}

}  // namespace isoreel::io
