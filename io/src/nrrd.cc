// SPDX-License-Identifier: BSD-3-Clause
// NRRD through teem: attached and detached headers; raw, gzip, ascii and hex data. A file is one 3-D volume,
// or a 4-D one whose last axis is time.
#include <fmt/format.h>
#include <teem/nrrd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <mutex>

#include "src/files.h"
#include "src/scalar.h"
#include "src/sequence.h"

namespace isoreel::io {
namespace {

// teem collects its error messages in a global list.
std::mutex teemMutex;

// The innermost of teem's messages, without its "[nrrd] function: ".
std::string teemError() {
  char* const collected = biffGetDone(NRRD);
  std::string text = collected != nullptr ? collected : "";
  std::free(collected);
  while (!text.empty() && text.back() == '\n') text.pop_back();
  if (const std::size_t line = text.rfind('\n'); line != std::string::npos) text.erase(0, line + 1);
  if (const std::size_t colon = text.find(": "); text.starts_with('[') && colon != std::string::npos)
    text.erase(0, colon + 2);
  return text;
}

struct NrrdDeleter {
  void operator()(Nrrd* nrrd) const { nrrdNuke(nrrd); }
  void operator()(NrrdIoState* state) const { nrrdIoStateNix(state); }
};
using NrrdPointer = std::unique_ptr<Nrrd, NrrdDeleter>;
using IoStatePointer = std::unique_ptr<NrrdIoState, NrrdDeleter>;

struct Header {
  Grid grid;
  ScalarType type = ScalarType::kFloat32;
  std::size_t frames = 1;
};

std::optional<ScalarType> scalarTypeOf(int nrrdType) {
  switch (nrrdType) {
    case nrrdTypeChar:
      return ScalarType::kInt8;
    case nrrdTypeUChar:
      return ScalarType::kUint8;
    case nrrdTypeShort:
      return ScalarType::kInt16;
    case nrrdTypeUShort:
      return ScalarType::kUint16;
    case nrrdTypeInt:
      return ScalarType::kInt32;
    case nrrdTypeUInt:
      return ScalarType::kUint32;
    case nrrdTypeLLong:
      return ScalarType::kInt64;
    case nrrdTypeULLong:
      return ScalarType::kUint64;
    case nrrdTypeFloat:
      return ScalarType::kFloat32;
    case nrrdTypeDouble:
      return ScalarType::kFloat64;
    default:
      return std::nullopt;
  }
}

bool hasDirection(const NrrdAxisInfo& axis) { return AIR_EXISTS(axis.spaceDirection[0]); }

// The axes must be x, y, z and perhaps time.
Status checkAxes(const Nrrd& nrrd) {
  if (nrrd.dim != 3 && nrrd.dim != 4) {
    return {ErrorCode::kBadData,
            fmt::format("has {} axes; a volume has 3, or 4 with time as the last", nrrd.dim)};
  }
  const bool directions = std::any_of(nrrd.axis, nrrd.axis + nrrd.dim, hasDirection);
  if (directions && nrrd.spaceDim != 3) {
    return {ErrorCode::kBadData,
            fmt::format("lies in a space of {} dimensions; a volume's has 3", nrrd.spaceDim)};
  }
  for (unsigned i = 0; i < 3; ++i) {
    const NrrdAxisInfo& axis = nrrd.axis[i];
    const bool spatialKind =
        axis.kind == nrrdKindUnknown || axis.kind == nrrdKindDomain || axis.kind == nrrdKindSpace;
    if (!spatialKind || (directions && !hasDirection(axis))) {
      return {ErrorCode::kUnsupported,
              fmt::format("axis {} ({}) is not one of space: only scalar volumes, with x, y and z "
                          "first, can be read",
                          i, airEnumStr(nrrdKind, axis.kind))};
    }
    if (axis.size < kMinNodes || axis.size > kMaxNodes) {
      return {ErrorCode::kLimit,
              fmt::format("axis {} has {} nodes; {} to {} are allowed", i, axis.size, kMinNodes, kMaxNodes)};
    }
  }
  if (nrrd.dim == 4) {
    const int kind = nrrd.axis[3].kind;
    const bool time = kind == nrrdKindTime || kind == nrrdKindList || (kind == nrrdKindUnknown && directions);
    if (!time || hasDirection(nrrd.axis[3])) {
      return {ErrorCode::kUnsupported,
              "axis 3 must be of kind time or list, or be the only one without a space direction"};
    }
  }
  return {};
}

Result<Grid> gridOf(const Nrrd& nrrd) {
  Grid grid;
  for (unsigned i = 0; i < 3; ++i) {
    const NrrdAxisInfo& axis = nrrd.axis[i];
    grid.nodes[i] = static_cast<std::uint32_t>(axis.size);
    if (hasDirection(axis)) {
      const double* d = axis.spaceDirection;
      grid.spacing[i] = std::hypot(d[0], d[1], d[2]);
      for (unsigned row = 0; row < 3; ++row) grid.direction[3 * row + i] = d[row] / grid.spacing[i];
      if (AIR_EXISTS(nrrd.spaceOrigin[i])) grid.origin[i] = nrrd.spaceOrigin[i];
    } else if (AIR_EXISTS(axis.min) && AIR_EXISTS(axis.max)) {
      const double first = nrrdAxisInfoPos(&nrrd, i, 0);
      grid.origin[i] = first;
      grid.spacing[i] = nrrdAxisInfoPos(&nrrd, i, 1) - first;
    } else if (AIR_EXISTS(axis.spacing)) {
      grid.spacing[i] = axis.spacing;
    }
  }
  ISOREEL_TRY(checkGrid(grid));
  return grid;
}

// Bytes of `path` after an attached header, which ends at its first empty line.
Result<std::uint64_t> bytesAfterHeader(const std::string& path, std::uint64_t fileSize) {
  std::ifstream file(path, std::ios::binary);
  std::string line;
  while (std::getline(file, line)) {
    if (line.empty() || line == "\r") return fileSize - static_cast<std::uint64_t>(file.tellg());
  }
  return std::uint64_t{0};
}

// The detached data files that the header names; none when the data follows the header.
Result<std::vector<std::string>> dataFiles(const NrrdIoState& state) {
  std::vector<std::string> names;
  if (state.dataFNFormat != nullptr) {
    const auto pattern = NumberedName::parse(state.dataFNFormat);
    const std::int64_t step = state.dataFNStep, last = state.dataFNMax;
    if (!pattern || step == 0 || state.dataFNMin < 0)
      return {ErrorCode::kBadData, "data file pattern is not like a%03d.raw 1 9 1"};
    // Each is looked up below; a header that lies about their number would still be a long list.
    if (std::abs(last - state.dataFNMin) / std::abs(step) > 1'000'000)
      return {ErrorCode::kLimit, "above 1000000 data files"};
    for (std::int64_t number = state.dataFNMin; number >= 0 && (step > 0 ? number <= last : number >= last);
         number += step) {
      names.push_back(pattern->with(static_cast<std::uint64_t>(number)));
    }
  } else {
    names.assign(state.dataFN, state.dataFN + state.dataFNArr->len);
  }
  for (std::string& name : names) {
    if (name == "-") return {ErrorCode::kUnsupported, "data from standard input"};
    if (!name.starts_with('/') && state.path != nullptr) name = fmt::format("{}/{}", state.path, name);
  }
  return names;
}

// Bytes of data, wherever they are.
Result<std::uint64_t> dataBytes(const std::string& path, const NrrdIoState& state) {
  ISOREEL_ASSIGN(const std::vector<std::string> files, dataFiles(state));
  if (files.empty()) {
    ISOREEL_ASSIGN(const std::uint64_t size, regularFileSize(path));
    return bytesAfterHeader(path, size);
  }
  std::uint64_t total = 0;
  for (const std::string& file : files) {
    ISOREEL_ASSIGN(const std::uint64_t size, regularFileSize(file));
    total += size;
  }
  return total;
}

// Whether the data files can hold what the header says, by the most that one byte of each encoding can stand
// for.
Status checkDataSize(const std::string& path, const Nrrd& nrrd, const NrrdIoState& state, ScalarType type) {
  std::uint64_t scalars = 1;
  for (unsigned i = 0; i < nrrd.dim; ++i) {
    if (__builtin_mul_overflow(scalars, std::uint64_t{nrrd.axis[i].size}, &scalars) ||
        scalars > (std::uint64_t{1} << 56)) {
      return {ErrorCode::kLimit, "the header's sizes are too large"};
    }
  }
  const std::uint64_t expected = scalars * scalarBytes(type);
  ISOREEL_ASSIGN(const std::uint64_t found, dataBytes(path, state));
  if (state.encoding == nrrdEncodingRaw && found < expected) {
    return {ErrorCode::kTruncated, fmt::format("expected {} bytes of data, found {}", expected, found)};
  }
  // A match of 258 bytes takes two bits at least, so deflate shrinks by 1032 at most (zlib's technical
  // notes).
  if (state.encoding == nrrdEncodingGzip && found < expected / 1032) {
    return {ErrorCode::kTruncated,
            fmt::format("{} bytes of gzip data cannot hold the {} that the header says", found, expected)};
  }
  if (state.encoding == nrrdEncodingHex && found < 2 * expected) {
    return {ErrorCode::kTruncated,
            fmt::format("expected {} hex digits, found {} bytes", 2 * expected, found)};
  }
  // A digit and a separator each; the last needs no separator.
  if (state.encoding == nrrdEncodingAscii && found + 1 < 2 * scalars) {
    return {ErrorCode::kTruncated,
            fmt::format("{} bytes of text cannot hold the {} numbers that the header says", found, scalars)};
  }
  if (state.encoding != nrrdEncodingRaw && state.encoding != nrrdEncodingGzip &&
      state.encoding != nrrdEncodingHex && state.encoding != nrrdEncodingAscii) {
    return {ErrorCode::kUnsupported,
            fmt::format("encoding {}; raw, gzip, ascii and hex can be read", state.encoding->name)};
  }
  return {};
}

// The header alone: nothing of the data's size is allocated before checkDataSize agrees.
Result<Header> readHeader(const std::string& path) {
  const std::lock_guard lock(teemMutex);
  const NrrdPointer nrrd(nrrdNew());
  const IoStatePointer state(nrrdIoStateNew());
  nrrdIoStateSet(state.get(), nrrdIoStateSkipData, 1);
  if (nrrdLoad(nrrd.get(), path.c_str(), state.get()) != 0)
    return {ErrorCode::kBadData, fmt::format("{}: {}", path, teemError())};
  Header header;
  ISOREEL_TRY(checkAxes(*nrrd).at(path));
  const auto type = scalarTypeOf(nrrd->type);
  if (!type) return {ErrorCode::kUnsupported, path + ": samples of type block are not scalars"};
  header.type = *type;
  ISOREEL_TRY(checkDataSize(path, *nrrd, *state, *type).at(path));
  Result<Grid> grid = gridOf(*nrrd).at(path);
  if (!grid.ok()) return grid.status();
  header.grid = *grid;
  if (nrrd->dim == 4) header.frames = nrrd->axis[3].size;
  return header;
}

class NrrdSequence : public VolumeSequence {
 public:
  NrrdSequence(std::string path, const Header& header) : path_(std::move(path)), header_(header) {}
  std::size_t size() const override { return header_.frames; }
  const Grid& grid() const override { return header_.grid; }
  bool levelSet() const override { return false; }  // NRRD has no word for it
  std::string name(std::size_t i) const override {
    return header_.frames == 1 ? path_ : fmt::format("{} (volume {})", path_, i);
  }

  Result<Volume> read(std::size_t i) override {
    std::shared_ptr<const Nrrd> nrrd = loaded_;
    if (!nrrd) {
      ISOREEL_ASSIGN(nrrd, load());
    }
    // A 4-D file cannot be read by parts, so all of it stays; a 3-D one goes with its volume.
    if (header_.frames > 1) loaded_ = nrrd;
    const std::size_t count = header_.grid.nodeCount();
    const auto* bytes = static_cast<const std::uint8_t*>(nrrd->data) + i * count * scalarBytes(header_.type);
    if (header_.type == ScalarType::kFloat32) {
      return Volume{header_.grid, {reinterpret_cast<const float*>(bytes), count}, nrrd};
    }
    std::vector<float> values(count);
    convertScalars(header_.type, std::endian::native, bytes, values);
    return Volume::own(header_.grid, std::move(values));
  }

 private:
  Result<std::shared_ptr<const Nrrd>> load() const {
    // The header again, since files change.
    ISOREEL_ASSIGN(const Header now, readHeader(path_));
    if (now.grid != header_.grid || now.type != header_.type || now.frames != header_.frames) {
      return {ErrorCode::kBadData, path_ + ": the file changed after it was opened"};
    }
    const std::lock_guard lock(teemMutex);
    std::shared_ptr<Nrrd> nrrd(nrrdNew(), NrrdDeleter());
    if (nrrdLoad(nrrd.get(), path_.c_str(), nullptr) != 0) {
      return {ErrorCode::kTruncated, fmt::format("{}: {}", path_, teemError())};
    }
    return std::shared_ptr<const Nrrd>(nrrd);
  }

  std::string path_;
  Header header_;
  std::shared_ptr<const Nrrd> loaded_;
};

SequenceResult openOne(const std::string& path) {
  ISOREEL_ASSIGN(const Header header, readHeader(path));
  return std::unique_ptr<VolumeSequence>(std::make_unique<NrrdSequence>(path, header));
}

}  // namespace

SequenceResult openNrrd(const std::vector<std::string>& files, const VolumeOptions&) {
  return openEach(files, openOne);
}

}  // namespace isoreel::io
