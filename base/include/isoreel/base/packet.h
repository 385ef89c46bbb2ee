// SPDX-License-Identifier: BSD-3-Clause
// The currency between codec and container: coded frames, and what is known of them without decoding.
#pragma once

#include <isoreel/base/bytes.h>
#include <isoreel/base/syntax.h>

#include <array>
#include <cstdint>
#include <optional>

namespace isoreel {

/// The largest packet that any carrier of the format must take (spec codec 3).
inline constexpr std::uint64_t kMaxPacketBytes = (std::uint64_t{1} << 28) - 1;

enum class PacketType : std::uint8_t {
  kIntra = 0,      // decodes alone
  kPredicted = 1,  // needs the surface of an earlier packet (reserved: no version 1 encoder writes it yet)
};

/// Seconds per tick, as an exact fraction: times and durations are integers in this unit.
struct TimeBase {
  std::uint32_t numerator = 1;
  std::uint32_t denominator = 25;
  bool operator==(const TimeBase&) const = default;
  /// Of a time or a duration, in ticks.
  template <class Ticks>
  double seconds(Ticks ticks) const {
    return static_cast<double>(ticks) * static_cast<double>(numerator) / static_cast<double>(denominator);
  }
  /// The last tick at or before a time of `seconds`/`parts` seconds, exactly; `parts` above 0. What lies
  /// beyond 63 bits becomes the nearest that does not.
  std::int64_t tickAt(std::int64_t seconds, std::int64_t parts) const;
};

/// What `error_rms` and `error_max` of a frame header were measured against.
enum class ErrorKind : std::uint8_t {
  kNone = 0,       // not measured
  kExtracted = 1,  // distance of each decoded vertex from the extractor's vertex in the same cell
  kVolume = 2,     // symmetric distance between the decoded surface and the volume's isosurface
};

/// The per-frame header (spec/container.md 4.1): facts that plots and queries need, kept outside the packet
/// and again in the seek index. "Cells" are units of the grid; grid positions are in 1/16384 of a cell.
struct FrameHeader {
  static constexpr const char* kName = "frame header";
  static constexpr const char* kSpec = "container 4.1";

  static constexpr std::uint64_t kHidden = 1;  // a flag: decoded for frames that need it, never shown

  std::uint64_t number =
      0;  // display index in this file, from 0; of a hidden frame, that of the next one shown
  std::uint64_t position = 0;  // among all packets of its track in coded order, hidden ones too, from 0
  std::int64_t time = 0;       // ticks of the track's time base
  std::uint64_t duration = 1;  // ticks
  PacketType type = PacketType::kIntra;
  std::uint64_t flags = 0;  // kHidden; other bits are reserved, and readers ignore them
  std::uint64_t back = 0;   // how many packets before this one the I frame is that decoding must start from
  double isovalue = 0;
  std::uint32_t vertices = 0;
  std::uint32_t faces = 0;                 // quads
  std::array<std::uint32_t, 3> box_min{};  // grid positions; zero when there are no faces
  std::array<std::uint32_t, 3> box_max{};
  double area = 0;               // world units squared, of the triangles as output
  double volume = 0;             // world units cubed, inside the surface and the grid's border
  std::uint32_t components = 0;  // connected pieces of the surface
  std::int64_t euler = 0;        // vertices - edges + faces, of vertices that have a face
  ErrorKind error_kind = ErrorKind::kNone;
  float error_rms = 0;             // cells
  float error_max = 0;             // cells
  std::uint64_t surface_hash = 0;  // spec codec 7

  bool hidden() const { return (flags & kHidden) != 0; }
  bool operator==(const FrameHeader&) const = default;

  template <class Visitor>
  void fields(Visitor& v) {
    v.varint("number", number);
    v.varint("position", position, number);
    v.signedVarint("time", time);
    v.varint("duration", duration);
    v.fixed("type", type, 0, 1);
    v.varint("flags", flags);
    v.varint("back", back, 0, position);
    v.require((type == PacketType::kIntra) == (back == 0), "an I frame, and no other, must be its own key");
    v.f64("isovalue", isovalue);
    v.varint("vertices", vertices);
    v.varint("faces", faces);
    for (auto& c : box_min) v.varint("box_min", c);
    for (auto& c : box_max) v.varint("box_max", c);
    v.f64("area", area);
    v.f64("volume", volume);
    v.varint("components", components);
    v.signedVarint("euler", euler);
    v.fixed("error_kind", error_kind, 0, 2);
    v.f32("error_rms", error_rms);
    v.f32("error_max", error_max);
    v.fixed("surface_hash", surface_hash);
  }
};

/// One coded frame and its header.
struct Packet {
  FrameHeader header;
  Bytes data;
};

/// Coded frames by position: what a container reader offers and a player consumes. Frames count from 0 in
/// display order and are shown. Entries are all packets in coded order, hidden ones included; where none are
/// hidden, as in most sources, entries are frames and only the first three functions are needed. Not
/// thread-safe unless an implementation says so.
class PacketSource {
 public:
  virtual ~PacketSource() = default;
  virtual std::uint64_t frameCount() const = 0;
  /// `frame` < frameCount(). The reference stays good as long as the source.
  virtual const FrameHeader& header(std::uint64_t frame) const = 0;
  /// The packet's bytes, checked against the container's checksums.
  virtual Result<Bytes> packet(std::uint64_t frame) = 0;

  virtual std::uint64_t entryCount() const { return frameCount(); }
  /// The entry of a frame below frameCount().
  virtual std::uint64_t entryOf(std::uint64_t frame) const { return frame; }
  /// As header() and packet(), for `entry` < entryCount().
  virtual const FrameHeader& entryHeader(std::uint64_t entry) const { return header(entry); }
  virtual Result<Bytes> entryPacket(std::uint64_t entry) { return packet(entry); }
  /// Bytes of the packet, told without reading it; 0 where that is not known.
  virtual std::uint64_t entryBytes(std::uint64_t) const { return 0; }
  /// Says that the packets [begin, end) are going to be asked for, in order: a source may fetch them
  /// together.
  virtual void willRead(std::uint64_t begin, std::uint64_t end) {
    static_cast<void>(begin);
    static_cast<void>(end);
  }
};

/// The frame that is shown at `time`, in ticks: the last that begins at it or before; nothing before the
/// first.
std::optional<std::uint64_t> frameAt(const PacketSource& source, std::int64_t time);

/// The entry that decoding must start from to show `frame` < frameCount(): its key. kNotFound, naming the
/// frame, when the key or a packet between the two is not there, as in a damaged file.
Result<std::uint64_t> keyEntry(const PacketSource& source, std::uint64_t frame);

}  // namespace isoreel
