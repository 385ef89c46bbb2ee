// SPDX-License-Identifier: BSD-3-Clause
#include "metadata.h"

extern "C" {
#include <libavutil/avstring.h>
#include <libavutil/mathematics.h>
}

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

namespace isoreel::lavf {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostTags = std::size_t{1} << 20;  // spec container 6.1
// What muxers write about themselves.
constexpr std::array<const char*, 6> kTechnical{"major_brand", "minor_version", "compatible_brands",
                                                "encoder",     "creation_time", "handler_name"};

constexpr std::int64_t kMostTicks = std::int64_t{1} << 61;  // their sums and differences fit
bool beyond(std::int64_t ticks) { return ticks > kMostTicks || ticks < -kMostTicks; }

AVRational rational(TimeBase base) {
  return {static_cast<int>(base.numerator), static_cast<int>(base.denominator)};
}

/// How much of `text` from `start` on is one part: no character of UTF-8 is cut in two.
std::size_t partLength(const std::string& text, std::size_t start, std::size_t most) {
  if (text.size() - start <= most) return text.size() - start;
  std::size_t length = most;
  while (length > 1 && (static_cast<unsigned char>(text[start + length]) & 0xc0) == 0x80) --length;
  return length;
}

std::string partKey(const std::string& key, std::size_t part) {
  return part == 1 ? key : key + "." + std::to_string(part);
}

bool isTechnical(const std::string& key) {  // in capitals, in Matroska
  return std::any_of(kTechnical.begin(), kTechnical.end(),
                     [&](const char* known) { return av_strcasecmp(known, key.c_str()) == 0; });
}

bool isOurs(const std::string& key) { return key.starts_with("ISOREEL_"); }

}  // namespace

void putText(AVDictionary** entries, const std::string& key, const std::string& text, std::size_t most) {
  std::size_t part = 1;
  for (std::size_t start = 0; start < text.size(); ++part) {
    const std::size_t length = partLength(text, start, most);
    av_dict_set(entries, partKey(key, part).c_str(), text.substr(start, length).c_str(), 0);
    start += length;
  }
}

std::string takeText(const AVDictionary* entries, const std::string& key) {
  std::string text;
  for (std::size_t part = 1;; ++part) {
    const AVDictionaryEntry* entry = av_dict_get(entries, partKey(key, part).c_str(), nullptr, 0);
    if (entry == nullptr) return text;
    text += entry->value;
  }
}

void putTags(AVDictionary** entries, const std::string& tags, std::size_t most) {
  const Json json = Json::parse(tags, nullptr, false);
  if (!json.is_object() || json.empty()) return;
  putText(entries, kTagsKey, tags, most);
  for (const auto& [key, value] : json.items()) {
    if (value.is_string() && !key.empty() && !isOurs(key) &&
        value.get_ref<const std::string&>().size() <= most)
      av_dict_set(entries, key.c_str(), value.get_ref<const std::string&>().c_str(), AV_DICT_DONT_OVERWRITE);
  }
}

std::string takeTags(const AVDictionary* entries) {
  std::string tags = takeText(entries, kTagsKey);
  if (tags.size() <= kMostTags && Json::parse(tags, nullptr, false).is_object()) return tags;
  Json json = Json::object();
  for (const AVDictionaryEntry* entry = nullptr;
       (entry = av_dict_get(entries, "", entry, AV_DICT_IGNORE_SUFFIX)) != nullptr;) {
    const std::string key = entry->key;
    if (!isOurs(key) && !isTechnical(key)) json[key] = entry->value;
  }
  tags = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  return tags.size() <= kMostTags ? tags : "{}";
}

void putChapters(AVFormatContext& file, const std::vector<Chapter>& chapters, TimeBase base,
                 std::int64_t shift, std::int64_t end) {
  std::vector<Chapter> sorted = chapters;
  const auto earlier = [](const Chapter& a, const Chapter& b) { return a.start < b.start; };
  std::stable_sort(sorted.begin(), sorted.end(), earlier);
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    const Chapter& chapter = sorted[i];
    if (beyond(chapter.start) || chapter.length > static_cast<std::uint64_t>(kMostTicks)) continue;
    std::int64_t until = chapter.start + static_cast<std::int64_t>(chapter.length);
    if (chapter.kind == Chapter::Kind::kChapter && chapter.length == 0) {
      const auto next = std::find_if(sorted.begin() + static_cast<std::ptrdiff_t>(i) + 1, sorted.end(),
                                     [](const Chapter& c) { return c.kind == Chapter::Kind::kChapter; });
      until = std::max(chapter.start, next != sorted.end() ? next->start : end);
    }
    auto* written = static_cast<AVChapter*>(av_mallocz(sizeof(AVChapter)));
    if (written == nullptr) throw std::bad_alloc();
    written->id = static_cast<std::int64_t>(i) + 1;
    written->time_base = rational(base);
    written->start = chapter.start + shift;
    written->end = until + shift;
    av_dict_set(&written->metadata, "title", chapter.title.c_str(), 0);
    av_dynarray_add(&file.chapters, reinterpret_cast<int*>(&file.nb_chapters), written);
  }
}

// Pictures come as a packet that libavformat keeps beside the stream, everything else as private data.
static std::optional<std::pair<Attachment, ByteSpan>> attachmentOf(const AVStream& stream) {
  const bool picture = (stream.disposition & AV_DISPOSITION_ATTACHED_PIC) != 0;
  if (!picture && stream.codecpar->codec_type != AVMEDIA_TYPE_ATTACHMENT) return std::nullopt;
  const AVDictionaryEntry* name = av_dict_get(stream.metadata, "filename", nullptr, 0);
  const AVDictionaryEntry* type = av_dict_get(stream.metadata, "mimetype", nullptr, 0);
  if (name == nullptr || !Attachment::nameFits(name->value)) return std::nullopt;
  const ByteSpan content =
      picture
          ? ByteSpan(stream.attached_pic.data, static_cast<std::size_t>(stream.attached_pic.size))
          : ByteSpan(stream.codecpar->extradata, static_cast<std::size_t>(stream.codecpar->extradata_size));
  Attachment facts;
  facts.name = name->value;
  if (type != nullptr && std::string(type->value) != kAnyMediaType) facts.media_type = type->value;
  if (facts.media_type.size() > Attachment::kMaxMediaType) facts.media_type.clear();
  facts.bytes = content.size();
  return std::pair(facts, content);
}

std::vector<Attachment> takeAttachments(const AVFormatContext& file) {
  std::vector<Attachment> list;
  for (unsigned i = 0; i < file.nb_streams; ++i) {
    const auto found = attachmentOf(*file.streams[i]);
    const auto same = [&](const Attachment& a) { return a.name == found->first.name; };
    if (found && std::none_of(list.begin(), list.end(), same)) list.push_back(found->first);
  }
  return list;
}

ByteSpan attachmentContent(const AVFormatContext& file, const std::string& name) {
  for (unsigned i = 0; i < file.nb_streams; ++i) {
    const auto found = attachmentOf(*file.streams[i]);
    if (found && found->first.name == name) return found->second;
  }
  return {};
}

std::vector<Chapter> takeChapters(const AVFormatContext& file, TimeBase base, std::int64_t end) {
  std::vector<Chapter> chapters;
  for (unsigned i = 0; i < file.nb_chapters; ++i) {
    const AVChapter& read = *file.chapters[i];
    if (read.time_base.num <= 0 || read.time_base.den <= 0 || read.end < read.start) continue;
    const std::int64_t start = av_rescale_q(read.start, read.time_base, rational(base));
    const std::int64_t until = av_rescale_q(read.end, read.time_base, rational(base));
    if (beyond(start) || beyond(until)) continue;
    const AVDictionaryEntry* title = av_dict_get(read.metadata, "title", nullptr, 0);
    Chapter chapter{read.start == read.end ? Chapter::Kind::kMarker : Chapter::Kind::kChapter, start,
                    static_cast<std::uint64_t>(std::max<std::int64_t>(until - start, 0)),
                    title == nullptr ? "" : title->value};
    chapter.title.resize(partLength(chapter.title, 0, Chapter::kMaxTitle));
    chapters.push_back(std::move(chapter));
  }
  const auto earlier = [](const Chapter& a, const Chapter& b) { return a.start < b.start; };
  std::stable_sort(chapters.begin(), chapters.end(), earlier);
  // A chapter that lasts until the next one, or the end, has length 0 with us.
  for (auto chapter = chapters.begin(); chapter != chapters.end(); ++chapter) {
    if (chapter->kind != Chapter::Kind::kChapter) continue;
    const auto next = std::find_if(chapter + 1, chapters.end(),
                                   [](const Chapter& c) { return c.kind == Chapter::Kind::kChapter; });
    const std::int64_t until = next != chapters.end() ? next->start : end;
    if (chapter->start + static_cast<std::int64_t>(chapter->length) == until) chapter->length = 0;
  }
  return chapters;
}

}  // namespace isoreel::lavf
