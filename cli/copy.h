// SPDX-License-Identifier: BSD-3-Clause
// Packets from files into another file, bit for bit: what trim and concat share.
#pragma once

#include <isoreel/container/writer.h>
#include <isoreel/lavf/carrier_writer.h>

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "input.h"

namespace isoreel::cli {

/// A file that packets are copied from; each of its tracks has a reader of its own.
struct SourceFile {
  std::string path;
  std::vector<Input> tracks;  // in the file's order, or the one that was asked for

  const FileInfo& info() const { return tracks.front().info; }
};
/// `track`: its name or id; "" for all, of which a pipe may have one. Errors name the file. Damage is told on
/// stderr.
Result<SourceFile> openSource(const std::string& path, const std::string& track = "");

/// Entries of a track: those from `begin` on are copied, hidden up to `shown`.
struct Cut {
  std::uint64_t begin = 0, shown = 0, end = 0;
};
/// Packets that take the place of others, by entry.
using Replacements = std::map<std::uint64_t, Packet>;
/// Everything, as it is.
Cut wholeTrack(const PacketSource& packets);
/// The frames [begin, end) of the track, with what they need in front of them. begin <= end <= frameCount().
Result<Cut> cutOf(const PacketSource& packets, std::uint64_t begin, std::uint64_t end);

/// The configuration record of the first packet of a cut; that of the track where nothing is cut out.
Result<Bytes> configurationOf(const Input& input, const Cut& cut);

/// With parity of so many percent, or none for 0.
WriterOptions writerOptions(unsigned parity);

/// Those of the file; a pipe has passed them, and `notes` gets a line for each then.
Result<std::vector<lavf::CarrierAttachment>> openAttachments(const Input& input,
                                                             std::vector<std::string>& notes);
/// Those of which the writer has none of that name.
Status copyAttachments(const SourceFile& source, Writer& writer);

/// From ticks of one time base to those of another that is a whole number of times finer, and elsewhere.
struct TimeMap {
  std::int64_t factor = 1;
  std::int64_t shift = 0;

  /// Time and duration of the header; kLimit beyond 63 bits.
  Status apply(FrameHeader& header) const;
};
/// The coarsest base of which both are multiples; nothing when its fraction has more than 32 bits.
std::optional<TimeBase> commonBase(TimeBase a, TimeBase b);
/// How many ticks of `fine`, such as commonBase() gives, are one of `coarse`.
std::int64_t ticksOf(TimeBase fine, TimeBase coarse);

/// Appends packets to the tracks of a file: numbers count up, times rise.
class PacketCopier {
 public:
  struct Counts {
    std::uint64_t frames = 0, hidden = 0;
  };

  explicit PacketCopier(Writer& writer) : writer_(writer) {}
  /// Cuts of a file's tracks, in the order in which the packets stand there. `cuts`, `tracks` and
  /// `times` go with `source.tracks`; `tracks` are ids of the writer's. Packets in front of the first shown
  /// one are left out when they are those that the track ends with, so that cuts of one file fit together
  /// again. `instead`, none or one for each track, are written in the place of their entries. Errors name the
  /// file.
  Status copy(SourceFile& source, const std::vector<Cut>& cuts, const std::vector<std::uint64_t>& tracks,
              const std::vector<TimeMap>& times, const std::vector<Replacements>& instead = {});
  /// One packet, its time as it shall be in the file.
  Status write(Packet packet, std::uint64_t track);
  const Counts& counts() const { return counts_; }

 private:
  /// What tells packets apart.
  struct Mark {
    std::uint64_t bytes = 0, surface_hash = 0;
    std::uint32_t crc = 0;
    bool operator==(const Mark&) const = default;
  };
  static Mark markOf(const Packet& packet);
  struct Track {
    std::uint64_t frames = 0;
    std::vector<Mark> gop;  // from the last key on
  };
  Result<bool> continues(PacketSource& packets, const Cut& cut, const Track& track) const;

  Writer& writer_;
  Counts counts_;
  std::vector<Track> tracks_;  // by id
};

}  // namespace isoreel::cli
