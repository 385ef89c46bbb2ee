// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/codec/configuration.h>

#include <vector>

namespace isoreel {

/// What a section of a packet holds (spec codec 3.2). Unknown kinds are skipped.
enum class SectionKind : std::uint32_t {
  kSigns = 1,     // corner signs of one octree level
  kLeaves = 2,    // leaf bits of one octree level
  kMotion = 3,    // prediction header and motion vectors
  kVertices = 4,  // vertex residuals
};

struct Section {
  std::uint32_t kind = 0;
  std::uint32_t level = 0;  // octree level for signs and leaves, else 0
  std::uint32_t bytes = 0;
};

/// The head of a packet (spec codec 3.1).
struct PacketHeader {
  static constexpr const char* kName = "packet header";
  static constexpr const char* kSpec = "codec 3.1";
  static constexpr std::uint32_t kMaxSections = 256;

  PacketType type = PacketType::kIntra;
  std::uint64_t number = 0;
  std::int64_t time = 0;
  std::uint64_t duration = 1;
  std::vector<std::uint64_t> references;  // how many frames back, in display order
  double isovalue = 0;
  std::uint32_t step = kCell / 16;             // of the residual's normal component, 1/16384 of a cell
  std::uint32_t tangential_step = kCell / 16;  // of its tangential components
  std::uint32_t vertices = 0;
  std::uint32_t faces = 0;
  std::uint64_t surface_hash = 0;
  Bytes configuration;  // the record, in I packets; empty in others
  std::vector<Section> sections;
  std::uint32_t payload_crc = 0;

  template <class V>
  void fields(V& v) {
    v.fixed("type", type, 0, 1);
    v.varint("number", number);
    v.signedVarint("time", time);
    v.varint("duration", duration);
    std::uint32_t count = static_cast<std::uint32_t>(references.size());
    const std::uint64_t wanted = type == PacketType::kIntra ? 0 : 1;
    v.varint("reference count", count, wanted, wanted);
    if (v.ok()) references.resize(count);
    for (auto& back : references) v.varint("reference", back, 1, number);
    v.f64("isovalue", isovalue);
    v.varint("step", step, 1, kCell);
    v.varint("tangential step", tangential_step, 1, kCell);
    v.varint("vertices", vertices);
    v.varint("faces", faces);
    v.fixed("surface hash", surface_hash);
    v.blob("configuration", configuration, 4096);
    v.require((type == PacketType::kIntra) == !configuration.empty(),
              "an I packet carries the configuration record, others do not");
    count = static_cast<std::uint32_t>(sections.size());
    v.varint("section count", count, 0, kMaxSections);
    if (v.ok()) sections.resize(count);
    for (auto& s : sections) {
      v.varint("section kind", s.kind);
      v.varint("section level", s.level, 0, 255);
      v.varint("section bytes", s.bytes, 0, kMaxPacketBytes);
    }
    v.fixed("payload CRC", payload_crc);
  }
};

/// Reads and checks the head of a packet; `payload_offset` gets where its first section starts. The payload
/// may be cut short (see DecodeOptions::allow_prefix). Safe for untrusted input.
Result<PacketHeader> readPacketHeader(ByteSpan packet, std::size_t* payload_offset = nullptr);

}  // namespace isoreel
