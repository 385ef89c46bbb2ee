// SPDX-License-Identifier: BSD-3-Clause
#include "src/signature.h"

#include <xxhash.h>

#include <algorithm>
#include <initializer_list>
#include <memory>

namespace isoreel::container {
namespace {

bool startsWith(ByteSpan bytes, std::initializer_list<std::uint8_t> pattern) {
  return bytes.size() >= pattern.size() && std::equal(pattern.begin(), pattern.end(), bytes.begin());
}

// The magic is chosen so that the usual accidents of text-mode transfer show (the idea is PNG's); nullptr
// when none did.
const char* textDamage(ByteSpan bytes) {
  if (startsWith(bytes, {0x89, 'I', 'S', 'R', 0x0A})) return "CR LF was turned into LF";
  if (startsWith(bytes, {0x89, 'I', 'S', 'R', 0x0D, 0x0D, 0x0A}) ||
      startsWith(bytes, {0x89, 'I', 'S', 'R', 0x0D, 0x0A, 0x1A, 0x0D, 0x0A})) {
    return "LF was turned into CR LF";
  }
  if (startsWith(bytes, {0x89, 'I', 'S', 'R', 0x0D, 0x0D, 0x1A}) ||
      startsWith(bytes, {0x89, 'I', 'S', 'R', 0x0D, 0x1A}))
    return "LF was turned into CR";
  if (startsWith(bytes, {0x09, 'I', 'S', 'R'})) return "the high bit of each byte was stripped";
  if (startsWith(bytes, {0xC2, 0x89, 'I', 'S', 'R'}) ||
      startsWith(bytes, {0xEF, 0xBF, 0xBD, 'I', 'S', 'R'})) {
    return "the bytes were converted to UTF-8";
  }
  return nullptr;
}

}  // namespace

Result<Bytes> makeSignature(const Uuid& uuid) {
  Signature signature;
  signature.uuid = uuid;
  Bytes bytes;
  ISOREEL_TRY(writeSyntax(bytes, signature));
  bytes.resize(Signature::kBytes - 4);
  ByteWriter(bytes).fixed(crc32c(bytes));
  return bytes;
}

Uuid makeUuid(ByteSpan track_record, ByteSpan first_frame) {
  const std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state(XXH3_createState(), XXH3_freeState);
  if (state == nullptr) throw std::bad_alloc();
  XXH3_128bits_reset(state.get());
  XXH3_128bits_update(state.get(), track_record.data(), track_record.size());
  if (!first_frame.empty()) XXH3_128bits_update(state.get(), first_frame.data(), first_frame.size());
  XXH128_canonical_t digest;
  XXH128_canonicalFromHash(&digest, XXH3_128bits_digest(state.get()));
  Uuid uuid;
  std::copy(std::begin(digest.digest), std::end(digest.digest), uuid.begin());
  uuid[6] = static_cast<std::uint8_t>((uuid[6] & 0x0F) | 0x80);
  uuid[8] = static_cast<std::uint8_t>((uuid[8] & 0x3F) | 0x80);
  return uuid;
}

Result<SignatureFacts> readSignature(ByteSpan bytes) {
  if (bytes.empty()) return {ErrorCode::kTruncated, "the file is empty (spec container 2.2)"};
  const std::size_t magic_bytes = std::min(bytes.size(), Signature::kMagic.size());
  if (!std::equal(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(magic_bytes),
                  Signature::kMagic.begin())) {
    if (const char* damage = textDamage(bytes)) {
      return {ErrorCode::kBadData, std::string("an .isr file damaged by a transfer in text mode: ") + damage +
                                       " (spec container 2.2)"};
    }
    return {ErrorCode::kBadData,
            "not an .isr file: the first 8 bytes are not the magic (spec container 2.2)"};
  }
  if (bytes.size() < Signature::kBytes) {
    return {ErrorCode::kTruncated,
            "ends at byte " + std::to_string(bytes.size()) + ", inside the signature (spec container 2.2)"};
  }
  SignatureFacts facts;
  ByteReader in(bytes);
  ISOREEL_TRY(readSyntax(in, facts.signature));
  facts.crc_good = facts.signature.crc == crc32c(bytes.first(Signature::kBytes - 4));
  if (facts.crc_good) ISOREEL_TRY(checkVersion(facts.signature.version));
  return facts;
}

Status checkVersion(std::uint8_t version) {
  if (version == kVersion) return {};
  if (version == 0) return {ErrorCode::kBadData, "version 0 is not defined (spec container 2.2)"};
  return {ErrorCode::kUnsupported, "version " + std::to_string(version) +
                                       " of the .isr format; this reader knows " + std::to_string(kVersion) +
                                       " (spec container 2.2)"};
}

}  // namespace isoreel::container
