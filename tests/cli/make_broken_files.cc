// SPDX-License-Identifier: BSD-3-Clause
// Files that are unfinished or break a rule of spec/container.md each.
#include <functional>

#include "make_files.h"

namespace isoreel {
namespace {

using namespace container;

// ---- What is unfinished or damaged

Bytes flipped(Bytes bytes, std::size_t at) {
  bytes.at(at) ^= 1;
  return bytes;
}

Bytes cut(Bytes bytes, std::size_t from_end) {
  bytes.resize(bytes.size() - from_end);
  return bytes;
}

/// Where the n-th chunk of a type starts.
std::size_t chunkAt(const Bytes& file, const std::string& type, int n = 0) {
  for (std::size_t at = Signature::kBytes; at + ChunkHeader::kBytes < file.size();) {
    const ChunkHeader header = *readChunkHeader(ByteSpan(file).subspan(at));
    if (typeName(header.type) == type && n-- == 0) return at;
    at += static_cast<std::size_t>(header.length) + kChunkOverhead;
  }
  return file.size();
}

Bytes withoutChunk(Bytes file, std::size_t at) {
  const ChunkHeader header = *readChunkHeader(ByteSpan(file).subspan(at));
  const auto begin = file.begin() + static_cast<std::ptrdiff_t>(at);
  file.erase(begin, begin + static_cast<std::ptrdiff_t>(header.length + kChunkOverhead));
  return file;
}

/// A zstd frame of 17 bytes whose header claims so many: one block of one repeated byte, the last.
Bytes zstdThatClaims(std::uint64_t size) {
  Bytes frame{0x28, 0xB5, 0x2F, 0xFD, 0xE0};
  ByteWriter out(frame);
  out.fixed(size);
  out.bytes(Bytes{0x03, 0x00, 0x10, ' '});
  return frame;
}

/// A file whose second frame's header went through `change`.
Bytes withSecond(const std::function<void(FrameHeader&)>& change) {
  FileMaker maker;
  maker.track(0, "a");
  maker.frame(still(0));
  Packet second = still(1);
  change(second.header);
  maker.frame(second);
  return maker.finish();
}

/// A file in which something else than frames, or the index, was made otherwise.
Bytes with(const std::function<void(FileMaker&)>& change) {
  FileMaker maker;
  maker.track(0, "a");
  maker.frame(still(0));
  change(maker);
  return maker.finish();
}

/// `text` as it is, in a zstd frame of a raw block that states no size of its content.
Bytes zstdWithoutSize(const Bytes& content) {
  Bytes frame = {0x28, 0xB5, 0x2F, 0xFD, 0x00, 0x58};
  const std::uint32_t block = static_cast<std::uint32_t>(content.size()) << 3 | 1;
  for (const int shift : {0, 8, 16}) frame.push_back(static_cast<std::uint8_t>(block >> shift));
  frame.insert(frame.end(), content.begin(), content.end());
  return frame;
}

void damageChunks(Files& files) {
  const Bytes good = plain(), p = predicted();
  const std::size_t first = chunkAt(good, "FRAM"), second = chunkAt(good, "FRAM", 1);
  files.damaged("unfinished", "container 9.2", "it was cut, or is still being written", predicted(false));
  files.damaged("unfinished_in_chunk", "container 9.2", "ends inside a FRAM chunk",
                cut(predicted(false), 20));
  files.damaged("unfinished_in_header", "container 9.2", "ends inside a chunk header",
                Bytes(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(second + 7)));
  files.damaged("signature_crc", "container 2.2", "CRC does not match", flipped(good, 15));
  files.damaged("chunk_header_crc", "container 3.1", "chunk header CRC does not match",
                flipped(good, first + 9));
  files.damaged("sync_missing", "container 3.1", "no chunk starts here", flipped(good, first));
  files.damaged("payload_crc", "container 3.1", "payload CRC does not match", flipped(good, second + 90));
  files.damaged("p_frame_damaged", "container 4.3", "payload CRC does not match",
                flipped(p, chunkAt(p, "FRAM", 1) + 120));
  files.damaged("bytes_between", "container 2.1", "no chunk starts here", [&] {
    Bytes file = predicted(false);
    file.insert(file.begin() + static_cast<std::ptrdiff_t>(chunkAt(p, "FRAM", 2)), 5, 0xE5);
    return file;
  }());
  files.damaged("p_frame_gone", "container 4.3", "frame number 2 where 1 is due",
                withoutChunk(predicted(false), chunkAt(p, "FRAM", 1)));
  files.damaged("record_gone", "container 5", "name and configuration are lost",
                withoutChunk(cut(good, 64), chunkAt(good, "TRAK")));
  files.damaged("footer_gone", "container 8", "it was cut, or is still being written", cut(good, 64));
  files.damaged("footer_crc", "container 8", "payload CRC does not match", flipped(good, good.size() - 1));
  files.damaged("index_crc", "container 7", "payload CRC does not match", flipped(good, good.size() - 70));
  files.damaged("attachment_damaged", "container 6.3", "payload CRC does not match", [] {
    FileMaker maker;
    maker.track(0, "a");
    maker.part({"a.txt", 0, AttachmentPart::kLast, "text/plain"}, "content");
    const Bytes file = maker.finish();
    return flipped(file, chunkAt(file, "ATCH") + ChunkHeader::kBytes + 30);
  }());
  files.damaged("bytes_behind_footer", "container 8", "no chunk starts here", [&] {
    Bytes file = good;
    file.insert(file.end(), 24, 0);
    return file;
  }());
}

void damageFrames(Files& files) {
  const auto second = [&](const char* name, const char* spec, const char* error,
                          const std::function<void(FrameHeader&)>& change) {
    files.damaged(name, spec, error, withSecond(change));
  };
  second("frame_number_skipped", "container 4.3", "frame number 2 where 1 is due",
         [](FrameHeader& h) { h.number = h.position = 2; });
  second("frame_number_again", "container 4.3", "frame number 0 where 1 is due",
         [](FrameHeader& h) { h.number = 0; });
  second("frame_position_skipped", "container 4.3", "packet position 3 where 1 is due",
         [](FrameHeader& h) { h.position = 3; });
  second("frame_time_again", "container 4.3", "is not after", [](FrameHeader& h) { h.time = 0; });
  files.damaged("frame_back_too_far", "container 4.3", "is not of its GOP", [] {
    FileMaker maker;
    maker.track(0, "a");
    for (const std::uint64_t i : {0u, 1u, 2u}) {
      Packet packet = still(i);
      if (i == 2) {
        packet.header.type = PacketType::kPredicted;
        packet.header.back = 2;
      }
      maker.frame(packet);
    }
    return maker.finish();
  }());
  files.damaged("hidden_not_needed", "container 4.3", "is not of its GOP", [] {
    FileMaker maker;
    maker.track(0, "a");
    Packet hidden = still(0), next = still(0);
    hidden.header.flags = FrameHeader::kHidden;
    next.header.position = 1;
    maker.frame(hidden);
    maker.frame(next);
    return maker.finish();
  }());
  const auto raw = [&](const char* name, const char* error, const std::function<void(Bytes&)>& change) {
    files.damaged(name, "container 4.1", error, with([&](FileMaker& maker) {
                    Bytes header;
                    static_cast<void>(writeSyntax(header, still(1).header));
                    change(header);
                    maker.rawFrame(header, still(1).data);
                  }));
  };
  raw("frame_position_below_number", "position 0 is below 1", [](Bytes& h) { h[1] = 0; });
  raw("frame_type_2", "type 2 is above 1", [](Bytes& h) { h[4] = 2; });
  raw("frame_back_of_key", "an I frame, and no other", [](Bytes& h) { h[6] = 1; });
  raw("frame_back_above_position", "back 2 is above 1", [](Bytes& h) { h[4] = 1, h[6] = 2; });
  raw("frame_isovalue_not_finite", "isovalue is not finite", [](Bytes& h) { h[13] = 0xF0, h[14] = 0x7F; });
  raw("frame_varint_too_long", "is not a canonical varint", [](Bytes& h) {
    h[3] = 0x82;
    h.insert(h.begin() + 4, 0);
  });
  raw("frame_header_too_short", "ends inside surface_hash", [](Bytes& h) { h.resize(h.size() - 1); });
  raw("frame_error_kind_3", "error_kind 3 is above 2", [](Bytes& h) { h[h.size() - 17] = 3; });
  raw("frame_error_max_not_finite", "error_max is not finite",
      [](Bytes& h) { h[h.size() - 10] = 0x80, h[h.size() - 9] = 0x7F; });
  files.damaged("frame_without_packet", "container 4.2", "packet_length 0 is below 1",
                with([](FileMaker& maker) {
                  Bytes header;
                  static_cast<void>(writeSyntax(header, still(1).header));
                  maker.rawFrame(header, {});
                }));
  files.damaged("packet_longer_than_chunk", "container 4.2", "packet is longer than its chunk",
                with([](FileMaker& maker) {
                  Bytes header;
                  static_cast<void>(writeSyntax(header, still(1).header));
                  maker.rawFrame(header, Bytes(3, 1), 4);
                }));
  files.damaged("frame_before_its_record", "container 2.1", "in front of its track's record", [] {
    FileMaker maker;
    maker.track(0, "a");
    maker.frame(still(0), 5);
    maker.track(5, "b");
    return maker.finish();
  }());
}

void damageRest(Files& files) {
  const auto changed = [&](const char* name, const char* spec, const char* error,
                           const std::function<void(FileMaker&)>& change) {
    files.damaged(name, spec, error, with(change));
  };
  changed("tags_not_zstd", "container 1.1", "not a zstd frame", [](FileMaker& m) {
    m.chunk("TAGS", {'{', '}'});
  });
  changed("tags_without_size", "container 1.1", "does not state its content's size", [](FileMaker& m) {
    m.chunk("TAGS", zstdWithoutSize({'{', '}'}));
  });
  changed("tags_two_frames", "container 1.1", "bytes follow the zstd frame", [](FileMaker& m) {
    Bytes twice = *compress(Bytes{'{', '}'});
    twice.insert(twice.end(), twice.begin(), twice.end());
    m.chunk("TAGS", twice);
  });
  changed("tags_above_limit", "container 10", "is above 1048576",
          [](FileMaker& m) { m.chunk("TAGS", *compress(Bytes((1 << 20) + 1, ' '))); });
  changed("tags_claim_2_40", "container 1.1", "is above 1048576",
          [](FileMaker& m) { m.chunk("TAGS", zstdThatClaims(std::uint64_t{1} << 40)); });
  changed("chapters_claim_2_40", "container 1.1", "is above 1048576",
          [](FileMaker& m) { m.chunk("CHAP", zstdThatClaims(std::uint64_t{1} << 40)); });
  changed("attachment_claims_2_40", "container 1.1", "is above 1048576", [](FileMaker& m) {
    Bytes payload{9, 5, 'a', '.', 't', 'x', 't', 0, AttachmentPart::kLast, 0};
    const Bytes bomb = zstdThatClaims(std::uint64_t{1} << 40);
    payload.insert(payload.end(), bomb.begin(), bomb.end());
    m.chunk("ATCH", payload);
  });
  changed("chapters_too_many", "container 10", "count 65537 is above 65536", [](FileMaker& m) {
    Bytes content;
    ByteWriter(content).varint(65537);
    m.chunk("CHAP", *compress(content));
  });
  changed("chapter_kind_2", "container 6.2", "kind 2 is above 1", [](FileMaker& m) {
    m.chunk("CHAP", *compress(Bytes{1, 4, 2, 0, 0, 0}));
  });
  changed("chapters_cut", "container 6.2", "its length is above what is left", [](FileMaker& m) {
    m.chunk("CHAP", *compress(Bytes{1, 9, 0, 0, 0, 0}));
  });
  changed("attachment_name", "container 6.3", "not a plain file name", [](FileMaker& m) {
    m.rawPart(Bytes{6, '.', '.', '/', 'a', '.', 'b', 0, 1, 0}, "text");
  });
  changed("attachment_part_missing", "container 6.3", "and not the one before it", [](FileMaker& m) {
    m.part({"a.txt", 0, 0, ""}, "one");
    m.part({"a.txt", 2, AttachmentPart::kLast, ""}, "three");
  });
  changed("track_time_base_0", "container 5", "time_denominator 0 is below 1", [](FileMaker& m) {
    m.chunk("TRAK", {1, 1, 0, 0, 0});
  });
  changed("track_record_too_short", "container 5", "ends inside configuration", [](FileMaker& m) {
    m.chunk("TRAK", {1, 1, 24, 0});
  });

  const auto record = [&](const char* name, const char* error, std::uint64_t name_size,
                          std::uint64_t rest_size) {
    changed(name, "container 10", error, [=](FileMaker& m) {
      Bytes payload{1, 1, 24};
      ByteWriter out(payload);
      out.varint(name_size);
      out.bytes(Bytes(name_size, 'n'));
      out.varint(rest_size);
      m.chunk("TRAK", payload);
    });
  };
  record("track_name_too_long", "above 1024", 1025, 0);
  record("track_configuration_too_long", "above 65536", 1, 65537);

  changed("index_tracks_257", "container 10", "tracks 257 is above 256",
          [](FileMaker& m) { m.index_tracks = 257; });
  changed("index_chapters_65537", "container 10", "chapters 65537 is above 65536",
          [](FileMaker& m) { m.index_chapters = 65537; });
  changed("index_attachments_4097", "container 10", "attachments 4097 is above 4096",
          [](FileMaker& m) { m.index_attachments = 4097; });
  changed("index_uuid", "container 7.1", "its UUID is not the footer's",
          [](FileMaker& m) { m.index.uuid[3] ^= 1; });
  changed("index_version_0", "container 7.1", "version 0 is not defined",
          [](FileMaker& m) { m.index.version = 0; });
  changed("index_no_tracks", "container 7.1", "tracks 0 is below 1",
          [](FileMaker& m) { m.index_tracks = 0; });
  changed("index_too_many_entries", "container 7.1", "more frames than the file has room for",
          [](FileMaker& m) { m.index_entries = 1u << 30; });
  changed("index_cut", "container 7", "ends inside track", [](FileMaker& m) { m.index_entries = 2; });
  changed("index_track_unknown", "container 7.2", "there is no such track",
          [](FileMaker& m) { m.entries[0].entry.track = 3; });
  changed("index_two_same_ids", "container 5", "two tracks have the id 0",
          [](FileMaker& m) { m.track(0, "b"); });
  changed("index_gap_too_large", "container 7.2", "its chunk is not in front of the index",
          [](FileMaker& m) { m.entries[0].entry.gap = 5000; });
  changed("index_gap_wrong", "container 7.2", "no chunk starts here",
          [](FileMaker& m) { m.entries[0].entry.gap -= 1; });
  changed("index_length_wrong", "container 7.2", "chunk is not as long as it is listed",
          [](FileMaker& m) { m.entries[0].entry.chunk_length -= 1; });
  changed("index_header_differs", "container 7.2", "is not the one that is listed",
          [](FileMaker& m) { m.entries[0].header.vertices += 1; });
  changed("index_attachment_outside", "container 7.3", "an attachment is not in front of it",
          [](FileMaker& m) {
            m.attachments.push_back({"a.txt", "", 4, 32, 100000});
          });
  changed("footer_length", "container 8", "not of", [](FileMaker& m) { m.footer_change = {2, 1}; });
  changed("footer_index_offset", "container 8", "the index is not where it says", [](FileMaker& m) {
    m.footer_change = {0, -3};
  });
  changed("footer_index_length", "container 8", "the index is not where it says", [](FileMaker& m) {
    m.footer_change = {1, -2};
  });
  changed("footer_uuid", "container 8", "its UUID is not the signature's", [](FileMaker& m) {
    m.index.uuid[0] ^= 1;
    m.footer_uuid[0] ^= 1;
  });
}

void rejectAll(Files& files) {
  const Bytes good = cut(plain(1), 64);  // by index the signature would not be looked at
  const auto begins = [&](const Bytes& front, std::size_t instead_of) {
    Bytes bytes = front;
    bytes.insert(bytes.end(), good.begin() + static_cast<std::ptrdiff_t>(instead_of), good.end());
    return bytes;
  };
  files.reject("no_bytes", "container 2.2", "the file is empty", {});
  files.reject("no_isr", "container 2.2", "not an .isr file", begins({'R', 'I', 'F', 'F'}, 4));
  files.reject("signature_cut", "container 2.2", "inside the signature",
               Bytes(good.begin(), good.begin() + 20));
  files.reject("text_lf", "container 2.2", "CR LF was turned into LF",
               begins({0x89, 'I', 'S', 'R', 0x0A}, 6));
  files.reject("text_crlf", "container 2.2", "LF was turned into CR LF",
               begins({0x89, 'I', 'S', 'R', 0x0D, 0x0D, 0x0A, 0x1A, 0x0D, 0x0A}, 8));
  files.reject("text_cr", "container 2.2", "LF was turned into CR",
               begins({0x89, 'I', 'S', 'R', 0x0D, 0x0D, 0x1A, 0x0D}, 8));
  files.reject("text_7bit", "container 2.2", "the high bit of each byte was stripped", begins({0x09}, 1));
  files.reject("text_utf8", "container 2.2", "converted to UTF-8", begins({0xC2, 0x89}, 1));
  files.reject("version_0", "container 2.2", "version 0 is not defined", [] {
    FileMaker maker;
    maker.version = 0;
    maker.track(0, "a");
    maker.frame(still(0));
    return maker.bytes();
  }());
  files.reject("version_2", "container 2.2", "this reader knows 1", [] {
    FileMaker maker;
    maker.version = 2;
    maker.track(0, "a");
    maker.frame(still(0));
    return maker.bytes();
  }());
  files.reject("index_version_2", "container 9.1", "this reader knows 1",
               with([](FileMaker& m) { m.index.version = 2; }));
  files.reject("nothing_whole", "container 9.2", "neither a track record nor a frame is whole",
               Bytes(good.begin(), good.begin() + 60));
}

}  // namespace

void makeBrokenFiles(Files& files) {
  damageChunks(files);
  damageFrames(files);
  damageRest(files);
  rejectAll(files);
}

}  // namespace isoreel
