// SPDX-License-Identifier: BSD-3-Clause
// Binary adaptive range coder: put and get side by side (spec codec 6). The idea of coding both ways over the
// same states is that of FFV1 (RFC 9043, 3.8.1); the 64-bit window, refilled 32 bits at a time, keeps the
// decoder's only unpredictable branch the coded bit itself.
#pragma once

#include <isoreel/base/bytes.h>

#include <array>
#include <cstdint>

namespace isoreel {

/// An adaptive probability of a 1: the mean of what was seen, then an exponential average over about the last
/// 160.
struct BitModel {
  std::uint16_t one = 1u << 15;  // probability of a 1, in 1/65536
  std::uint16_t seen = 0;

  static constexpr std::uint16_t kLimit = 160;
  static constexpr std::int32_t kFloor = 256;  // neither bit becomes less probable than this: costs 0.3 % of
                                               // the bytes, bounds what few bytes can ask for

  // Rounded up, so that a long run reaches the floor.
  void update(bool bit) {
    const std::int32_t p = one;
    const std::int32_t rate = kRates[seen];
    one = static_cast<std::uint16_t>(bit ? p + (((65536 - kFloor - p) * rate + 0xFFFF) >> 16)
                                         : p - (((p - kFloor) * rate + 0xFFFF) >> 16));
    seen = static_cast<std::uint16_t>(seen + (seen < kLimit));
  }
  /// The same without a branch on the bit, for bits that nobody guesses.
  void updateEither(bool bit) {
    const std::int32_t all = 0 - std::int32_t{bit};
    const std::int32_t way = kFloor + (all & (65536 - 2 * kFloor)) - one;
    one = static_cast<std::uint16_t>(one + ((way * kRates[seen] + (all & 0xFFFF)) >> 16));
    seen = static_cast<std::uint16_t>(seen + (seen < kLimit));
  }

 private:
  // The n-th update moves 2 / (2 n + 3) of the way.
  static constexpr auto kRates = [] {
    std::array<std::int32_t, kLimit + 1> rates{};
    for (std::int32_t n = 0; n <= kLimit; ++n) rates[static_cast<std::size_t>(n)] = 2 * 32767 / (2 * n + 3);
    return rates;
  }();
};

/// The coder that writes. code() takes the bit to write and returns it, so that one templated function serves
/// both ways.
class RangePut {
 public:
  static constexpr bool kPuts = true;
  explicit RangePut(Bytes& out) : out_(out), start_(out.size()) {}

  bool code(BitModel& model, bool bit) {
    split(bit, (range_ >> 16) * model.one);
    model.update(bit);
    return bit;
  }
  /// A bit that is 1 with probability `one` in 1/65536, 1 to 65535; `likely`: whether that is at least half.
  bool codeAt(std::uint32_t one, bool /*likely*/, bool bit) {
    split(bit, (range_ >> 16) * one);
    return bit;
  }
  /// `count` equiprobable bits, the highest first.
  std::uint32_t raw(int count, std::uint32_t value) {
    for (int i = count; i-- > 0;) split((value >> i) & 1, range_ >> 1);
    return value;
  }
  /// Ends the stream in as few bytes as tell it apart; a reader takes zeros behind its end.
  void finish() {
    // The value of the final interval with the most zero bits at its end.
    std::uint64_t value = low_;
    bool carry = false;
    for (int zeros = 63; zeros > 0; --zeros) {
      const std::uint64_t mask = (std::uint64_t{1} << zeros) - 1;
      const std::uint64_t up = (0 - low_) & mask;  // what rounds low_ up
      if (up < range_) {
        value = low_ + up;
        carry = value < low_;
        break;
      }
    }
    if (carry) propagate();
    int kept = 8;
    while (kept > 0 && ((value >> (64 - 8 * kept)) & 0xFF) == 0) --kept;
    for (int i = 0; i < kept; ++i) out_.push_back(static_cast<std::uint8_t>(value >> (56 - 8 * i)));
  }

 private:
  void split(bool bit, std::uint64_t bound) {
    if (bit) {
      range_ = bound;
    } else {
      low_ += bound;
      if (low_ < bound) propagate();
      range_ -= bound;
    }
    if (range_ < (std::uint64_t{1} << 32)) {
      for (int shift = 56; shift >= 32; shift -= 8) out_.push_back(static_cast<std::uint8_t>(low_ >> shift));
      low_ <<= 32;
      range_ <<= 32;
    }
  }
  void propagate() {
    for (std::size_t i = out_.size(); i > start_;) {
      if (++out_[--i] != 0) break;
    }
  }

  Bytes& out_;
  std::size_t start_;
  std::uint64_t low_ = 0;
  std::uint64_t range_ = ~std::uint64_t{0};
};

/// The coder that reads. Bytes behind the end are zeros; overrun() tells when more were taken than any writer
/// leaves out.
class RangeGet {
 public:
  static constexpr bool kPuts = false;
  explicit RangeGet(ByteSpan in) : in_(in) {
    code_ = static_cast<std::uint64_t>(next()) << 32;
    code_ |= next();
  }

  bool code(BitModel& model, bool /*unused*/) {
    const bool bit = split((range_ >> 16) * model.one);
    model.update(bit);
    return bit;
  }
  bool codeAt(std::uint32_t one, bool likely, bool /*unused*/) {
    // No branch on what the bit is, which nobody guesses, but on whether it is the likely one.
    const std::uint64_t bound = (range_ >> 16) * one;
    const std::uint64_t if_one = 0 - std::uint64_t{likely};
    const bool below = code_ < bound;
    if (below == likely) [[likely]] {
      range_ = bound + ((range_ - 2 * bound) & ~if_one);
      code_ -= bound & ~if_one;
    } else {
      range_ = bound + ((range_ - 2 * bound) & if_one);
      code_ -= bound & if_one;
      likely = !likely;
    }
    refill();
    return likely;
  }
  std::uint32_t raw(int count, std::uint32_t /*unused*/) {
    std::uint32_t value = 0;
    for (int i = 0; i < count; ++i) value = value << 1 | std::uint32_t{split(range_ >> 1)};
    return value;
  }
  /// More was read than a stream of this length can hold: it is damaged.
  bool overrun() const { return position_ > in_.size() + 8; }
  /// Everything was read, as it must be at the end.
  bool finished() const { return position_ >= in_.size() && !overrun(); }

 private:
  bool split(std::uint64_t bound) {
    const bool bit = code_ < bound;
    if (bit) {
      range_ = bound;
    } else {
      code_ -= bound;
      range_ -= bound;
    }
    refill();
    return bit;
  }
  void refill() {
    if (range_ < (std::uint64_t{1} << 32)) [[unlikely]] {
      code_ = code_ << 32 | next();
      range_ <<= 32;
    }
  }
  std::uint32_t next() {
    std::uint32_t value = 0;
    if (position_ + 4 <= in_.size()) {
      const std::uint8_t* p = in_.data() + position_;
      value = std::uint32_t{p[0]} << 24 | std::uint32_t{p[1]} << 16 | std::uint32_t{p[2]} << 8 |
              std::uint32_t{p[3]};
    } else {
      for (std::size_t i = 0; i < 4; ++i) {
        value = value << 8 | (position_ + i < in_.size() ? std::uint32_t{in_[position_ + i]} : 0u);
      }
    }
    position_ += 4;
    return value;
  }

  ByteSpan in_;
  std::size_t position_ = 0;
  std::uint64_t code_ = 0;
  std::uint64_t range_ = ~std::uint64_t{0};
};

}  // namespace isoreel
