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
  /// Which array of files that can hold several: the point data array of a VTI, the grid of an OpenVDB. ""
  /// for the only scalar one, or else OpenVDB's only level set.
  std::string array;
};

/// A sequence of volumes, all of one grid, read one at a time; in order is cheapest, or in several orders
/// that take turns, such as those of GOPs under way side by side.
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
  /// The time of volume `i` < size() in seconds, when its file says: a NIfTI or NRRD over time that gives the
  /// unit, the TimeValue of a VTI. Nothing promises that times rise.
  virtual std::optional<double> time(std::size_t /*i*/) const { return std::nullopt; }
  /// The file that volume `i` comes from, for messages.
  virtual std::string name(std::size_t i) const = 0;
};

/// Opens volumes by what their files hold, not by their names: raw + JSON and MetaImage, and when built in
/// NRRD, NIfTI, VTI, OpenVDB. `inputs` are files in order, where one may hold several volumes (a 4-D file, a
/// JSON that lists files); folders, which stand for their volume files in natural order; printf patterns
/// (`frame_%04d.vdb`), which stand for the numbers that exist; or globs (`frame_*.vdb`), in natural order.
/// Errors: kNotFound (a file, array or number of a pattern), kUnsupported (not one of these formats, or built
/// without), kInvalidArgument (formats, sizes or places that differ; an unclear choice of array), kBadData,
/// kTruncated, kLimit, kIo.
Result<std::unique_ptr<VolumeSequence>> openVolumes(const std::vector<std::string>& inputs,
                                                    const VolumeOptions& options = {});

/// The formats this build reads, for help texts.
std::vector<std::string> volumeFormats();

}  // namespace isoreel::io
