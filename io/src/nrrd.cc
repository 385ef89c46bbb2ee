// SPDX-License-Identifier: BSD-3-Clause
// NRRD, whose header teem reads, attached or detached. A file is one 3-D volume, or a 4-D one whose last axis
// is time. Raw and gzip data are read by us, frame by frame and past gzip's checksum; teem reads the other
// encodings.
#include <fmt/format.h>
#include <teem/nrrd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <mutex>

#include "src/files.h"
#include "src/stored_sequence.h"

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

// What a header says, and whether the parts that it names can be read without teem.
struct Header {
  StoredVolumes stored;
  bool teemReads = false;
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
    ISOREEL_TRY(setNodes(grid, i, static_cast<std::int64_t>(axis.size)));
    if (hasDirection(axis)) {
      const double* d = axis.spaceDirection;
      setAxis(grid, i, {d[0], d[1], d[2]});
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

// Where the data begin that follow an attached header: behind its first empty line.
std::uint64_t headerEnd(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string line;
  while (std::getline(file, line)) {
    if (line.empty() || line == "\r") break;
  }
  file.clear();
  return static_cast<std::uint64_t>(std::max<std::streamoff>(file.tellg(), 0));
}

// The byte behind `lines` lines from `offset` on.
Result<std::uint64_t> behindLines(const std::string& path, std::uint64_t offset, unsigned lines) {
  std::ifstream file(path, std::ios::binary);
  file.seekg(static_cast<std::streamoff>(offset));
  for (std::string line; lines > 0; --lines) {
    if (!std::getline(file, line)) return {ErrorCode::kTruncated, path + ": ends within the lines to skip"};
  }
  return static_cast<std::uint64_t>(std::max<std::streamoff>(file.tellg(), 0));
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

// Where the samples lie; fills in what openStored checks.
Status findParts(const NrrdIoState& state, StoredVolumes& stored) {
  ISOREEL_ASSIGN(const std::vector<std::string> files, dataFiles(state));
  if (files.empty()) stored.parts.push_back({stored.header, headerEnd(stored.header)});
  for (const std::string& file : files) stored.parts.push_back({file, 0});
  if (state.encoding == nrrdEncodingGzip) stored.coding = Coding::kDeflated;
  if (state.byteSkip < -1 || (state.byteSkip == -1 && stored.coding != Coding::kPlain))
    return {ErrorCode::kBadData, fmt::format("byte skip of {}", state.byteSkip)};
  if (state.byteSkip > 0) stored.skip = static_cast<std::uint64_t>(state.byteSkip);
  std::uint64_t bytes = stored.grid.nodeCount() * scalarBytes(stored.type);
  if (__builtin_mul_overflow(bytes, stored.volumes, &bytes))
    return {ErrorCode::kLimit, "the header's sizes are too large"};
  for (StoredVolumes::Part& part : stored.parts) {
    ISOREEL_ASSIGN(const std::uint64_t size, regularFileSize(part.path));
    if (state.byteSkip == -1) {
      part.offset = size - std::min(size, bytes / stored.parts.size());
    } else if (state.lineSkip > 0) {
      ISOREEL_ASSIGN(part.offset, behindLines(part.path, part.offset, state.lineSkip));
    }
  }
  return {};
}

// Whether the data can hold what the header says, by the most that a byte of an encoding of teem's stands
// for.
Status checkTeemsSize(const NrrdIoState& state, const StoredVolumes& stored) {
  std::uint64_t found = 0, scalars = stored.grid.nodeCount();
  for (const StoredVolumes::Part& part : stored.parts) {
    ISOREEL_ASSIGN(const std::uint64_t size, regularFileSize(part.path));
    found += size - std::min(size, part.offset);
  }
  if (__builtin_mul_overflow(scalars, stored.volumes, &scalars) || scalars > (std::uint64_t{1} << 56))
    return {ErrorCode::kLimit, "the header's sizes are too large"};
  const std::uint64_t expected = scalars * scalarBytes(stored.type);
  if (state.encoding == nrrdEncodingHex && found < 2 * expected) {
    return {ErrorCode::kTruncated,
            fmt::format("expected {} hex digits, found {} bytes", 2 * expected, found)};
  }
  // A digit and a separator each; the last needs no separator.
  if (state.encoding == nrrdEncodingAscii && found + 1 < 2 * scalars) {
    return {ErrorCode::kTruncated,
            fmt::format("{} bytes of text cannot hold the {} numbers that the header says", found, scalars)};
  }
  // A block of bzip2 holds 900 000 bytes after runs of 255 became 5; it takes 40 bytes or so.
  if (state.encoding == nrrdEncodingBzip2 && found < expected >> 20) {
    return {ErrorCode::kTruncated,
            fmt::format("{} bytes of bzip2 data cannot hold the {} that the header says", found, expected)};
  }
  return {};
}

// Seconds of a step on the time axis, when it says so.
double stepSeconds(const NrrdAxisInfo& axis) {
  const std::string_view units = axis.units != nullptr ? axis.units : "";
  const double unit = units == "s" || units == "sec" || units == "seconds" ? 1
                      : units == "ms" || units == "msec"                   ? 1e-3
                      : units == "us" || units == "usec"                   ? 1e-6
                                                                           : 0;
  return AIR_EXISTS(axis.spacing) && axis.spacing > 0 ? unit * axis.spacing : 0;
}

// The header alone: nothing of the data's size is allocated before it is known to be there.
Result<Header> parseHeader(const std::string& path) {
  const std::lock_guard lock(teemMutex);
  const NrrdPointer nrrd(nrrdNew());
  const IoStatePointer state(nrrdIoStateNew());
  nrrdIoStateSet(state.get(), nrrdIoStateSkipData, 1);
  if (nrrdLoad(nrrd.get(), path.c_str(), state.get()) != 0) return {ErrorCode::kBadData, teemError()};
  Header header;
  StoredVolumes& stored = header.stored;
  stored.header = path;
  ISOREEL_TRY(checkAxes(*nrrd));
  const auto type = scalarTypeOf(nrrd->type);
  if (!type) return {ErrorCode::kUnsupported, "samples of type block are not scalars"};
  stored.type = *type;
  stored.order = state->endian == airEndianBig ? std::endian::big : std::endian::little;
  ISOREEL_ASSIGN(stored.grid, gridOf(*nrrd));
  if (nrrd->dim == 4) {
    stored.volumes = nrrd->axis[3].size;
    if (const double step = stepSeconds(nrrd->axis[3]); step > 0) {
      stored.firstTime = AIR_EXISTS(nrrd->axis[3].min) ? step / nrrd->axis[3].spacing * nrrd->axis[3].min : 0;
      stored.timeStep = step;
    }
  }
  ISOREEL_TRY(findParts(*state, stored));
  header.teemReads = state->encoding != nrrdEncodingRaw && state->encoding != nrrdEncodingGzip;
  if (header.teemReads) ISOREEL_TRY(checkTeemsSize(*state, stored));
  return header;
}

// A file that teem reads as a whole.
class TeemSequence : public VolumeSequence {
 public:
  explicit TeemSequence(const StoredVolumes& stored) : stored_(stored) {}
  std::size_t size() const override { return stored_.volumes; }
  const Grid& grid() const override { return stored_.grid; }
  bool levelSet() const override { return false; }  // NRRD has no word for it
  std::optional<double> time(std::size_t i) const override { return stored_.time(i); }
  std::string name(std::size_t i) const override { return stored_.name(i); }

  Result<Volume> read(std::size_t i) override {
    std::shared_ptr<const Nrrd> nrrd = loaded_;
    if (!nrrd) {
      ISOREEL_ASSIGN(nrrd, load());
    }
    // A 4-D file cannot be read by parts, so all of it stays; a 3-D one goes with its volume.
    if (stored_.volumes > 1) loaded_ = nrrd;
    const std::size_t count = stored_.grid.nodeCount();
    const auto* bytes = static_cast<const std::uint8_t*>(nrrd->data) + i * count * scalarBytes(stored_.type);
    std::vector<float> values(count);
    convertScalars(stored_.type, std::endian::native, bytes, values);
    return Volume::own(stored_.grid, std::move(values));
  }

 private:
  Result<std::shared_ptr<const Nrrd>> load() const {
    // The header again, since files change.
    ISOREEL_ASSIGN(const Header now, parseHeader(stored_.header).at(stored_.header));
    if (now.stored.grid != stored_.grid || now.stored.type != stored_.type ||
        now.stored.volumes != stored_.volumes) {
      return {ErrorCode::kBadData, stored_.header + ": the file changed after it was opened"};
    }
    const std::lock_guard lock(teemMutex);
    std::shared_ptr<Nrrd> nrrd(nrrdNew(), NrrdDeleter());
    if (nrrdLoad(nrrd.get(), stored_.header.c_str(), nullptr) != 0) {
      return {ErrorCode::kTruncated, fmt::format("{}: {}", stored_.header, teemError())};
    }
    return std::shared_ptr<const Nrrd>(nrrd);
  }

  StoredVolumes stored_;
  std::shared_ptr<const Nrrd> loaded_;
};

SequenceResult openOne(const std::string& path) {
  ISOREEL_ASSIGN(Header header, parseHeader(path).at(path));
  if (!header.teemReads) return openStored(std::move(header.stored));
  return std::unique_ptr<VolumeSequence>(std::make_unique<TeemSequence>(header.stored));
}

}  // namespace

SequenceResult openNrrd(const std::vector<std::string>& files, const VolumeOptions&) {
  return openEach(files, openOne);
}

}  // namespace isoreel::io
