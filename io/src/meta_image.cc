// SPDX-License-Identifier: BSD-3-Clause
// MetaImage, with samples in the same file (.mha) or in others (.mhd): a 3-D volume, or a 4-D one whose last
// axis is time. Keys and their meaning are those of MetaIO 5 as ITK and VTK use it.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>

#include "src/files.h"
#include "src/stored_sequence.h"

namespace isoreel::io {
namespace {

// Header lines are short; the list of files behind them is bounded by the file's size.
constexpr std::size_t kMaxLine = 4096;
constexpr std::uint64_t kMaxFiles = 1'000'000;

struct Header {
  std::map<std::string, std::string> fields;  // the first of several values for a key wins
  std::vector<std::string> list;              // lines after ElementDataFile = LIST
  std::uint64_t end = 0;                      // bytes up to the end of ElementDataFile's line

  const std::string* find(std::initializer_list<const char*> names) const {
    for (const char* name : names) {
      if (const auto found = fields.find(name); found != fields.end()) return &found->second;
    }
    return nullptr;
  }
};

std::string trimmed(std::string text) {
  text.erase(0, text.find_first_not_of(" \t\r"));
  text.erase(text.find_last_not_of(" \t\r") + 1);
  return text;
}

std::vector<std::string> words(const std::string& text) {
  std::vector<std::string> result;
  for (std::size_t i = 0; (i = text.find_first_not_of(" \t", i)) != std::string::npos;) {
    const std::size_t end = std::min(text.find_first_of(" \t", i), text.size());
    result.push_back(text.substr(i, end - i));
    i = end;
  }
  return result;
}

template <class Number>
std::optional<Number> number(const std::string& text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

Result<Header> readHeader(const std::string& path) {
  Header header;
  std::ifstream file(path, std::ios::binary);
  std::string line;
  for (std::size_t at = 1; std::getline(file, line); ++at) {
    const std::size_t equals = line.find('=');
    if (trimmed(line).empty()) continue;
    if (equals == std::string::npos || line.size() > kMaxLine)
      return {ErrorCode::kBadData, fmt::format("line {} is not \"Key = Value\"", at)};
    const std::string key = trimmed(line.substr(0, equals));
    header.fields.emplace(key, trimmed(line.substr(equals + 1)));
    if (key != "ElementDataFile") continue;
    if (file.eof()) file.clear();  // the last line need not end
    header.end = static_cast<std::uint64_t>(std::max<std::streamoff>(file.tellg(), 0));
    if (header.fields[key].starts_with("LIST")) {
      while (header.list.size() <= kMaxFiles && std::getline(file, line)) {
        if (!trimmed(line).empty()) header.list.push_back(trimmed(line));
      }
    }
    return header;
  }
  return {ErrorCode::kTruncated, "the header ends before ElementDataFile"};
}

// `count` numbers of the first key there is; all `fallback` without any.
template <class Number>
Result<std::vector<Number>> numbers(const Header& header, std::initializer_list<const char*> names,
                                    std::size_t count, std::optional<Number> fallback) {
  const std::string* text = header.find(names);
  if (text == nullptr) {
    if (fallback) return std::vector<Number>(count, *fallback);
    return {ErrorCode::kBadData, fmt::format("{} is missing", *names.begin())};
  }
  std::vector<Number> values;
  for (const std::string& word : words(*text)) {
    const auto value = number<Number>(word);
    if (!value) return {ErrorCode::kBadData, fmt::format("{}: '{}' is no number", *names.begin(), word)};
    values.push_back(*value);
  }
  if (values.size() != count)
    return {ErrorCode::kBadData, fmt::format("{} must be {} numbers", *names.begin(), count)};
  return values;
}

Result<bool> truth(const Header& header, std::initializer_list<const char*> names, bool fallback) {
  const std::string* text = header.find(names);
  if (text == nullptr) return fallback;
  if (!text->empty() && std::string("TtYy1").find(text->front()) != std::string::npos) return true;
  if (!text->empty() && std::string("FfNn0").find(text->front()) != std::string::npos) return false;
  return {ErrorCode::kBadData, fmt::format("{} is neither True nor False", *names.begin())};
}

Result<ScalarType> scalarTypeOf(const Header& header) {
  static const std::map<std::string, ScalarType> kTypes{
      {"MET_CHAR", ScalarType::kInt8},       {"MET_UCHAR", ScalarType::kUint8},
      {"MET_SHORT", ScalarType::kInt16},     {"MET_USHORT", ScalarType::kUint16},
      {"MET_INT", ScalarType::kInt32},       {"MET_UINT", ScalarType::kUint32},
      {"MET_LONG", ScalarType::kInt32},      {"MET_ULONG", ScalarType::kUint32},
      {"MET_LONG_LONG", ScalarType::kInt64}, {"MET_ULONG_LONG", ScalarType::kUint64},
      {"MET_FLOAT", ScalarType::kFloat32},   {"MET_DOUBLE", ScalarType::kFloat64}};
  const std::string* name = header.find({"ElementType"});
  const auto type = name == nullptr ? kTypes.end() : kTypes.find(*name);
  if (type != kTypes.end()) return type->second;
  return {ErrorCode::kUnsupported,
          fmt::format("ElementType {} is not a scalar type", name == nullptr ? "(none)" : *name)};
}

Result<Grid> gridOf(const Header& header, const std::vector<std::int64_t>& sizes) {
  const std::size_t n = sizes.size();
  ISOREEL_ASSIGN(const auto spacing, numbers<double>(header, {"ElementSpacing", "ElementSize"}, n, 1.0));
  ISOREEL_ASSIGN(const auto origin, numbers<double>(header, {"Offset", "Position", "Origin"}, n, 0.0));
  std::vector<double> matrix;
  if (const auto names = {"TransformMatrix", "Rotation", "Orientation"}; header.find(names) != nullptr) {
    ISOREEL_ASSIGN(matrix, numbers<double>(header, names, n * n, 0.0));
  }
  Grid grid;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    ISOREEL_TRY(setNodes(grid, axis, sizes[axis]));
    grid.spacing[axis] = spacing[axis];
    grid.origin[axis] = origin[axis];
    // The file has the direction of one axis after the other.
    for (std::size_t row = 0; row < 3 && !matrix.empty(); ++row)
      grid.direction[3 * row + axis] = matrix[n * axis + row];
    if (n == 4 && !matrix.empty() && (matrix[4 * axis + 3] != 0 || matrix[12 + axis] != 0))
      return {ErrorCode::kUnsupported, "TransformMatrix mixes space and time"};
  }
  ISOREEL_TRY(checkGrid(grid));
  return grid;
}

// Files of "name%03d.raw FIRST LAST [STEP]"; none when `value` is no such pattern.
Result<std::vector<std::string>> filesOfPattern(const std::string& value) {
  std::vector<std::string> names;
  const std::vector<std::string> parts = words(value);
  const auto pattern = parts.empty() ? std::nullopt : NumberedName::parse(parts[0]);
  if (!pattern || parts.size() < 3 || parts.size() > 4) return names;
  const auto first = number<std::uint64_t>(parts[1]), last = number<std::uint64_t>(parts[2]);
  const auto step = parts.size() == 4 ? number<std::uint64_t>(parts[3]) : 1;
  if (!first || !last || !step || *step == 0 || *last < *first || (*last - *first) / *step >= kMaxFiles)
    return {ErrorCode::kBadData, "ElementDataFile is not like a%03d.raw 1 9 1"};
  for (std::uint64_t i = 0; i <= (*last - *first) / *step; ++i)
    names.push_back(pattern->with(*first + i * *step));
  return names;
}

// The files that hold the samples, and how many there must be; none for LOCAL.
Result<std::vector<std::string>> dataFiles(const Header& header, const std::vector<std::int64_t>& sizes) {
  const std::string& value = header.fields.at("ElementDataFile");
  if (value == "LOCAL" || value == "Local" || value == "local") return std::vector<std::string>();
  ISOREEL_ASSIGN(std::vector<std::string> names, filesOfPattern(value));
  std::size_t fileAxes = sizes.size() - 1;
  if (value.starts_with("LIST")) {
    if (const auto parts = words(value); parts.size() == 2 && parts[0] == "LIST") {
      const auto axes = number<std::size_t>(parts[1]);
      if (!axes || *axes < 1 || *axes > sizes.size())
        return {ErrorCode::kBadData, fmt::format("ElementDataFile = {}: how many axes has a file?", value)};
      fileAxes = *axes;
    }
    names = header.list;
  }
  if (names.empty() && !value.starts_with("LIST")) return std::vector<std::string>{value};
  std::int64_t expected = 1;
  for (std::size_t axis = fileAxes; axis < sizes.size(); ++axis) {
    if (__builtin_mul_overflow(expected, sizes[axis], &expected))
      return {ErrorCode::kLimit, "DimSize is too large"};
  }
  if (names.size() != static_cast<std::uint64_t>(expected)) {
    return {ErrorCode::kBadData,
            fmt::format("ElementDataFile names {} files where DimSize needs {}", names.size(), expected)};
  }
  return names;
}

Status checkKind(const Header& header) {
  if (const std::string* type = header.find({"ObjectType"}); type != nullptr && *type != "Image")
    return {ErrorCode::kUnsupported, fmt::format("ObjectType {} is not Image", *type)};
  ISOREEL_ASSIGN(const auto channels,
                 numbers<std::int64_t>(header, {"ElementNumberOfChannels"}, 1, std::int64_t{1}));
  if (channels[0] != 1) {
    return {ErrorCode::kUnsupported,
            fmt::format("has {} channels: only scalar volumes can be read", channels[0])};
  }
  ISOREEL_ASSIGN(const bool binary, truth(header, {"BinaryData"}, true));
  if (!binary) return {ErrorCode::kUnsupported, "BinaryData = False: samples as text cannot be read"};
  return {};
}

Result<StoredVolumes> describe(const Header& header, const std::string& path) {
  ISOREEL_TRY(checkKind(header));
  ISOREEL_ASSIGN(const auto axes, numbers<std::int64_t>(header, {"NDims"}, 1, std::nullopt));
  if (axes[0] != 3 && axes[0] != 4) {
    return {ErrorCode::kBadData,
            fmt::format("has {} axes; a volume has 3, or 4 with time as the last", axes[0])};
  }
  ISOREEL_ASSIGN(const auto sizes,
                 numbers<std::int64_t>(header, {"DimSize"}, static_cast<std::size_t>(axes[0]), std::nullopt));
  StoredVolumes stored;
  stored.header = path;
  ISOREEL_ASSIGN(stored.grid, gridOf(header, sizes));
  if (axes[0] == 4) {
    if (sizes[3] < 1) return {ErrorCode::kBadData, fmt::format("DimSize says {} volumes", sizes[3])};
    stored.volumes = static_cast<std::size_t>(sizes[3]);
  }
  ISOREEL_ASSIGN(stored.type, scalarTypeOf(header));
  ISOREEL_ASSIGN(const bool msb, truth(header, {"ElementByteOrderMSB", "BinaryDataByteOrderMSB"}, false));
  stored.order = msb ? std::endian::big : std::endian::little;
  ISOREEL_ASSIGN(const bool compressed, truth(header, {"CompressedData"}, false));
  stored.coding = compressed ? Coding::kDeflated : Coding::kPlain;

  // Bytes before the samples in each file; -1 for whatever is not samples.
  ISOREEL_ASSIGN(const auto before, numbers<std::int64_t>(header, {"HeaderSize"}, 1, std::int64_t{0}));
  if (before[0] < -1 || (before[0] == -1 && compressed))
    return {ErrorCode::kBadData, fmt::format("HeaderSize is {}", before[0])};
  ISOREEL_ASSIGN(std::vector<std::string> files, dataFiles(header, sizes));
  const bool local = files.empty();
  if (local) files.push_back(path);
  std::uint64_t partBytes = stored.grid.nodeCount() * scalarBytes(stored.type);
  if (__builtin_mul_overflow(partBytes, stored.volumes, &partBytes))
    return {ErrorCode::kLimit, fmt::format("DimSize says {} volumes", stored.volumes)};
  partBytes /= files.size();
  for (std::string& file : files) {
    if (!local) file = (std::filesystem::path(path).parent_path() / file).string();
    std::uint64_t offset = before[0] > 0 ? static_cast<std::uint64_t>(before[0]) : local ? header.end : 0;
    if (before[0] == -1) {
      ISOREEL_ASSIGN(const std::uint64_t size, regularFileSize(file));
      offset = size - std::min(size, partBytes);
    }
    stored.parts.push_back({std::move(file), offset});
  }
  return stored;
}

SequenceResult openOne(const std::string& path) {
  ISOREEL_ASSIGN(const Header header, readHeader(path).at(path));
  ISOREEL_ASSIGN(StoredVolumes stored, describe(header, path).at(path));
  return openStored(std::move(stored));
}

}  // namespace

SequenceResult openMetaImage(const std::vector<std::string>& files, const VolumeOptions&) {
  return openEach(files, openOne);
}

}  // namespace isoreel::io
