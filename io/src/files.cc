// SPDX-License-Identifier: BSD-3-Clause
#include "src/files.h"

#include <fmt/format.h>
#include <glob.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <map>

namespace isoreel::io {
namespace fs = std::filesystem;
namespace {

bool isDigit(char c) { return c >= '0' && c <= '9'; }

// The end of the run of digits that starts at `i`.
std::size_t digitsEnd(std::string_view text, std::size_t i) {
  while (i < text.size() && isDigit(text[i])) ++i;
  return i;
}

Result<FoundFiles> filesOfPattern(const fs::path& folder, const NumberedName& pattern,
                                  const std::string& input) {
  std::map<std::uint64_t, std::string> found;
  std::error_code error;
  fs::directory_iterator entry(folder.empty() ? fs::path(".") : folder, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (const auto number = pattern.numberIn(name)) found[*number] = (folder / name).string();
  }
  if (error)
    return {ErrorCode::kNotFound, fmt::format("{}: cannot list the folder: {}", input, error.message())};
  if (found.empty()) return {ErrorCode::kNotFound, fmt::format("{}: no file of this pattern exists", input)};
  FoundFiles result;
  std::uint64_t next = found.begin()->first;
  for (auto& [number, path] : found) {
    if (number != next) {
      return {ErrorCode::kNotFound, fmt::format("{}: {} is missing (the pattern's files go from {} to {})",
                                                input, (folder / pattern.with(next)).string(),
                                                found.begin()->first, found.rbegin()->first)};
    }
    ++next;
    result.files.push_back(std::move(path));
  }
  return result;
}

Result<FoundFiles> filesOfFolder(const std::string& input) {
  FoundFiles result;
  result.folder = true;
  std::error_code error;
  fs::directory_iterator entry(input, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    std::error_code ignored;
    if (entry->path().filename().string().starts_with('.') || !entry->is_regular_file(ignored)) continue;
    result.files.push_back(entry->path().string());
  }
  if (error) return {ErrorCode::kIo, fmt::format("{}: cannot list the folder: {}", input, error.message())};
  std::sort(result.files.begin(), result.files.end(),
            [](const auto& a, const auto& b) { return naturallyLess(a, b); });
  return result;
}

Result<FoundFiles> filesOfGlob(const std::string& input) {
  glob_t found = {};
  const int code = ::glob(input.c_str(), GLOB_NOSORT, nullptr, &found);
  FoundFiles result;
  for (std::size_t i = 0; code == 0 && i < found.gl_pathc; ++i) result.files.emplace_back(found.gl_pathv[i]);
  ::globfree(&found);
  if (result.files.empty()) return {ErrorCode::kNotFound, input + ": no file of this pattern exists"};
  std::sort(result.files.begin(), result.files.end(),
            [](const auto& a, const auto& b) { return naturallyLess(a, b); });
  return result;
}

}  // namespace

Result<std::uint64_t> regularFileSize(const std::string& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (status.type() == fs::file_type::not_found) return {ErrorCode::kNotFound, path + ": no such file"};
  if (error) return {ErrorCode::kIo, fmt::format("{}: {}", path, error.message())};
  if (status.type() != fs::file_type::regular) return {ErrorCode::kIo, path + ": not a regular file"};
  const std::uintmax_t size = fs::file_size(path, error);
  if (error) return {ErrorCode::kIo, fmt::format("{}: {}", path, error.message())};
  return std::uint64_t{size};
}

std::optional<NumberedName> NumberedName::parse(std::string_view name) {
  const std::size_t percent = name.find('%');
  if (percent == std::string_view::npos || name.find('%', percent + 1) != std::string_view::npos)
    return std::nullopt;
  NumberedName result;
  std::size_t i = percent + 1;
  result.zeros = i < name.size() && name[i] == '0';
  const std::size_t end = digitsEnd(name, i);
  if (end == name.size() || name[end] != 'd') return std::nullopt;
  if (end > i && std::from_chars(name.data() + i, name.data() + end, result.width).ec != std::errc())
    return std::nullopt;
  if (result.width > 20) return std::nullopt;
  result.before = name.substr(0, percent);
  result.after = name.substr(end + 1);
  return result;
}

std::string NumberedName::with(std::uint64_t number) const {
  const std::string digits = std::to_string(number);
  const std::size_t fill = width > digits.size() ? width - digits.size() : 0;
  return before + std::string(fill, zeros ? '0' : ' ') + digits + after;
}

std::optional<std::uint64_t> NumberedName::numberIn(std::string_view name) const {
  if (name.size() <= before.size() + after.size() || !name.starts_with(before) || !name.ends_with(after))
    return std::nullopt;
  std::string_view middle = name.substr(before.size(), name.size() - before.size() - after.size());
  middle.remove_prefix(std::min(middle.find_first_not_of(' '), middle.size()));
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(middle.data(), middle.data() + middle.size(), number);
  if (error != std::errc() || end != middle.data() + middle.size() || with(number) != name)
    return std::nullopt;
  return number;
}

bool naturallyLess(std::string_view a, std::string_view b) {
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (!isDigit(a[i]) || !isDigit(b[j])) {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i, ++j;
      continue;
    }
    const std::size_t aEnd = digitsEnd(a, i), bEnd = digitsEnd(b, j);
    while (i + 1 < aEnd && a[i] == '0') ++i;
    while (j + 1 < bEnd && b[j] == '0') ++j;
    if (aEnd - i != bEnd - j) return aEnd - i < bEnd - j;
    if (const int order = a.substr(i, aEnd - i).compare(b.substr(j, bEnd - j)); order != 0) return order < 0;
    i = aEnd, j = bEnd;
  }
  if (i < a.size() || j < b.size()) return i == a.size();
  return a < b;  // "01" and "1": equal as numbers, but the order must not be left to the folder's
}

Result<FoundFiles> findFiles(const std::string& input) {
  std::error_code error;
  const fs::file_status status = fs::status(input, error);
  if (status.type() == fs::file_type::directory) return filesOfFolder(input);
  if (status.type() == fs::file_type::not_found) {
    const fs::path path(input);
    if (const auto pattern = NumberedName::parse(path.filename().string())) {
      return filesOfPattern(path.parent_path(), *pattern, input);
    }
    if (input.find_first_of("*?[") != std::string::npos) return filesOfGlob(input);
  }
  return FoundFiles{{input}, false};
}

}  // namespace isoreel::io
