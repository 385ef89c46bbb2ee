// SPDX-License-Identifier: BSD-3-Clause
#include "repair.h"

#include "src/chunk.h"
#include "src/compress.h"
#include "syntax/packet.h"

namespace isoreel::fuzz {
namespace {

using container::ChunkHeader;
using container::Footer;

void putCrc(Bytes& bytes, std::size_t position, std::uint32_t crc) {
  for (std::size_t i = 0; i < 4; ++i) bytes[position + i] = static_cast<std::uint8_t>(crc >> (8 * i));
}

bool isZstd(ByteSpan payload) {
  return payload.size() >= 4 && payload[0] == 0x28 && payload[1] == 0xB5 && payload[2] == 0x2F &&
         payload[3] == 0xFD;
}

/// How many bytes TAGS and INDX have grown by, in two's complement.
struct Growth {
  std::uint64_t before_index = 0;
  std::uint64_t index = 0;
};

Bytes movedFooter(ByteSpan payload, const Growth& growth) {
  Footer footer;
  ByteReader in(payload);
  Bytes out;
  if (!readSyntax(in, footer).ok()) return Bytes(payload.begin(), payload.end());
  footer.index_offset += growth.before_index;
  footer.index_length += growth.index;
  footer.file_length += growth.before_index + growth.index;
  if (!writeSyntax(out, footer).ok()) return Bytes(payload.begin(), payload.end());
  return out;
}

/// Copies a file chunk by chunk as far as lengths make sense; `change` gives TAGS and INDX their new payload.
template <class Change>
Bytes rewrite(ByteSpan file, Change change) {
  constexpr std::size_t kSignatureCrc = container::Signature::kBytes - 4;
  Bytes out(file.begin(), file.end());
  if (file.size() < container::Signature::kBytes) return out;
  out.resize(container::Signature::kBytes);
  putCrc(out, kSignatureCrc, crc32c(file.first(kSignatureCrc)));

  Growth growth;
  std::size_t position = container::Signature::kBytes;
  while (file.size() - position >= container::kChunkOverhead) {
    ChunkHeader header;
    ByteReader in(file.subspan(position, ChunkHeader::kBytes));
    if (!readSyntax(in, header).ok()) break;
    if (header.length > file.size() - position - container::kChunkOverhead) break;
    const ByteSpan old =
        file.subspan(position + ChunkHeader::kBytes, static_cast<std::size_t>(header.length));
    Bytes payload(old.begin(), old.end());
    const bool index = header.type == container::kIndexType;
    if (index || header.type == container::kTagsType) {
      payload = change(old);
      (index ? growth.index : growth.before_index) += std::uint64_t{payload.size()} - old.size();
    } else if (header.type == container::kFooterType) {
      payload = movedFooter(old, growth);
    }
    const std::size_t start = out.size();
    header.length = payload.size();
    if (!writeSyntax(out, header).ok()) break;
    putCrc(out, start + ChunkHeader::kBytes - 4,
           crc32c(ByteSpan(out).subspan(start, ChunkHeader::kBytes - 4)));
    ByteWriter writer(out);
    writer.bytes(payload);
    writer.fixed(crc32c(payload));
    position += container::kChunkOverhead + old.size();
  }
  out.insert(out.end(), file.begin() + static_cast<std::ptrdiff_t>(position), file.end());
  return out;
}

}  // namespace

void repairTrailingCrc(Bytes& bytes) {
  if (bytes.size() < 4) return;
  const std::size_t end = bytes.size() - 4;
  putCrc(bytes, end, crc32c(ByteSpan(bytes).first(end)));
}

Bytes repairPacket(ByteSpan packet) {
  const Bytes unchanged(packet.begin(), packet.end());
  PacketHeader header;
  ByteReader in(packet);
  in.fixed<std::uint32_t>();
  if (!readSized(in, header).ok()) return unchanged;
  const ByteSpan payload = packet.subspan(in.position());
  repairTrailingCrc(header.configuration);
  std::uint64_t before = 0;
  for (const Section& section : header.sections) before += section.bytes;
  if (!header.sections.empty()) {
    before -= header.sections.back().bytes;
    if (before <= payload.size())
      header.sections.back().bytes = static_cast<std::uint32_t>(payload.size() - before);
  }
  auto repaired = writePacket(header, payload);
  return repaired.ok() ? *std::move(repaired) : unchanged;
}

Bytes repairFile(ByteSpan file) {
  return rewrite(file, [](ByteSpan payload) {
    auto packed = container::compress(payload);
    return isZstd(payload) || !packed.ok() ? Bytes(payload.begin(), payload.end()) : *std::move(packed);
  });
}

Bytes openedFile(ByteSpan file) {
  return rewrite(file, [](ByteSpan payload) {
    auto content = container::decompress(payload, container::kMaxTags);
    return content.ok() ? *std::move(content) : Bytes(payload.begin(), payload.end());
  });
}

}  // namespace isoreel::fuzz
