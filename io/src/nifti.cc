// SPDX-License-Identifier: BSD-3-Clause
// NIfTI-1 and -2: one file (.nii) or two (.hdr, .img), plain or gzip, a 3-D volume or a 4-D one over time.
// libnifti2 makes sense of the header; samples are read by us, since the library allocates before it looks.
#include <fmt/format.h>
#include <nifti/nifti2_io.h>

#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>

#include "src/files.h"
#include "src/stored_sequence.h"

namespace isoreel::io {
namespace {

struct NiftiDeleter {
  void operator()(nifti_image* image) const { nifti_image_free(image); }
};
using NiftiPointer = std::unique_ptr<nifti_image, NiftiDeleter>;

std::optional<ScalarType> scalarTypeOf(int datatype) {
  switch (datatype) {
    case DT_INT8:
      return ScalarType::kInt8;
    case DT_UINT8:
      return ScalarType::kUint8;
    case DT_INT16:
      return ScalarType::kInt16;
    case DT_UINT16:
      return ScalarType::kUint16;
    case DT_INT32:
      return ScalarType::kInt32;
    case DT_UINT32:
      return ScalarType::kUint32;
    case DT_INT64:
      return ScalarType::kInt64;
    case DT_UINT64:
      return ScalarType::kUint64;
    case DT_FLOAT32:
      return ScalarType::kFloat32;
    case DT_FLOAT64:
      return ScalarType::kFloat64;
    default:
      return std::nullopt;
  }
}

// What the library would refuse with a line on stderr, or would mend in silence.
template <class Header>
Status checkHeader(const Header& header) {
  if (header.dim[0] < 3 || header.dim[0] > 7) {
    return {ErrorCode::kBadData,
            fmt::format("has {} dimensions; a volume has 3, or 4 with time as the last", header.dim[0])};
  }
  for (int i = 1; i <= header.dim[0]; ++i) {
    if (header.dim[i] < 1) return {ErrorCode::kBadData, fmt::format("dimension {} is {}", i, header.dim[i])};
    if (i > 4 && header.dim[i] != 1) {
      return {ErrorCode::kUnsupported,
              fmt::format("dimension {} is {}: only scalar volumes over space and time can be read", i,
                          header.dim[i])};
    }
  }
  if (!scalarTypeOf(header.datatype)) {
    return {ErrorCode::kUnsupported, fmt::format("datatype {} ({}) is not a scalar of 8 to 64 bits",
                                                 header.datatype, nifti_datatype_string(header.datatype))};
  }
  const auto offset = static_cast<double>(header.vox_offset);
  if (!(offset >= 0 && offset < 1e18) || std::floor(offset) != offset)
    return {ErrorCode::kBadData, fmt::format("samples start at byte {:g}", offset)};
  return {};
}

// The decimal that a 32-bit header field was written from: 0.735, not 0.73500001430511475.
double decimal(float value) {
  const std::string text = fmt::format("{}", value);
  double result = 0;
  std::from_chars(text.data(), text.data() + text.size(), result);
  return result;
}
double decimal(double value) { return value; }

double secondsOf(int unit) {
  return unit == NIFTI_UNITS_SEC ? 1 : unit == NIFTI_UNITS_MSEC ? 1e-3 : unit == NIFTI_UNITS_USEC ? 1e-6 : 0;
}

Status setPlacement(const nifti_image& image, Grid& grid) {
  // The sform is a registration that someone made, the qform what the scanner said (nifti1.h, methods 3 and
  // 2).
  const nifti_dmat44& matrix = image.sform_code > 0 ? image.sto_xyz : image.qto_xyz;
  const bool placed = image.sform_code > 0 || image.qform_code > 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    ISOREEL_TRY(setNodes(grid, axis, image.dim[axis + 1]));
    if (!placed) {  // method 1
      grid.spacing[axis] = std::abs(image.pixdim[axis + 1]);
      continue;
    }
    setAxis(grid, axis, {matrix.m[0][axis], matrix.m[1][axis], matrix.m[2][axis]});
    grid.origin[axis] = matrix.m[axis][3];
  }
  return checkGrid(grid);
}

template <class Header>
Result<StoredVolumes> describe(const std::vector<std::uint8_t>& bytes,
                               nifti_image* (*convert)(Header, const char*)) {
  Header header;
  std::memcpy(&header, bytes.data(), sizeof header);
  StoredVolumes stored;
  stored.order = std::endian::native;
  if (header.sizeof_hdr != static_cast<int>(sizeof header)) {
    swap_nifti_header(&header, sizeof header == sizeof(nifti_2_header) ? 2 : 1);
    stored.order = stored.order == std::endian::little ? std::endian::big : std::endian::little;
  }
  ISOREEL_TRY(checkHeader(header));
  const NiftiPointer image(convert(header, nullptr));
  if (!image) return {ErrorCode::kBadData, "not a NIfTI header"};
  ISOREEL_TRY(setPlacement(*image, stored.grid));
  stored.type = *scalarTypeOf(header.datatype);
  stored.volumes = static_cast<std::size_t>(image->nt);
  // A slope of 0 means that there is none (nifti1.h).
  if (image->scl_slope != 0 && std::isfinite(image->scl_slope) && std::isfinite(image->scl_inter))
    stored.rescale = {image->scl_slope, image->scl_inter};
  stored.skip = static_cast<std::uint64_t>(header.vox_offset);
  const double second = secondsOf(image->time_units);
  if (stored.volumes > 1 && second > 0 && header.pixdim[4] > 0) {
    stored.firstTime = decimal(header.toffset) * second;
    stored.timeStep = decimal(header.pixdim[4]) * second;
  }
  return stored;
}

Result<Coding> codingOf(const std::string& path) {
  ISOREEL_TRY(regularFileSize(path).status());
  std::string head(2, '\0');
  std::ifstream(path, std::ios::binary).read(head.data(), 2);
  return startsAsGzip(head) ? Coding::kDeflated : Coding::kPlain;
}

// The file of samples that goes with header "a.hdr" or "a.hdr.gz".
Result<std::string> imageOf(std::string path) {
  if (path.ends_with(".gz")) path.resize(path.size() - 3);
  if (!path.ends_with(".hdr") && !path.ends_with(".HDR"))
    return {ErrorCode::kBadData, "says that its samples lie in an .img file, but its own name is not .hdr"};
  const std::string image = path.substr(0, path.size() - 3) + (path.ends_with("R") ? "IMG" : "img");
  for (const std::string& candidate : {image, image + ".gz"}) {
    if (regularFileSize(candidate).ok()) return candidate;
  }
  return {ErrorCode::kNotFound, image + ": no such file, where the header's samples should be"};
}

Result<StoredVolumes> readHeader(const std::string& path) {
  ISOREEL_ASSIGN(const Coding coding, codingOf(path));
  ISOREEL_ASSIGN(const auto stream, ByteStream::open(path, 0, coding));
  std::vector<std::uint8_t> bytes(sizeof(nifti_1_header));
  ISOREEL_TRY(stream->read(bytes));
  const bool second = std::memcmp(bytes.data() + 4, "n+2", 3) == 0 ||
                      std::memcmp(bytes.data() + 4, "ni2", 3) == 0;  // else sniffed as the first
  if (second) {
    bytes.resize(sizeof(nifti_2_header));
    ISOREEL_TRY(stream->read(std::span(bytes).subspan(sizeof(nifti_1_header))));
  }
  nifti_set_debug_level(0);
  ISOREEL_ASSIGN(StoredVolumes stored, (second ? describe<nifti_2_header>(bytes, nifti_convert_n2hdr2nim)
                                               : describe<nifti_1_header>(bytes, nifti_convert_n1hdr2nim))
                                           .at(path));
  stored.header = path;
  stored.coding = coding;
  std::string samples = path;
  if (bytes[second ? 5 : 345] == '+') {
    stored.skip = std::max<std::uint64_t>(stored.skip, bytes.size());
  } else {
    ISOREEL_ASSIGN(samples, imageOf(path).at(path));
    ISOREEL_ASSIGN(stored.coding, codingOf(samples));
  }
  stored.parts.push_back({samples, 0});
  return stored;
}

SequenceResult openOne(const std::string& path) {
  ISOREEL_ASSIGN(StoredVolumes stored, readHeader(path));
  return openStored(std::move(stored));
}

}  // namespace

SequenceResult openNifti(const std::vector<std::string>& files, const VolumeOptions&) {
  return openEach(files, openOne);
}

}  // namespace isoreel::io
