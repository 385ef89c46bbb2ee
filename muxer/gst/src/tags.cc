// SPDX-License-Identifier: BSD-3-Clause
#include "tags.h"

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>

namespace isoreel::gst {
namespace {

using Json = nlohmann::ordered_json;

// What is nested deeper than anyone writes is left out: dumping recurses.
Json parsed(const std::string& text) {
  const auto keep = [](int depth, Json::parse_event_t, Json&) { return depth < 64; };
  Json json = Json::parse(text, keep, false);
  return json.is_object() ? json : Json::object();
}

std::string dumped(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

const char* tagName(const std::string& key) { return key == "software" ? GST_TAG_ENCODER : key.c_str(); }
std::string keyOf(const char* tag) { return std::strcmp(tag, GST_TAG_ENCODER) == 0 ? "software" : tag; }

// Adds a member under a name of GStreamer's; false when it has none of that name and type.
bool addNamed(GstTagList* list, const char* tag, const Json& value) {
  if (!gst_tag_exists(tag) || std::strcmp(tag, kJsonTag) == 0) return false;
  const GType type = gst_tag_get_type(tag);
  if (type == G_TYPE_STRING && value.is_string() && !value.get_ref<const std::string&>().empty()) {
    gst_tag_list_add(list, GST_TAG_MERGE_APPEND, tag, value.get_ref<const std::string&>().c_str(), nullptr);
  } else if (type == G_TYPE_UINT && value.is_number_unsigned() && value.get<std::uint64_t>() <= G_MAXUINT) {
    gst_tag_list_add(list, GST_TAG_MERGE_APPEND, tag, value.get<guint>(), nullptr);
  } else if (type == G_TYPE_DOUBLE && value.is_number()) {
    gst_tag_list_add(list, GST_TAG_MERGE_APPEND, tag, value.get<double>(), nullptr);
  } else if (type == GST_TYPE_DATE_TIME && value.is_string()) {
    GstDateTime* time = gst_date_time_new_from_iso8601_string(value.get_ref<const std::string&>().c_str());
    if (time == nullptr) return false;
    gst_tag_list_add(list, GST_TAG_MERGE_APPEND, tag, time, nullptr);
    gst_date_time_unref(time);
  } else {
    return false;
  }
  return true;
}

std::optional<Json> valueOf(const GstTagList* list, const char* tag) {
  const GValue* value = gst_tag_list_get_value_index(list, tag, 0);
  if (G_VALUE_HOLDS_STRING(value)) return Json(g_value_get_string(value));
  if (G_VALUE_HOLDS_UINT(value)) return Json(g_value_get_uint(value));
  if (G_VALUE_HOLDS_DOUBLE(value)) return Json(g_value_get_double(value));
  if (GST_VALUE_HOLDS_DATE_TIME(value)) {
    gchar* text = gst_date_time_to_iso8601_string(static_cast<GstDateTime*>(g_value_get_boxed(value)));
    Json json(text);
    g_free(text);
    return json;
  }
  return {};
}

void addExtended(Json& json, const GstTagList* list) {
  for (guint i = 0; i < gst_tag_list_get_tag_size(list, GST_TAG_EXTENDED_COMMENT); ++i) {
    const gchar* text = nullptr;
    if (!gst_tag_list_peek_string_index(list, GST_TAG_EXTENDED_COMMENT, i, &text)) continue;
    const std::string comment = text;
    const std::size_t equals = comment.find('=');
    if (equals == std::string::npos || equals == 0) continue;
    const std::string key = comment.substr(0, equals), value = comment.substr(equals + 1);
    // A value that is no text comes as its JSON: what it was already stays.
    if (json.contains(key) && !json[key].is_string() && dumped(json[key]) == value) continue;
    json[key] = value;
  }
}

bool aboutTheStream(const char* tag) {
  constexpr const char* kNames[] = {GST_TAG_CODEC,
                                    GST_TAG_VIDEO_CODEC,
                                    GST_TAG_AUDIO_CODEC,
                                    GST_TAG_CONTAINER_FORMAT,
                                    GST_TAG_BITRATE,
                                    GST_TAG_MINIMUM_BITRATE,
                                    GST_TAG_MAXIMUM_BITRATE,
                                    GST_TAG_NOMINAL_BITRATE,
                                    GST_TAG_ENCODER_VERSION,
                                    GST_TAG_EXTENDED_COMMENT,
                                    kJsonTag};
  return std::any_of(std::begin(kNames), std::end(kNames),
                     [&](const char* name) { return std::strcmp(tag, name) == 0; });
}

void collect(const GList* entries, const TimeBase& base, std::vector<Chapter>& chapters) {
  for (; entries != nullptr; entries = entries->next) {
    auto* entry = static_cast<GstTocEntry*>(entries->data);
    if (gst_toc_entry_is_sequence(entry) && chapters.size() < 100000) {
      gint64 start = 0, stop = -1;
      gst_toc_entry_get_start_stop_times(entry, &start, &stop);
      Chapter& chapter = chapters.emplace_back();
      chapter.start = toTicks(static_cast<GstClockTime>(std::max<gint64>(start, 0)), base);
      if (stop == start) chapter.kind = Chapter::Kind::kMarker;
      if (stop > start) {
        const std::int64_t end = toTicks(static_cast<GstClockTime>(stop), base);
        chapter.length = static_cast<std::uint64_t>(std::max<std::int64_t>(end - chapter.start, 0));
      }
      gchar* title = nullptr;
      GstTagList* tags = gst_toc_entry_get_tags(entry);
      if (tags != nullptr && gst_tag_list_get_string(tags, GST_TAG_TITLE, &title)) chapter.title = title;
      g_free(title);
    }
    collect(gst_toc_entry_get_sub_entries(entry), base, chapters);
  }
}

}  // namespace

void registerTags() {
  gst_tag_register(kJsonTag, GST_TAG_FLAG_META, G_TYPE_STRING, "Isoreel tags",
                   "All tags of an .isr file, as JSON", nullptr);
}

GstTagList* tagListOf(const std::string& json) {
  GstTagList* list = gst_tag_list_new_empty();
  gst_tag_list_set_scope(list, GST_TAG_SCOPE_GLOBAL);
  const Json tags = parsed(json);
  if (!tags.empty()) gst_tag_list_add(list, GST_TAG_MERGE_APPEND, kJsonTag, dumped(tags).c_str(), nullptr);
  for (const auto& [key, value] : tags.items()) {
    if (addNamed(list, tagName(key), value)) continue;
    const std::string text = key + "=" + (value.is_string() ? value.get<std::string>() : dumped(value));
    if (g_utf8_validate(text.c_str(), -1, nullptr))
      gst_tag_list_add(list, GST_TAG_MERGE_APPEND, GST_TAG_EXTENDED_COMMENT, text.c_str(), nullptr);
  }
  return list;
}

void mergeTags(GstTagList*& all, const GstTagList* tags, std::string& name) {
  GstTagList* rest = gst_tag_list_copy(tags);
  if (gst_tag_list_get_scope(tags) == GST_TAG_SCOPE_STREAM) {
    const gchar* title = nullptr;
    if (gst_tag_list_peek_string_index(tags, GST_TAG_TITLE, 0, &title)) name = title;
    gst_tag_list_remove_tag(rest, GST_TAG_TITLE);
  }
  GstTagList* merged = gst_tag_list_merge(all, rest, GST_TAG_MERGE_REPLACE);
  gst_clear_tag_list(&all);
  all = merged;
  gst_tag_list_unref(rest);
}

std::string jsonOf(const GstTagList* tags) {
  const gchar* ours = nullptr;
  Json json = Json::object();
  if (gst_tag_list_peek_string_index(tags, kJsonTag, 0, &ours)) json = parsed(ours);
  for (gint i = 0; i < gst_tag_list_n_tags(tags); ++i) {
    const gchar* tag = gst_tag_list_nth_tag_name(tags, static_cast<guint>(i));
    if (aboutTheStream(tag)) continue;
    if (const std::optional<Json> value = valueOf(tags, tag)) json[keyOf(tag)] = *value;
  }
  addExtended(json, tags);
  return dumped(json);
}

GstToc* tocOf(const std::vector<Chapter>& chapters, const TimeBase& base, std::int64_t shift) {
  if (chapters.empty()) return nullptr;
  GstToc* toc = gst_toc_new(GST_TOC_SCOPE_GLOBAL);
  GstTocEntry* edition = gst_toc_entry_new(GST_TOC_ENTRY_TYPE_EDITION, "isoreel");
  const auto time = [&](std::int64_t ticks, std::uint64_t length) {
    std::int64_t at = 0;
    if (__builtin_add_overflow(ticks, shift, &at) || __builtin_add_overflow(at, length, &at))
      return gint64{0};
    return static_cast<gint64>(toClockTime(std::max<std::int64_t>(at, 0), base));
  };
  for (std::size_t i = 0; i < chapters.size(); ++i) {
    const Chapter& chapter = chapters[i];
    GstTocEntry* mark =
        gst_toc_entry_new(GST_TOC_ENTRY_TYPE_CHAPTER, ("isoreel-" + std::to_string(i)).c_str());
    const gint64 start = time(chapter.start, 0);
    gint64 stop = time(chapter.start, chapter.length);
    if (chapter.kind == Chapter::Kind::kChapter && chapter.length == 0) {
      const auto next = std::find_if(chapters.begin() + static_cast<std::ptrdiff_t>(i) + 1, chapters.end(),
                                     [](const Chapter& c) { return c.kind == Chapter::Kind::kChapter; });
      stop = next == chapters.end() ? -1 : time(next->start, 0);
    }
    gst_toc_entry_set_start_stop_times(mark, start, stop);
    if (g_utf8_validate(chapter.title.c_str(), -1, nullptr) && !chapter.title.empty())
      gst_toc_entry_set_tags(mark, gst_tag_list_new(GST_TAG_TITLE, chapter.title.c_str(), nullptr));
    gst_toc_entry_append_sub_entry(edition, mark);
  }
  gst_toc_append_entry(toc, edition);
  return toc;
}

std::vector<Chapter> chaptersOf(const GstToc* toc, const TimeBase& base) {
  std::vector<Chapter> chapters;
  collect(gst_toc_get_entries(toc), base, chapters);
  std::stable_sort(chapters.begin(), chapters.end(),
                   [](const Chapter& a, const Chapter& b) { return a.start < b.start; });
  Chapter* before = nullptr;
  for (Chapter& chapter : chapters) {
    if (chapter.kind != Chapter::Kind::kChapter) continue;
    if (before != nullptr && before->start + static_cast<std::int64_t>(before->length) == chapter.start)
      before->length = 0;
    before = &chapter;
  }
  return chapters;
}

}  // namespace isoreel::gst
