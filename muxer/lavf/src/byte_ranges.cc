// SPDX-License-Identifier: BSD-3-Clause
#include "byte_ranges.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <optional>
#include <string_view>

namespace isoreel::lavf {
namespace {

std::string lower(std::string_view text) {
  std::string result(text);
  std::transform(result.begin(), result.end(), result.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return result;
}

std::string boundaryOf(const std::string& type) {
  if (!lower(type).starts_with("multipart/byteranges")) return "";
  const std::size_t at = lower(type).find("boundary=");
  if (at == std::string::npos) return "";
  std::string boundary = type.substr(at + 9);
  if (boundary.starts_with('"')) return boundary.substr(1, boundary.find('"', 1) - 1);
  return boundary.substr(0, boundary.find_first_of("; \t"));
}

/// The number that `text` starts with, which is cut off it.
std::optional<std::uint64_t> number(std::string_view& text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc()) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return value;
}

bool skip(std::string_view& text, std::string_view start) {
  if (!text.starts_with(start)) return false;
  text.remove_prefix(start.size());
  return true;
}

/// "bytes 0-15/1000", and the bytes that stand at the start of `rest`.
std::optional<FilePart> partOf(std::string_view range, std::string_view rest) {
  if (!skip(range, "bytes ")) return std::nullopt;
  const auto first = number(range);
  if (!first || !skip(range, "-")) return std::nullopt;
  const auto last = number(range);
  if (!last || !skip(range, "/")) return std::nullopt;
  const auto whole = number(range);
  if (!whole || *last < *first || *last >= *whole || *last - *first >= rest.size()) return std::nullopt;
  const std::string_view bytes = rest.substr(0, static_cast<std::size_t>(*last - *first + 1));
  return FilePart{*first, *whole, Bytes(bytes.begin(), bytes.end())};
}

}  // namespace

std::vector<FilePart> parseByteRanges(const std::string& type, ByteSpan body) {
  const std::string boundary = "--" + boundaryOf(type);
  std::string_view rest(reinterpret_cast<const char*>(body.data()), body.size());
  std::vector<FilePart> parts;
  for (;;) {
    const std::size_t at = rest.find(boundary);
    if (boundary.size() == 2 || at == std::string_view::npos) return {};
    rest.remove_prefix(at + boundary.size());
    if (rest.starts_with("--")) return parts;
    const std::size_t head = rest.find("\r\n\r\n");
    if (head == std::string_view::npos) return {};
    const std::string fields = lower(rest.substr(0, head));
    constexpr std::string_view kField = "\r\ncontent-range:";
    const std::size_t field = fields.find(kField);
    if (field == std::string::npos) return {};
    std::string_view range = std::string_view(fields).substr(field + kField.size());
    while (skip(range, " ")) {
    }
    rest.remove_prefix(head + 4);
    std::optional<FilePart> part = partOf(range, rest);
    if (!part || (!parts.empty() && part->file_bytes != parts.front().file_bytes)) return {};
    rest.remove_prefix(part->bytes.size());
    parts.push_back(*std::move(part));
  }
}

}  // namespace isoreel::lavf
