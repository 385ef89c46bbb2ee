// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/base/parallel.h>
#include <isoreel/codec/cell.h>
#include <isoreel/codec/configuration.h>
#include <isoreel/codec/surface.h>

#include <memory>
#include <span>

namespace isoreel {

/// Where dual contouring puts the vertex of an active cell.
enum class VertexPlacement {
  kQef,  // least squares of the planes at the cell's sign-changing edges, kept inside the cell (Ju et al.
         // 2002)
  kCentroid,  // mean of the crossings on those edges
};

/// How many vertices an active cell has.
enum class CellVertices {
  kOnePerSheet,  // of the surface in it, so that the mesh is a 2-manifold (spec codec 5.5): profile main
  kOne,          // in which all sheets meet: profile classic
};

/// What to do with samples that are not-a-number or infinite.
enum class NonFinite {
  kRefuse,   // an error that names the first such sample
  kOutside,  // they are outside, and the surface passes half-way between them and an inside neighbour
};

/// Which packets an encoder may write.
enum class FrameTypes {
  kIntra,  // I only
  kAuto,   // P where it is smaller
};

/// How motion is searched for.
struct MotionSettings {
  static constexpr std::uint32_t kAnySize = 0;  // 8, 16 or 32 cells, whichever makes the smallest packet
  std::uint32_t block_log2 = 3;                 // of a block's side in cells: 2 to 5, or kAnySize
  std::uint32_t range = 8;   // of the coarse search, in cells each way around what neighbours say; 0: none
  std::uint32_t every = 1;   // of how many vertices in a block one is looked at
  bool registration = true;  // refine by registration to the previous surface
};

/// What decoded surfaces should be close to.
enum class Fit {
  kVolume,     // the isosurface of the volume's trilinear interpolant
  kExtracted,  // the mesh of the extractor
};

/// What profile main brings surfaces close to, and what its encoder may leave out, to see what each is worth.
struct HeightSettings {
  Fit fit = Fit::kVolume;
  bool neighbours = true;     // predict heights from those of coded neighbours (a tool of the format)
  bool mixed_signs = true;    // two opinions on each sign (another)
  bool sheets = true;         // a vertex for each sheet of a cell, so that the mesh is a manifold (another)
  bool fit_triangles = true;  // choose heights for the mesh's triangles, not for its vertices alone
  bool weigh_rate = true;     // and for what they cost
  bool refine = true;         // look closely: at more samples of the target, after the fit once more, at
                              // all vertices for the weights of predictions; and twice at the rate
};

struct EncoderSettings {
  Configuration configuration;  // `tools` are set by the encoder; `grid` is the volumes'
  double cell = 1;  // side of a coded cell, in cells of the volumes, 1 to kMaxCell: see coarserGrid()
  FrameTypes frame_types = FrameTypes::kIntra;
  std::uint32_t gop = 12;  // frames from one I frame to the next, at most; 1 or more
  MotionSettings motion;
  HeightSettings heights;  // profile main
  VertexPlacement placement = VertexPlacement::kQef;
  NonFinite non_finite = NonFinite::kRefuse;
  ParallelFor parallel = serialFor;
};

inline constexpr double kMaxCell = 64;

/// The grid on which surfaces are coded whose cells are to be `cell` times as large as those of the volumes,
/// 1 to kMaxCell: in the same box, with as many nodes as give cells that are no larger than that, 2 at least.
Grid coarserGrid(const Grid& grid, double cell);

/// How much time an encoder takes.
enum class Preset { kFast, kDefault, kBest };

/// Sets what of the settings a preset is about. Those of kDefault are what new settings have.
void usePreset(Preset preset, EncoderSettings& settings);

/// Time and isovalue of a frame to encode.
struct FrameTiming {
  std::uint64_t number = 0;
  std::int64_t time = 0;       // ticks of the configuration's time base
  std::uint64_t duration = 1;  // ticks
  double isovalue = 0;
};

/// Sizes of what a packet holds, in bytes.
struct PacketSizes {
  std::uint64_t signs = 0;  // corner signs and leaf bits
  std::uint64_t motion = 0;
  std::uint64_t vertices = 0;
  std::uint64_t other = 0;  // header and configuration record
};

/// What of coding a frame does not need the frames before it: about half of the work. Keeps its memory for
/// the next frame.
class PreparedFrame {
 public:
  PreparedFrame();
  PreparedFrame(PreparedFrame&&) noexcept;
  PreparedFrame& operator=(PreparedFrame&&) noexcept;
  ~PreparedFrame();

 private:
  friend class Encoder;
  struct State;
  std::unique_ptr<State> state_;
};

/// Turns volumes into packets, in the order given: GOPs are closed, and a P packet is predicted from the
/// packet before it, as a decoder gets it. One encoder per thread; encoders share nothing. The same volumes
/// and settings give the same bytes, whatever `parallel` does.
class Encoder {
 public:
  /// Fails when the configuration breaks a rule of spec codec 2.
  static Result<Encoder> create(EncoderSettings settings);
  Encoder(Encoder&&) noexcept;
  Encoder& operator=(Encoder&&) noexcept;
  ~Encoder();

  /// Codes the isosurface of `volume`, whose grid must equal the configuration's in size (placement is not
  /// compared). Where settings.cell is above 1, signs are those of the volume's trilinear interpolant at the
  /// nodes of the coarser grid, and heights are chosen for the volume as it is. A P packet is written for a
  /// frame whose number follows that of the frame before, within the GOP limit, when it is smaller than the I
  /// packet. Memory beyond the volume, on one thread: one bit per node and, of a splash of 129³ and a head of
  /// 257³, 90 to 140 bytes per vertex in profile classic, 420 to 470 in profile main; where P packets may
  /// follow 130 to 260 and 460 to 610. `sizes` may be null. When memory runs out (kLimit), the next frame
  /// starts a GOP.
  Result<Packet> encode(const Volume& volume, const FrameTiming& timing, PacketSizes* sizes = nullptr);

  /// The same in two steps, so that a frame can be prepared while those before it are coded: prepare() may be
  /// called from any thread, for several frames at once and during encode(), which it shares nothing with but
  /// the settings' `parallel`. Frames are encoded in their order, each by the encoder that prepared it, and
  /// `volume` has to be there until then.
  Status prepare(const Volume& volume, const FrameTiming& timing, PreparedFrame& frame) const;
  /// `frame` has been prepared without an error; afterwards it may be used for another.
  Result<Packet> encode(PreparedFrame& frame, PacketSizes* sizes = nullptr);

  /// Codes a surface that was decoded before, where its volume is gone, with vertices for sheets as the
  /// settings have it. `cells` are Decoder::cells() of it, and `filled` tells of a frame without any whether
  /// all of it is inside. The packet has the same signs, so the same faces and connections; each vertex moves
  /// by rounding to the configuration's step along its normal and, where that was another or the packet is
  /// predicted, along its tangents. The header tells no error.
  Result<Packet> encodeAgain(const Surface& surface, std::span<const Cell> cells, bool filled,
                             const FrameTiming& timing, PacketSizes* sizes = nullptr);

  /// What packets are coded with: the settings', with the flags of the tools that they may use and the grid
  /// that they are on.
  const Configuration& configuration() const;
  /// The configuration record that starts every I packet (also what a container stores) that.
  const Bytes& configurationRecord() const;

 private:
  struct State;
  explicit Encoder(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// The surface that the encoder's extractor sees before quantisation: dual contouring of `volume` (encoder
/// side, not normative). Vertices are rounded to 1/16384 of a cell and numbered as a decoder numbers them, of
/// profile main unless `vertices` says otherwise.
Result<Surface> extractSurface(const Volume& volume, double isovalue, Inside inside,
                               VertexPlacement placement = VertexPlacement::kQef,
                               NonFinite non_finite = NonFinite::kRefuse,
                               const ParallelFor& parallel = serialFor,
                               CellVertices vertices = CellVertices::kOnePerSheet);

}  // namespace isoreel
