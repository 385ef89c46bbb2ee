// SPDX-License-Identifier: BSD-3-Clause
// Tags and chapters as carriers have them (spec mappings 5).
#pragma once

#include <isoreel/container/file_info.h>

#include <cstdint>
#include <string>
#include <vector>

#include "av.h"

namespace isoreel::lavf {

inline constexpr const char* kTagsKey = "ISOREEL_TAGS";
inline constexpr const char* kFactsKey = "ISOREEL_FACTS";
/// Of an attachment that has none.
inline constexpr const char* kAnyMediaType = "application/octet-stream";

/// Text of any length: as KEY, and KEY.2, KEY.3 and so on where a value may not be longer than `most` bytes.
void putText(AVDictionary** entries, const std::string& key, const std::string& text, std::size_t most);
/// "" when it is not there.
std::string takeText(const AVDictionary* entries, const std::string& key);

/// The JSON object as it is, and each of its members that is text under its own name too, for others.
void putTags(AVDictionary** entries, const std::string& tags, std::size_t most);
/// The JSON object; where a carrier was not written by us, one of the carrier's own tags.
std::string takeTags(const AVDictionary* entries);

/// `end`: of the last frame. Times are in `base`, and are written `shift` later.
void putChapters(AVFormatContext& file, const std::vector<Chapter>& chapters, TimeBase base,
                 std::int64_t shift, std::int64_t end);
/// Those with names that ours may have. `offset` and `length` stay 0.
std::vector<Attachment> takeAttachments(const AVFormatContext& file);
/// Empty when there is none of that name.
ByteSpan attachmentContent(const AVFormatContext& file, const std::string& name);
std::vector<Chapter> takeChapters(const AVFormatContext& file, TimeBase base, std::int64_t end);

}  // namespace isoreel::lavf
