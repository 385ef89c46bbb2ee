// SPDX-License-Identifier: BSD-3-Clause
// Bounded little-endian bytes in and out, and the CRC-32C that guards them (spec notation 2.2 and
// notation 6).
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

namespace isoreel {

using Bytes = std::vector<std::uint8_t>;
using ByteSpan = std::span<const std::uint8_t>;

/// CRC-32C (Castagnoli, reflected, initial and final value ~0, as in RFC 3720) of `bytes`.
/// To go on over a second run of bytes pass the first's result as `previous`.
std::uint32_t crc32c(ByteSpan bytes, std::uint32_t previous = 0);

/// Appends little-endian values to a byte vector that the caller owns.
class ByteWriter {
 public:
  explicit ByteWriter(Bytes& out) : out_(out) {}

  template <class Unsigned>
  void fixed(Unsigned value) {
    for (std::size_t i = 0; i < sizeof value; ++i)
      out_.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
  }
  /// LEB128: seven bits a byte, low first, the high bit says that more follow. At most 10 bytes.
  void varint(std::uint64_t value) {
    for (; value >= 0x80; value >>= 7) out_.push_back(static_cast<std::uint8_t>(value | 0x80));
    out_.push_back(static_cast<std::uint8_t>(value));
  }
  void bytes(ByteSpan data) { out_.insert(out_.end(), data.begin(), data.end()); }
  std::size_t position() const { return out_.size(); }

 private:
  Bytes& out_;
};

/// Reads little-endian values from bytes that outlive it. Reading past the end returns zero and sets
/// `truncated()`; a varint that is not canonical (longer than needed, or above 64 bits) sets `malformed()`.
class ByteReader {
 public:
  explicit ByteReader(ByteSpan data) : data_(data) {}

  template <class Unsigned>
  Unsigned fixed() {
    Unsigned value = 0;
    if (!has(sizeof value)) return 0;
    for (std::size_t i = 0; i < sizeof value; ++i) {
      value = static_cast<Unsigned>(
          value | static_cast<Unsigned>(static_cast<Unsigned>(data_[position_ + i]) << (8 * i)));
    }
    position_ += sizeof value;
    return value;
  }
  std::uint64_t varint();
  /// The next `count` bytes, or an empty span (and truncated()) when there are fewer.
  ByteSpan bytes(std::size_t count) {
    if (!has(count)) return {};
    const ByteSpan result = data_.subspan(position_, count);
    position_ += count;
    return result;
  }
  std::size_t position() const { return position_; }
  std::size_t left() const { return data_.size() - position_; }
  bool truncated() const { return truncated_; }
  bool malformed() const { return malformed_; }

 private:
  bool has(std::size_t count) {
    if (count <= left()) return true;
    truncated_ = true;
    position_ = data_.size();
    return false;
  }

  ByteSpan data_;
  std::size_t position_ = 0;
  bool truncated_ = false;
  bool malformed_ = false;
};

}  // namespace isoreel
