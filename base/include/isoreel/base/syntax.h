// SPDX-License-Identifier: BSD-3-Clause
// Syntax is written once. A header of the format is a struct with
//
//   static constexpr const char* kName = "frame header";   // for messages
//   static constexpr const char* kSpec = "container 4";    // the section of spec/ that defines it
//   template <class Visitor> void fields(Visitor& v);      // every field once: name, value, range
//
// and the visitors below read, write and print it. A visitor keeps the first error and does nothing after it,
// so fields() needs no checks of its own except around loops (`v.ok()`). The idea is libjxl's
// (lib/jxl/fields.h).
#pragma once

#include <isoreel/base/bytes.h>
#include <isoreel/base/status.h>

#include <array>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace isoreel {
namespace syntax {

template <class T>
constexpr std::uint64_t toUnsigned(T value) {
  if constexpr (std::is_enum_v<T>) {
    return static_cast<std::uint64_t>(static_cast<std::underlying_type_t<T>>(value));
  } else {
    return static_cast<std::uint64_t>(value);
  }
}

template <class T>
constexpr std::uint64_t kMax = [] {
  if constexpr (std::is_enum_v<T>) {
    return std::uint64_t{std::numeric_limits<std::underlying_type_t<T>>::max()};
  } else {
    return std::uint64_t{std::numeric_limits<T>::max()};
  }
}();

/// What reader and writer share: where they are, and the first rule that was broken.
class Checker {
 public:
  Checker(const char* name, const char* spec) : name_(name), spec_(spec) {}
  bool ok() const { return status_.ok(); }
  const Status& status() const { return status_; }
  /// For rules between fields: keeps `message` as the error when `holds` is false.
  void require(bool holds, const char* message) {
    if (ok() && !holds) fail(ErrorCode::kBadData, message);
  }

 protected:
  void fail(ErrorCode code, const std::string& message) {
    status_ = Status(code, std::string(name_) + ": " + message + " (spec " + spec_ + ")");
  }
  bool inRange(const char* field, std::uint64_t value, std::uint64_t min, std::uint64_t max) {
    if (value >= min && value <= max) return true;
    fail(ErrorCode::kBadData,
         std::string(field) + " " + std::to_string(value) +
             (value < min ? " is below " + std::to_string(min) : " is above " + std::to_string(max)));
    return false;
  }

 private:
  const char* name_;
  const char* spec_;
  Status status_;
};

inline std::uint64_t zigzag(std::int64_t value) {
  return (static_cast<std::uint64_t>(value) << 1) ^ static_cast<std::uint64_t>(value >> 63);
}
inline std::int64_t unzigzag(std::uint64_t value) {
  return static_cast<std::int64_t>(value >> 1) ^ -static_cast<std::int64_t>(value & 1);
}

/// Fills a struct from bytes. Values keep their defaults after an error.
class Reader : public Checker {
 public:
  static constexpr bool kReads = true;
  Reader(ByteReader& in, const char* name, const char* spec) : Checker(name, spec), in_(in) {}

  template <class T>
  void fixed(const char* field, T& value, std::uint64_t min = 0, std::uint64_t max = kMax<T>) {
    if (!ok()) return;
    using Raw =
        typename std::conditional_t<std::is_enum_v<T>, std::underlying_type<T>, std::type_identity<T>>::type;
    store(field, in_.fixed<Raw>(), value, min, max);
  }
  template <class T>
  void varint(const char* field, T& value, std::uint64_t min = 0, std::uint64_t max = kMax<T>) {
    if (!ok()) return;
    store(field, in_.varint(), value, min, max);
  }
  void signedVarint(const char* field, std::int64_t& value) {
    if (!ok()) return;
    const std::uint64_t raw = in_.varint();
    if (good(field)) value = unzigzag(raw);
  }
  /// IEEE 754 binary64; not-a-number and infinities are refused unless `any`.
  void f64(const char* field, double& value, bool any = false) {
    if (!ok()) return;
    const double raw = std::bit_cast<double>(in_.fixed<std::uint64_t>());
    if (good(field) && finite(field, raw, any)) value = raw;
  }
  void f32(const char* field, float& value, bool any = false) {
    if (!ok()) return;
    const float raw = std::bit_cast<float>(in_.fixed<std::uint32_t>());
    if (good(field) && finite(field, static_cast<double>(raw), any)) value = raw;
  }
  template <std::size_t N>
  void array(const char* field, std::array<std::uint8_t, N>& value) {
    if (!ok()) return;
    const ByteSpan raw = in_.bytes(N);
    if (good(field)) std::copy(raw.begin(), raw.end(), value.begin());
  }
  /// A varint length, at most `max`, and that many bytes.
  void blob(const char* field, Bytes& value, std::uint64_t max) {
    if (!ok()) return;
    const std::uint64_t size = in_.varint();
    if (!good(field) || !inRange(field, size, 0, max)) return;
    const ByteSpan raw = in_.bytes(static_cast<std::size_t>(size));
    if (good(field)) value.assign(raw.begin(), raw.end());
  }
  void text(const char* field, std::string& value, std::uint64_t max) {
    Bytes raw;
    blob(field, raw, max);
    if (ok()) value.assign(raw.begin(), raw.end());
  }

 private:
  bool good(const char* field) {
    if (in_.truncated()) fail(ErrorCode::kTruncated, std::string("ends inside ") + field);
    if (in_.malformed() && ok()) fail(ErrorCode::kBadData, std::string(field) + " is not a canonical varint");
    return ok();
  }
  bool finite(const char* field, double value, bool any) {
    if (any || std::isfinite(value)) return true;
    fail(ErrorCode::kBadData, std::string(field) + " is not finite");
    return false;
  }
  template <class T>
  void store(const char* field, std::uint64_t raw, T& value, std::uint64_t min, std::uint64_t max) {
    if (good(field) && inRange(field, raw, min, max)) value = static_cast<T>(raw);
  }
  ByteReader& in_;
};

/// Appends a struct's bytes; refuses values that a reader would refuse.
class Writer : public Checker {
 public:
  static constexpr bool kReads = false;
  Writer(ByteWriter& out, const char* name, const char* spec) : Checker(name, spec), out_(out) {}

  template <class T>
  void fixed(const char* field, T& value, std::uint64_t min = 0, std::uint64_t max = kMax<T>) {
    using Raw =
        typename std::conditional_t<std::is_enum_v<T>, std::underlying_type<T>, std::type_identity<T>>::type;
    if (ok() && inRange(field, toUnsigned(value), min, max)) out_.fixed(static_cast<Raw>(value));
  }
  template <class T>
  void varint(const char* field, T& value, std::uint64_t min = 0, std::uint64_t max = kMax<T>) {
    if (ok() && inRange(field, toUnsigned(value), min, max)) out_.varint(toUnsigned(value));
  }
  void signedVarint(const char*, std::int64_t& value) {
    if (ok()) out_.varint(zigzag(value));
  }
  void f64(const char* field, double& value, bool any = false) {
    if (ok() && finite(field, value, any)) out_.fixed(std::bit_cast<std::uint64_t>(value));
  }
  void f32(const char* field, float& value, bool any = false) {
    if (ok() && finite(field, static_cast<double>(value), any))
      out_.fixed(std::bit_cast<std::uint32_t>(value));
  }
  template <std::size_t N>
  void array(const char*, std::array<std::uint8_t, N>& value) {
    if (ok()) out_.bytes(value);
  }
  void blob(const char* field, Bytes& value, std::uint64_t max) {
    if (!ok() || !inRange(field, value.size(), 0, max)) return;
    out_.varint(value.size());
    out_.bytes(value);
  }
  void text(const char* field, std::string& value, std::uint64_t max) {
    Bytes raw(value.begin(), value.end());
    blob(field, raw, max);
  }

 private:
  bool finite(const char* field, double value, bool any) {
    if (any || std::isfinite(value)) return true;
    fail(ErrorCode::kBadData, std::string(field) + " is not finite");
    return false;
  }
  ByteWriter& out_;
};

/// Calls `sink(field, value)` for each field, value being std::uint64_t, std::int64_t, double, Bytes or
/// std::string.
template <class Sink>
class Dumper {
 public:
  static constexpr bool kReads = false;
  explicit Dumper(Sink sink) : sink_(std::move(sink)) {}
  bool ok() const { return true; }
  void require(bool, const char*) {}
  template <class T>
  void fixed(const char* field, T& value, std::uint64_t = 0, std::uint64_t = 0) {
    sink_(field, toUnsigned(value));
  }
  template <class T>
  void varint(const char* field, T& value, std::uint64_t = 0, std::uint64_t = 0) {
    sink_(field, toUnsigned(value));
  }
  void signedVarint(const char* field, std::int64_t& value) { sink_(field, value); }
  void f64(const char* field, double& value, bool = false) { sink_(field, value); }
  void f32(const char* field, float& value, bool = false) { sink_(field, static_cast<double>(value)); }
  template <std::size_t N>
  void array(const char* field, std::array<std::uint8_t, N>& value) {
    sink_(field, Bytes(value.begin(), value.end()));
  }
  void blob(const char* field, Bytes& value, std::uint64_t) { sink_(field, value); }
  void text(const char* field, std::string& value, std::uint64_t) { sink_(field, value); }

 private:
  Sink sink_;
};

}  // namespace syntax

/// Reads a struct from the front of `in`. Bytes after its last field stay in `in`.
template <class Struct>
Status readSyntax(ByteReader& in, Struct& value) {
  syntax::Reader visitor(in, Struct::kName, Struct::kSpec);
  value.fields(visitor);
  return visitor.status();
}

/// Appends a struct to `out`; fails, having written part of it, when a value is out of its range.
template <class Struct>
Status writeSyntax(Bytes& out, const Struct& value) {
  ByteWriter writer(out);
  syntax::Writer visitor(writer, Struct::kName, Struct::kSpec);
  Struct copy = value;
  copy.fields(visitor);
  return visitor.status();
}

/// Reads a struct that stands behind a varint with its length, and skips bytes after the fields it knows: the
/// extension rule of the format (spec notation 3.2).
template <class Struct>
Status readSized(ByteReader& in, Struct& value) {
  const std::uint64_t size = in.varint();
  if (in.malformed()) {
    return {ErrorCode::kBadData, std::string(Struct::kName) +
                                     ": its length is not a canonical varint (spec " + Struct::kSpec + ")"};
  }
  if (in.truncated() || size > in.left()) {
    return {ErrorCode::kTruncated,
            std::string(Struct::kName) + ": its length is above what is left (spec " + Struct::kSpec + ")"};
  }
  ByteReader body(in.bytes(static_cast<std::size_t>(size)));
  return readSyntax(body, value);
}

/// Writes a struct behind a varint with its length.
template <class Struct>
Status writeSized(Bytes& out, const Struct& value) {
  Bytes body;
  ISOREEL_TRY(writeSyntax(body, value));
  ByteWriter writer(out);
  writer.varint(body.size());
  writer.bytes(body);
  return {};
}

/// Calls `sink(field, value)` for each field of a struct, in the order of its syntax.
template <class Struct, class Sink>
void dumpSyntax(const Struct& value, Sink sink) {
  syntax::Dumper<Sink> visitor(std::move(sink));
  Struct copy = value;
  copy.fields(visitor);
}

}  // namespace isoreel
