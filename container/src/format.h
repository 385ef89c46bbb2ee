// SPDX-License-Identifier: BSD-3-Clause
// Every structure of the `.isr` file, once each (spec/container.md). The frame header, which packets share,
// is in base/packet.h.
#pragma once

#include <isoreel/base/packet.h>
#include <isoreel/base/syntax.h>
#include <isoreel/container/file_info.h>

#include <array>
#include <cstdint>
#include <string>

namespace isoreel::container {

using Uuid = std::array<std::uint8_t, 16>;
using ChunkType = std::array<std::uint8_t, 4>;

inline constexpr std::uint8_t kVersion = 1;
inline constexpr std::uint8_t kMinor = 0;

constexpr ChunkType chunkType(const char (&name)[5]) {
  return {static_cast<std::uint8_t>(name[0]), static_cast<std::uint8_t>(name[1]),
          static_cast<std::uint8_t>(name[2]), static_cast<std::uint8_t>(name[3])};
}
inline constexpr ChunkType kTrackType = chunkType("TRAK");
inline constexpr ChunkType kTagsType = chunkType("TAGS");
inline constexpr ChunkType kFrameType = chunkType("FRAM");
inline constexpr ChunkType kChaptersType = chunkType("CHAP");
inline constexpr ChunkType kAttachmentType = chunkType("ATCH");
inline constexpr ChunkType kParityType = chunkType("PRTY");
inline constexpr ChunkType kIndexType = chunkType("INDX");
inline constexpr ChunkType kFooterType = chunkType("FOOT");

// Limits (spec container 10). Readers refuse more, so that no length in a file makes them allocate out of
// proportion.
inline constexpr std::uint64_t kMaxName = 1024;
inline constexpr std::uint64_t kMaxConfiguration = std::uint64_t{1} << 16;
inline constexpr std::uint64_t kMaxTrackPayload = std::uint64_t{1} << 17;
inline constexpr std::uint64_t kMaxTags = std::uint64_t{1} << 20;
inline constexpr std::uint64_t kMaxTagsPayload = std::uint64_t{1} << 21;
inline constexpr std::uint64_t kMaxTracks = 256;
inline constexpr std::uint64_t kMaxChapters = std::uint64_t{1} << 16;
inline constexpr std::uint64_t kMaxChaptersContent = std::uint64_t{1} << 20;
inline constexpr std::uint64_t kMaxChaptersPayload = std::uint64_t{1} << 21;
inline constexpr std::uint64_t kMaxAttachments = 4096;
inline constexpr std::uint64_t kMaxPartContent = std::uint64_t{1} << 20;  // of an attachment
inline constexpr std::uint64_t kMaxPartPayload = std::uint64_t{1} << 21;
inline constexpr std::uint64_t kMaxParityPayload = std::uint64_t{1} << 30;
inline constexpr std::uint64_t kMaxParityRun = std::uint64_t{1} << 29;
inline constexpr std::uint64_t kMaxIndexContent = std::uint64_t{1} << 28;
inline constexpr std::uint64_t kIndexAllowance = std::uint64_t{1}
                                                 << 21;  // index content above the file's length
inline constexpr std::uint64_t kMaxPayload = (std::uint64_t{1} << 28) + (std::uint64_t{1} << 21);
inline constexpr std::uint64_t kMaxFrameStart = 4096;  // of a FRAM payload, all that stands before the packet

/// The first bytes of a file (spec container 2.2).
struct Signature {
  static constexpr const char* kName = "signature";
  static constexpr const char* kSpec = "container 2.2";
  static constexpr std::size_t kBytes = 32;
  static constexpr std::array<std::uint8_t, 8> kMagic{0x89, 'I', 'S', 'R', 0x0D, 0x0A, 0x1A, 0x0A};

  std::array<std::uint8_t, 8> magic = kMagic;
  std::uint8_t version = kVersion;
  std::uint8_t minor = kMinor;
  std::uint16_t reserved = 0;
  Uuid uuid{};
  std::uint32_t crc = 0;  // of the 28 bytes before it

  template <class Visitor>
  void fields(Visitor& v) {
    v.array("magic", magic);
    v.fixed("version", version);
    v.fixed("minor", minor);
    v.fixed("reserved", reserved);
    v.array("uuid", uuid);
    v.fixed("crc", crc);
  }
};

/// What stands in front of a chunk's payload (spec container 3.1). A CRC-32C of the payload stands behind it.
struct ChunkHeader {
  static constexpr const char* kName = "chunk header";
  static constexpr const char* kSpec = "container 3.1";
  static constexpr std::size_t kBytes = 20;
  static constexpr std::array<std::uint8_t, 4> kSync{0xE5, 0x97, 0xC3, 0x9A};

  std::array<std::uint8_t, 4> sync = kSync;
  ChunkType type{};
  std::uint64_t length = 0;  // of the payload
  std::uint32_t crc = 0;     // of the 16 bytes before it

  template <class Visitor>
  void fields(Visitor& v) {
    v.array("sync", sync);
    v.array("type", type);
    v.fixed("length", length);
    v.fixed("crc", crc);
  }
};
inline constexpr std::size_t kPayloadCrcBytes = 4;
inline constexpr std::size_t kChunkOverhead = ChunkHeader::kBytes + kPayloadCrcBytes;

/// What a FRAM payload starts with; the sized frame header, a PacketLength and the packet follow (spec
/// container 4.2).
struct FrameStart {
  static constexpr const char* kName = "frame chunk";
  static constexpr const char* kSpec = "container 4.2";
  std::uint64_t track = 0;

  template <class Visitor>
  void fields(Visitor& v) {
    v.varint("track", track);
  }
};

struct PacketLength {
  static constexpr const char* kName = "frame chunk";
  static constexpr const char* kSpec = "container 4.2";
  std::uint64_t packet_length = 1;

  template <class Visitor>
  void fields(Visitor& v) {
    v.varint("packet_length", packet_length, 1, kMaxPacketBytes);
  }
};

// The least that a frame takes of a file: chunk, track, header with its length, packet length, one byte of
// packet.
inline constexpr std::uint64_t kMinFrameChunk = kChunkOverhead + 1 + 1 + 58 + 1 + 1;
inline constexpr std::uint64_t kMaxFrameChunk = kMaxPayload + kChunkOverhead;

/// One sequence of frames: payload of TRAK, and again in the index (spec container 5).
struct TrackRecord {
  static constexpr const char* kName = "track record";
  static constexpr const char* kSpec = "container 5";
  std::uint64_t id = 0;
  TimeBase time_base;
  std::string name;
  Bytes configuration;

  template <class Visitor>
  void fields(Visitor& v) {
    v.varint("id", id);
    v.varint("time_numerator", time_base.numerator, 1);
    v.varint("time_denominator", time_base.denominator, 1);
    v.text("name", name, kMaxName);
    v.blob("configuration", configuration, kMaxConfiguration);
  }
};

/// What a CHAP content starts with; the sized chapters follow (spec container 6.2).
struct ChapterCount {
  static constexpr const char* kName = "chapters";
  static constexpr const char* kSpec = "container 6.2";
  std::uint64_t count = 0;

  template <class Visitor>
  void fields(Visitor& v) {
    v.varint("count", count, 0, kMaxChapters);
  }
};

/// What an ATCH payload starts with, sized; a part of the attachment follows, compressed (spec
/// container 6.3).
struct AttachmentPart {
  static constexpr const char* kName = "attachment part";
  static constexpr const char* kSpec = "container 6.3";
  static constexpr std::uint64_t kLast = 1, kRemoved = 2;  // flags
  std::string name;
  std::uint32_t part = 0;
  std::uint64_t flags = 0;
  std::string media_type;

  template <class Visitor>
  void fields(Visitor& v) {
    v.text("name", name, Attachment::kMaxName);
    v.varint("part", part);
    v.varint("flags", flags);
    v.text("media_type", media_type, Attachment::kMaxMediaType);
    v.require(Attachment::nameFits(name), "the attachment's name is not a plain file name");
  }
};

/// The head of a PRTY payload, sized (spec container 6.4).
struct ParityHead {
  static constexpr const char* kName = "parity";
  static constexpr const char* kSpec = "container 6.4";
  static constexpr std::uint64_t kMaxBlocks = 256;  // data and parity together: what GF(2^8) has
  std::uint64_t distance = 0;                       // from the end of the bytes protected to this chunk
  std::uint64_t length = 1;                         // of the bytes protected
  std::uint64_t block = 1;                          // bytes in a block
  std::uint64_t first = 0;                          // row of the first parity block here
  std::uint64_t rows = 1;                           // parity blocks here

  std::uint64_t dataBlocks() const { return (length - 1) / block + 1; }

  template <class Visitor>
  void fields(Visitor& v) {
    v.varint("distance", distance);
    v.varint("length", length, 1, kMaxParityRun);
    v.varint("block", block, 1, length);
    v.varint("first", first, 0, kMaxBlocks - 2);
    v.varint("rows", rows, 1, kMaxBlocks - 1);
    v.require(dataBlocks() + first + rows <= kMaxBlocks, "more blocks than 256");
  }
};

/// The head of the index's content (spec container 7.1).
struct FileRecord {
  static constexpr const char* kName = "index";
  static constexpr const char* kSpec = "container 7.1";
  std::uint8_t version = kVersion;
  std::uint8_t minor = kMinor;
  Uuid uuid{};
  std::string tags;
  std::uint64_t tracks = 1;
  std::uint64_t chapters = 0;
  std::uint64_t attachments = 0;
  std::uint64_t entries = 0;

  template <class Visitor>
  void fields(Visitor& v) {
    v.fixed("version", version);
    v.fixed("minor", minor);
    v.array("uuid", uuid);
    v.text("tags", tags, kMaxTags);
    v.varint("tracks", tracks, 1, kMaxTracks);
    v.varint("chapters", chapters, 0, kMaxChapters);
    v.varint("attachments", attachments, 0, kMaxAttachments);
    v.varint("entries", entries);
  }
};

/// Where one frame is; its sized frame header follows (spec container 7.2).
struct IndexEntry {
  static constexpr const char* kName = "index entry";
  static constexpr const char* kSpec = "container 7.2";
  std::uint64_t track = 0;
  std::uint64_t gap = 0;  // bytes between the frame chunk listed before (or the signature) and this one
  std::uint64_t chunk_length = kMinFrameChunk;

  template <class Visitor>
  void fields(Visitor& v) {
    v.varint("track", track);
    v.varint("gap", gap);
    v.varint("chunk_length", chunk_length, kMinFrameChunk, kMaxFrameChunk);
  }
};

/// Payload of FOOT, the last chunk (spec container 8).
struct Footer {
  static constexpr const char* kName = "footer";
  static constexpr const char* kSpec = "container 8";
  static constexpr std::size_t kBytes = 40;
  static constexpr std::size_t kChunkBytes = kBytes + kChunkOverhead;
  std::uint64_t index_offset = 0;
  std::uint64_t index_length = 0;  // of the whole chunk
  std::uint64_t file_length = 0;   // up to and with this footer
  Uuid uuid{};

  template <class Visitor>
  void fields(Visitor& v) {
    v.fixed("index_offset", index_offset);
    v.fixed("index_length", index_length);
    v.fixed("file_length", file_length);
    v.array("uuid", uuid);
  }
};

}  // namespace isoreel::container
