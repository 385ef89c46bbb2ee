// SPDX-License-Identifier: BSD-3-Clause
// What a file says of itself, beside its frames (spec container 2 and 5 to 6).
#pragma once

#include <isoreel/base/packet.h>

#include <array>
#include <string>
#include <vector>

namespace isoreel {

/// One sequence of frames: an isosurface of the volumes.
struct TrackInfo {
  std::uint64_t id = 0;
  std::string name;  // UTF-8
  TimeBase time_base;
  Bytes configuration;       // the codec's configuration record, opaque here; that of the first frame
  std::uint64_t frames = 0;  // shown ones; of a pipe, those that came so far
};

/// A stretch or a moment of the file that has a name (spec container 6.2).
struct Chapter {
  static constexpr const char* kName = "chapter";
  static constexpr const char* kSpec = "container 6.2";
  enum class Kind : std::uint8_t { kChapter = 0, kMarker = 1 };
  static constexpr std::uint64_t kMaxTitle = 4096;

  Kind kind = Kind::kChapter;
  std::int64_t start = 0;    // ticks of the first track's time base
  std::uint64_t length = 0;  // ticks; 0: a chapter lasts until the next one, a marker is a moment
  std::string title;         // UTF-8, at most kMaxTitle bytes

  bool operator==(const Chapter&) const = default;

  template <class Visitor>
  void fields(Visitor& v) {
    v.fixed("kind", kind, 0, 1);
    v.signedVarint("start", start);
    v.varint("length", length);
    v.text("title", title, kMaxTitle);
  }
};

/// A file that travels inside (spec container 6.3).
struct Attachment {
  static constexpr const char* kName = "attachment";
  static constexpr const char* kSpec = "container 7.3";
  static constexpr std::uint64_t kMaxName = 1024;
  static constexpr std::uint64_t kMaxMediaType = 256;

  std::string name;        // a plain file name: no folders, no control characters
  std::string media_type;  // "image/png", or ""
  std::uint64_t bytes = 0;
  std::uint64_t offset = 0;  // of its first chunk in the file
  std::uint64_t length = 0;  // from there to the end of its last chunk

  bool operator==(const Attachment&) const = default;
  /// Whether `name` may be one: 1 to kMaxName bytes, neither "." nor "..", no '/', '\\' or control
  /// characters.
  static bool nameFits(const std::string& name);

  template <class Visitor>
  void fields(Visitor& v) {
    v.text("name", name, kMaxName);
    v.text("media_type", media_type, kMaxMediaType);
    v.varint("bytes", bytes);
    v.varint("offset", offset);
    v.varint("length", length);
    v.require(nameFits(name), "its name is not a plain file name");
  }
};

/// Facts about a whole file, and about the track that is read.
struct FileInfo {
  std::array<std::uint8_t, 16> uuid{};
  std::uint8_t version = 0;  // 0: the signature is damaged, and so the UUID is lost
  std::uint8_t minor = 0;
  TimeBase time_base;  // these four are the chosen track's
  std::string track_name;
  Bytes configuration;
  std::uint64_t track_id = 0;
  std::vector<TrackInfo> tracks;  // in the file's order; empty when all track records are lost
  std::string tags = "{}";        // a JSON object
  std::vector<Chapter> chapters;
  std::vector<Attachment> attachments;
  bool indexed = false;     // false: found by scanning, as in a .part file or a damaged one
  std::uint64_t bytes = 0;  // of the file, 0 when not known
  std::vector<std::string>
      damage;  // what a scan had to leave out, a line each; for a .part its unfinished end
};

}  // namespace isoreel
