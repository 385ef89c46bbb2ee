// SPDX-License-Identifier: BSD-3-Clause
// The table of volume formats. A new format is one .cc file with its open function, a line here and a line in
// format.cc.
#pragma once

#include <isoreel/io/volume_reader.h>

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace isoreel::io {

using SequenceResult = Result<std::unique_ptr<VolumeSequence>>;

/// What a format may look at to know its own.
struct FileHead {
  std::string path;
  std::string bytes;     // the first 4096 bytes, or all of a shorter file
  std::string inflated;  // what they begin with when they are gzip's; else empty
};

struct Format {
  std::string_view name;
  bool (*sniff)(const FileHead& head);
  /// Opens `files` (one at least, all sniffed as this format) as one sequence. May throw: openVolumes
  /// catches. Null when this build lacks the library that reads the format.
  SequenceResult (*open)(const std::vector<std::string>& files, const VolumeOptions& options);
};

/// All formats this version knows, built in or not, in the order of sniffing.
std::span<const Format> formats();

SequenceResult openRawJson(const std::vector<std::string>& files, const VolumeOptions& options);
SequenceResult openNrrd(const std::vector<std::string>& files, const VolumeOptions& options);
SequenceResult openNifti(const std::vector<std::string>& files, const VolumeOptions& options);
SequenceResult openMetaImage(const std::vector<std::string>& files, const VolumeOptions& options);
SequenceResult openVti(const std::vector<std::string>& files, const VolumeOptions& options);
SequenceResult openOpenVdb(const std::vector<std::string>& paths, const VolumeOptions& options);

}  // namespace isoreel::io
