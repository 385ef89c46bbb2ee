// SPDX-License-Identifier: BSD-3-Clause
#include "src/vtk_data.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>

#include "src/byte_stream.h"

namespace isoreel::io {
namespace {

constexpr std::string_view kSpaces = " \t\r\n";

constexpr std::array<std::int8_t, 256> kBase64 = [] {
  std::array<std::int8_t, 256> values{};
  values.fill(-1);
  constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (std::size_t i = 0; i < digits.size(); ++i)
    values[static_cast<unsigned char>(digits[i])] = static_cast<std::int8_t>(i);
  return values;
}();

// Bytes in order from raw ones or base64.
class Source {
 public:
  Source(ByteSpan data, bool base64) : data_(data), base64_(base64) {}

  // No more than so many bytes are left.
  std::uint64_t left() const { return base64_ ? (data_.size() - at_) / 4 * 3 + 3 : data_.size() - at_; }

  Status read(std::span<std::uint8_t> out) {
    if (!base64_) {
      if (out.size() > data_.size() - at_) return tooShort();
      std::copy_n(data_.begin() + static_cast<std::ptrdiff_t>(at_), out.size(), out.begin());
      at_ += out.size();
      return {};
    }
    for (std::uint8_t& byte : out) {
      while (bits_ < 8) ISOREEL_TRY(nextDigit());
      bits_ -= 8;
      byte = static_cast<std::uint8_t>(pending_ >> bits_);
    }
    return {};
  }

 private:
  static Status tooShort() { return {ErrorCode::kTruncated, "the data end early"}; }

  Status nextDigit() {
    for (; at_ < data_.size(); ++at_) {
      const char c = static_cast<char>(data_[at_]);
      if (kSpaces.find(c) != std::string_view::npos) continue;
      if (c == '=') {  // ends a stream; the header of compressed blocks is one, the blocks are another
        bits_ = 0;
        continue;
      }
      const std::int8_t digit = kBase64[data_[at_]];
      if (c == '<') break;
      if (digit < 0) return {ErrorCode::kBadData, fmt::format("byte {:#04x} is not base64", data_[at_])};
      pending_ = pending_ << 6 | static_cast<unsigned>(digit);
      bits_ += 6;
      ++at_;
      return {};
    }
    return tooShort();
  }

  ByteSpan data_;
  bool base64_;
  std::size_t at_ = 0;
  std::uint32_t pending_ = 0;  // digits whose last bits_ bits are not given out yet
  int bits_ = 0;
};

Result<std::uint64_t> readCount(Source& source, const VtkCoding& coding) {
  std::array<std::uint8_t, 8> bytes{};
  const std::size_t size = coding.wideHeaders ? 8 : 4;
  ISOREEL_TRY(source.read(std::span(bytes).first(size)));
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < size; ++i)
    value = value << 8 | bytes[coding.order == std::endian::big ? i : size - 1 - i];
  return value;
}

Status expectBytes(std::uint64_t found, std::uint64_t expected) {
  if (found == expected) return {};
  return {ErrorCode::kBadData, fmt::format("holds {} bytes, but its extent needs {}", found, expected)};
}

// The blocks' sizes before and after, then the blocks.
Result<std::vector<std::uint8_t>> readBlocks(Source& source, const VtkCoding& coding,
                                             std::uint64_t expected) {
  std::array<std::uint64_t, 3> head{};  // blocks, bytes of a block, bytes of the last one if it is shorter
  for (std::uint64_t& value : head) {
    ISOREEL_ASSIGN(value, readCount(source, coding));
  }
  const auto [count, blockBytes, lastBytes] = head;
  if (count > source.left() / (coding.wideHeaders ? 8 : 4))
    return {ErrorCode::kTruncated, fmt::format("{} blocks cannot lie in the bytes that are left", count)};
  const std::uint64_t whole = lastBytes != 0 && count > 0 ? count - 1 : count;
  std::uint64_t total = 0;
  if (__builtin_mul_overflow(whole, blockBytes, &total) || __builtin_add_overflow(total, lastBytes, &total))
    return {ErrorCode::kBadData, "the sizes of the blocks are too large"};
  ISOREEL_TRY(expectBytes(total, expected));
  std::vector<std::uint64_t> packed(count);
  std::uint64_t sum = 0;
  for (std::uint64_t& bytes : packed) {
    ISOREEL_ASSIGN(bytes, readCount(source, coding));
    if (bytes > source.left() || (sum += bytes) > source.left())
      return {ErrorCode::kTruncated, "the blocks are longer than the bytes that are left"};
  }
  if (expected / kMaxInflation > sum) return {ErrorCode::kTruncated, "the blocks cannot hold the samples"};
  std::vector<std::uint8_t> result(expected), block;
  std::size_t at = 0;
  for (std::uint64_t i = 0; i < count; ++i) {
    block.resize(packed[i]);
    ISOREEL_TRY(source.read(block));
    const std::uint64_t size = i < whole ? blockBytes : lastBytes;
    uLongf inflated = size;
    const int code = uncompress(result.data() + at, &inflated, block.data(), block.size());
    if (code != Z_OK || inflated != size) return {ErrorCode::kBadData, fmt::format("block {} is broken", i)};
    at += size;
  }
  return result;
}

}  // namespace

Result<std::vector<std::uint8_t>> readVtkBinary(ByteSpan data, bool base64, const VtkCoding& coding,
                                                std::uint64_t expected) {
  Source source(data, base64);
  if (coding.zlib) return readBlocks(source, coding, expected);
  ISOREEL_ASSIGN(const std::uint64_t bytes, readCount(source, coding));
  ISOREEL_TRY(expectBytes(bytes, expected));
  if (bytes > source.left()) {
    return {ErrorCode::kTruncated, fmt::format("expected {} bytes, found at most {}", bytes, source.left())};
  }
  std::vector<std::uint8_t> result(bytes);
  ISOREEL_TRY(source.read(result));
  return result;
}

Status readVtkText(std::string_view text, std::span<float> out) {
  std::size_t at = 0;
  for (std::size_t i = 0; i <= out.size(); ++i) {
    at = std::min(text.find_first_not_of(kSpaces, at), text.size());
    if (at == text.size()) {
      if (i == out.size()) return {};
      return {ErrorCode::kTruncated, fmt::format("holds {} numbers, but its extent needs {}", i, out.size())};
    }
    if (i == out.size()) break;
    const std::size_t end = std::min(text.find_first_of(kSpaces, at), text.size());
    double value = 0;
    const auto [stop, error] = std::from_chars(text.data() + at, text.data() + end, value);
    if (stop != text.data() + end || error != std::errc()) {
      return {ErrorCode::kBadData,
              fmt::format("'{}' is no number", text.substr(at, std::min<std::size_t>(end - at, 40)))};
    }
    out[i] = static_cast<float>(value);
    at = end;
  }
  return {ErrorCode::kBadData, fmt::format("holds more than the {} numbers of its extent", out.size())};
}

}  // namespace isoreel::io
