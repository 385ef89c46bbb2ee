// SPDX-License-Identifier: BSD-3-Clause
// An `.isr` file put together chunk by chunk, checksums right and everything else as one likes.
#pragma once

#include <isoreel/base/packet.h>

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "src/chunk.h"
#include "src/compress.h"
#include "src/contents.h"
#include "src/format.h"

namespace isoreel {

/// Everything is a member to change before finish(), which writes index and footer and may be called again.
class FileMaker {
 public:
  struct Entry {
    container::IndexEntry entry;
    FrameHeader header;
  };
  bool start = true;  // with a signature
  std::uint8_t version = container::kVersion, minor = container::kMinor;
  Bytes extension;  // behind the fields of every structure that may grow
  container::FileRecord index;
  std::optional<std::uint64_t> index_tracks, index_chapters, index_attachments, index_entries;
  std::vector<Entry> entries;
  std::vector<Attachment> attachments;
  container::Uuid footer_uuid;
  std::array<int, 2> footer_change{3, 0};  // added to index_offset (0), index_length (1) or file_length (2)

  FileMaker() {
    for (std::size_t i = 0; i < 16; ++i) index.uuid[i] = static_cast<std::uint8_t>(0xA0 + i);
    footer_uuid = index.uuid;
    index.tags = "{}";
  }

  /// The file so far.
  const Bytes& bytes() {
    begin();
    return file_;
  }
  void add(const Bytes& chunks) {
    begin();
    file_.insert(file_.end(), chunks.begin(), chunks.end());
  }
  void chunk(const char (&type)[5], const Bytes& payload) {
    begin();
    static_cast<void>(container::appendChunk(file_, container::chunkType(type), payload));
  }
  void track(std::uint64_t id, const std::string& name, bool in_index = true) {
    container::TrackRecord record;
    record.id = id;
    record.time_base = {1, 24};
    record.name = name;
    record.configuration = {'I', 'S', 'R', 'L'};  // to this layer they are bytes
    const Bytes payload = grown(record);
    chunk("TRAK", payload);
    if (in_index) tracks_.push_back(payload);
  }
  void frame(const Packet& packet, std::uint64_t track = 0) {
    const std::size_t at = bytes().size();
    Bytes header;
    static_cast<void>(writeSyntax(header, packet.header));
    append(header, extension);
    rawFrame(header, packet.data, packet.data.size(), track);
    Entry entry{{track, at - end_, file_.size() - at}, packet.header};
    end_ = file_.size();
    entries.push_back(entry);
  }
  /// One that the index does not list.
  void rawFrame(const Bytes& header, const Bytes& packet) { rawFrame(header, packet, packet.size()); }
  void rawFrame(const Bytes& header, const Bytes& packet, std::size_t says, std::uint64_t track = 0) {
    Bytes payload;
    ByteWriter out(payload);
    out.varint(track);
    out.varint(header.size());
    out.bytes(header);
    out.varint(says);
    out.bytes(packet);
    out.bytes(extension);
    chunk("FRAM", payload);
  }
  void tags(const std::string& json) {
    index.tags = json;
    chunk("TAGS", *container::compress(Bytes(json.begin(), json.end())));
  }
  void chapters(const std::vector<Chapter>& list) {
    Bytes content;
    ByteWriter(content).varint(list.size());
    for (const Chapter& chapter : list) sized(content, chapter);
    chapters_ = list;
    append(content, extension);
    chunk("CHAP", *container::compress(content));
  }
  /// `all` parts before this one are in the index's list, as a writer would have them.
  void part(const container::AttachmentPart& part, const std::string& content) {
    const std::size_t at = bytes().size();
    rawPart(grown(part), content);
    static_cast<void>(list_.add(part, content.size(), at, file_.size() - at));
  }
  void rawPart(const Bytes& head, const std::string& content) {
    Bytes payload;
    ByteWriter out(payload);
    out.varint(head.size());
    out.bytes(head);
    if (!content.empty()) out.bytes(*container::compress(Bytes(content.begin(), content.end())));
    chunk("ATCH", payload);
  }

  Bytes finish() {
    const std::uint64_t offset = bytes().size();
    index.tracks = index_tracks.value_or(tracks_.size());
    index.chapters = index_chapters.value_or(chapters_.size());
    index.attachments = index_attachments.value_or(attachments.size());
    index.entries = index_entries.value_or(entries.size());
    Bytes content;
    record(content);
    ByteWriter out(content);
    for (const Bytes& track : tracks_) {
      out.varint(track.size());
      out.bytes(track);
    }
    for (const Chapter& chapter : chapters_) sized(content, chapter);
    for (const Attachment& attachment : attachments) sized(content, attachment);
    for (const Entry& entry : entries) {
      static_cast<void>(writeSyntax(content, entry.entry));
      sized(content, entry.header);
    }
    append(content, extension);
    chunk("INDX", *container::compress(content));
    std::array<std::uint64_t, 4> footer{offset, file_.size() - offset,
                                        file_.size() + container::Footer::kChunkBytes, 0};
    footer[static_cast<std::size_t>(footer_change[0])] +=
        static_cast<std::uint64_t>(std::int64_t{footer_change[1]});
    Bytes payload;
    for (const std::size_t i : {0u, 1u, 2u}) ByteWriter(payload).fixed(footer[i]);
    ByteWriter(payload).bytes(footer_uuid);
    chunk("FOOT", payload);
    return file_;
  }

 private:
  static void append(Bytes& out, const Bytes& more) { out.insert(out.end(), more.begin(), more.end()); }
  template <class Struct>
  Bytes grown(const Struct& value) const {
    Bytes bytes;
    static_cast<void>(writeSyntax(bytes, value));
    append(bytes, extension);
    return bytes;
  }
  template <class Struct>
  void sized(Bytes& out, const Struct& value) const {
    const Bytes bytes = grown(value);
    ByteWriter(out).varint(bytes.size());
    append(out, bytes);
  }
  /// By hand: its numbers may be some that writeSyntax() refuses.
  void record(Bytes& out) const {
    Bytes bytes{index.version, minor};
    ByteWriter writer(bytes);
    writer.bytes(index.uuid);
    writer.varint(index.tags.size());
    writer.bytes(Bytes(index.tags.begin(), index.tags.end()));
    for (const std::uint64_t count : {index.tracks, index.chapters, index.attachments, index.entries})
      writer.varint(count);
    append(bytes, extension);
    ByteWriter(out).varint(bytes.size());
    append(out, bytes);
  }
  void begin() {
    if (!start || !file_.empty()) return;
    const Bytes magic(container::Signature::kMagic.begin(), container::Signature::kMagic.end());
    file_ = magic;
    append(file_, {version, minor, 0, 0});
    append(file_, Bytes(index.uuid.begin(), index.uuid.end()));
    ByteWriter(file_).fixed(crc32c(file_));
  }

  Bytes file_;
  std::uint64_t end_ = container::Signature::kBytes;  // of the last frame's chunk
  std::vector<Bytes> tracks_;
  std::vector<Chapter> chapters_;
  container::AttachmentList list_{attachments};
};

}  // namespace isoreel
