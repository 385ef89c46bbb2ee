// SPDX-License-Identifier: BSD-3-Clause
// What Isoreel is compared with: coders of single frames, each at one setting.
#pragma once

#include <isoreel/codec/encoder.h>
#include <isoreel/inspect/distance.h>

#include <memory>
#include <string>
#include <vector>

namespace isoreel::bench {

/// A frame as every coder gets it.
struct Frame {
  Volume volume;
  std::size_t volume_number = 0;  // frames over isovalues share one
  double isovalue = 0;
  Inside inside = Inside::kBelow;
  inspect::Mesh extracted;  // dual contouring of the volume before any coding, in cells
};

/// Where a coder stands on a rate-distortion curve.
struct Label {
  std::string coder;    // "draco"
  std::string variant;  // "speed 7": one curve each
  double parameter;     // what is swept along the curve
};

class Coder {
 public:
  virtual ~Coder() = default;
  virtual Label label() const = 0;
  /// Brings the frame into the form the library takes, and gives back the memory of what earlier calls made.
  /// Not measured.
  virtual void prepare(const Frame& frame) = 0;
  /// Codes the prepared frame. Measured.
  virtual Status encode() = 0;
  /// Decodes what encode() made. Measured.
  virtual Status decode() = 0;
  /// Bytes that the prepared frame adds.
  virtual std::size_t bytes() const = 0;
  /// What decode() gave, in cells.
  virtual inspect::Mesh mesh() const = 0;
};

using Coders = std::vector<std::unique_ptr<Coder>>;

/// Edgebreaker; `speed` from 0 (smallest) to 10 (fastest), positions quantised to `bits` over the bounding
/// box.
std::unique_ptr<Coder> dracoCoder(int speed, int bits);
/// Positions quantised to `bits` over the bounding box, at most 16; then zstd.
std::unique_ptr<Coder> meshoptCoder(int bits);
/// MG2; `precision` in cells.
std::unique_ptr<Coder> openctmCoder(double precision);
/// The whole volume, to an absolute tolerance of `tolerance` times `scale`, in units of the samples; the
/// surface is extracted when decoding.
std::unique_ptr<Coder> zfpCoder(double tolerance, double scale);

}  // namespace isoreel::bench
