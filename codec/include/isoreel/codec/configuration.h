// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/base/packet.h>
#include <isoreel/codec/grid.h>
#include <isoreel/codec/volume.h>

namespace isoreel {

inline constexpr std::uint8_t kFormatVersion = 1;
inline constexpr std::uint8_t kFormatMinor = 0;

/// Flags of Configuration::tools.
inline constexpr std::uint32_t kToolPrediction = 1;  // there may be P packets (spec codec 8)
inline constexpr std::uint32_t kToolNeighbours = 2;  // main: heights are predicted from neighbours too (11.4)
inline constexpr std::uint32_t kToolMixedSigns = 4;  // main: two opinions on each sign (11.7)
inline constexpr std::uint32_t kToolSheets = 8;      // main: a vertex for each sheet of a cell (5.5)
inline constexpr std::uint32_t kToolSlices = 16;     // main: large levels and surfaces in slices (11.10)
inline constexpr std::uint32_t kToolsOfMain =
    kToolPrediction | kToolNeighbours | kToolMixedSigns | kToolSheets | kToolSlices;

enum class Profile : std::uint8_t { kClassic = 0, kMain = 1 };

/// Into how many slices the cells of a level, or the vertices of a surface, are cut (spec codec 11.10): as
/// many as have `least_cells` each, `most` at most.
struct Slices {
  static constexpr std::uint32_t kMost = 16, kLeastCells = 256;
  std::uint32_t most = 1;           // 1 to kMost; 1: no slices
  std::uint32_t least_cells = 512;  // kLeastCells to 2^30

  bool operator==(const Slices&) const = default;
};

/// The configuration record (spec codec 2): what a decoder must know before the first packet.
struct Configuration {
  Profile profile = Profile::kMain;
  Inside inside = Inside::kAbove;
  std::uint32_t tools = 0;  // one flag a coding tool
  Slices slices;            // with kToolSlices
  Grid grid;
  std::uint32_t step =
      kCell / 16;  // nominal normal step of the vertex residual, 1/16384 of a cell, 1 to 16384
  TimeBase time_base;

  bool operator==(const Configuration&) const = default;
};

/// The record's bytes: an even number, own CRC-32C at the end.
Result<Bytes> writeConfiguration(const Configuration& configuration);

/// Reads a record that fills `bytes`. Safe for untrusted input.
Result<Configuration> readConfiguration(ByteSpan bytes);

}  // namespace isoreel
