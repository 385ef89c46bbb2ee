// SPDX-License-Identifier: BSD-3-Clause
// Tags and chapters of a file as GStreamer has them, and back.
#pragma once

#include <isoreel/container/file_info.h>

#include <string>
#include <vector>

#include "common.h"

namespace isoreel::gst {

/// A tag of our own: all tags of a file as its JSON object, so that what GStreamer has no name for stays as
/// it is.
inline constexpr char kJsonTag[] = "isoreel-tags";
/// Call once, before any of the rest.
void registerTags();

/// Tags for a file's pads: kJsonTag, and each member that is text or a number under GStreamer's name for it
/// ("title", "artist"; our "software" is "encoder"), or else as extended-comment "key=value".
GstTagList* tagListOf(const std::string& json);

/// Lays the tags of an event over `all`, which may be null; the title of a stream becomes its `name` instead.
void mergeTags(GstTagList*& all, const GstTagList* tags, std::string& name);

/// The JSON object of a tag list: that of kJsonTag, and over it the others, without those that are about the
/// stream itself (codec, container, bitrate).
std::string jsonOf(const GstTagList* tags);

/// Chapters in an edition, with titles; a marker is a chapter that ends where it starts, and the last chapter
/// has no end when the file does not tell. Null without chapters. `shift` ticks are added to times.
GstToc* tocOf(const std::vector<Chapter>& chapters, const TimeBase& base, std::int64_t shift);

/// All chapters, tracks and titles of a table of contents, in order; one that ends where the next starts has
/// length 0, as the file writes it.
std::vector<Chapter> chaptersOf(const GstToc* toc, const TimeBase& base);

}  // namespace isoreel::gst
