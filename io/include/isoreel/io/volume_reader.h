// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/codec/volume.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace isoreel::io {

/// How to read volume files where their content leaves a choice.
struct VolumeOptions {
  std::string grid;  // OpenVDB: the grid's name; "" for the only float grid, or else the only level set
};

/// A sequence of volumes, all of one grid, read one at a time.
class VolumeSequence {
 public:
  virtual ~VolumeSequence() = default;
  virtual std::size_t size() const = 0;
  /// The grid that all volumes share.
  virtual const Grid& grid() const = 0;
  /// True when the files say that they hold level sets (inside is below 0).
  virtual bool levelSet() const = 0;
  /// Volume `i` < size(). Errors name the file, the place and what is wrong. Not thread-safe.
  virtual Result<Volume> read(std::size_t i) = 0;
  /// The file that volume `i` comes from, for messages.
  virtual std::string name(std::size_t i) const = 0;
};

/// Opens volumes by what their files hold, not by their names: raw + JSON, NRRD, OpenVDB (when built in).
/// `inputs` are files in order, where one may hold several volumes (a 4-D NRRD, a JSON that lists files);
/// folders, which stand for their volume files in natural order; or printf patterns (`frame_%04d.vdb`), which
/// stand for the numbers that exist. Errors: kNotFound (a file, grid or number of a pattern), kUnsupported
/// (not one of these formats, or built without), kInvalidArgument (formats, sizes or places that differ; an
/// unclear choice of grid), kBadData, kTruncated, kLimit, kIo.
Result<std::unique_ptr<VolumeSequence>> openVolumes(const std::vector<std::string>& inputs,
                                                    const VolumeOptions& options = {});

/// The formats this build reads, for help texts.
std::vector<std::string> volumeFormats();

}  // namespace isoreel::io
