// SPDX-License-Identifier: BSD-3-Clause
// Errors as values: nothing in Isoreel throws across its API.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace isoreel {

enum class ErrorCode {
  kInvalidArgument,  // the caller asked for something the rules do not allow
  kBadData,          // bytes that break a rule of the specification
  kTruncated,        // fewer bytes than the structure says it has
  kLimit,            // well formed, but above a limit that protects memory or time
  kUnsupported,      // a version, profile or tool that this build does not know
  kIo,               // the operating system refused
  kNotFound,         // a frame, grid or array that is not there
};

/// What went wrong and where. `message` is one line for a person; it names the place and the rule it breaks.
struct Error {
  ErrorCode code = ErrorCode::kBadData;
  std::string message;
};

/// Success, or an Error. Thread-safe as any value; must not be dropped.
class [[nodiscard]] Status {
 public:
  Status() = default;
  Status(Error error) : error_(std::move(error)) {}
  Status(ErrorCode code, std::string message) : error_(Error{code, std::move(message)}) {}

  bool ok() const { return !error_.has_value(); }
  explicit operator bool() const { return ok(); }
  /// Only when !ok().
  const Error& error() const { return *error_; }
  /// The message, or "" when ok().
  std::string_view message() const { return ok() ? std::string_view() : std::string_view(error_->message); }

  /// The same status with `place` ("packet 17 at byte 48213") in front of its message.
  Status at(std::string_view place) const {
    if (ok()) return *this;
    return {error_->code, std::string(place) + ": " + error_->message};
  }

 private:
  std::optional<Error> error_;
};

/// A value, or the Error that kept it from being made.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : value_(std::move(value)) {}
  Result(Error error) : error_(std::move(error)) {}
  Result(Status status) : error_(status.error()) {}
  Result(ErrorCode code, std::string message) : error_{code, std::move(message)} {}

  bool ok() const { return value_.has_value(); }
  explicit operator bool() const { return ok(); }
  Status status() const { return ok() ? Status() : Status(error_); }
  /// Only when !ok().
  const Error& error() const { return error_; }

  // Only when ok().
  T& operator*() & { return *value_; }
  const T& operator*() const& { return *value_; }
  T&& operator*() && { return *std::move(value_); }
  T* operator->() { return &*value_; }
  const T* operator->() const { return &*value_; }

  Result at(std::string_view place) && {
    if (ok()) return std::move(*this);
    return Result(Status(std::move(error_)).at(place));
  }

 private:
  std::optional<T> value_;
  Error error_;
};

}  // namespace isoreel

/// Returns the error of `expression` (a Status) from the current function.
#define ISOREEL_TRY(expression)                                                  \
  do {                                                                           \
    if (::isoreel::Status isoreel_status = (expression); !isoreel_status.ok()) { \
      return isoreel_status;                                                     \
    }                                                                            \
  } while (false)

#define ISOREEL_CONCAT_(a, b) a##b
#define ISOREEL_CONCAT(a, b) ISOREEL_CONCAT_(a, b)
#define ISOREEL_ASSIGN_(result, declaration, expression) \
  auto result = (expression);                            \
  if (!result.ok()) return result.status();              \
  declaration = *std::move(result)

/// `ISOREEL_ASSIGN(auto x, f());` declares x as the value of the Result f(), or returns its error.
#define ISOREEL_ASSIGN(declaration, expression) \
  ISOREEL_ASSIGN_(ISOREEL_CONCAT(isoreel_result_, __LINE__), declaration, expression)
