// SPDX-License-Identifier: BSD-3-Clause
// Raw samples, described by a small JSON file:
//   {"dims":[nx,ny,nz], "dtype":"float32", "spacing":[..], "origin":[..], "direction":[9], "endian":"little",
//    "offset":0, "levelset":false, "files":["a.raw", ..]}
// Only dims, dtype and files are required. Each file holds one volume, x fastest, after `offset` bytes.
#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "src/files.h"
#include "src/stored_sequence.h"

namespace isoreel::io {
namespace {

using Json = nlohmann::json;

// A description of 100 000 files takes a few MB.
constexpr std::uint64_t kMaxJsonBytes = 64u << 20;

// The numbers of array `key` into `out`, whose length is the array's; false leaves `out` as it was.
template <class Numbers>
bool readNumbers(const Json& json, const char* key, Numbers& out) {
  const auto found = json.find(key);
  if (found == json.end() || !found->is_array() || found->size() != out.size()) return false;
  for (const Json& value : *found) {
    if (!value.is_number()) return false;
  }
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = (*found)[i].get<double>();
  return true;
}

Result<Grid> readGrid(const Json& json) {
  Grid grid;
  Vec3d dims{};
  bool whole = readNumbers(json, "dims", dims);
  for (std::size_t i = 0; i < 3 && whole; ++i) {
    whole = dims[i] >= kMinNodes && dims[i] <= kMaxNodes && json["dims"][i].is_number_integer();
    if (whole) grid.nodes[i] = static_cast<std::uint32_t>(dims[i]);
  }
  if (!whole) {
    return {ErrorCode::kBadData,
            fmt::format("\"dims\" must be three whole numbers from {} to {}", kMinNodes, kMaxNodes)};
  }
  if (json.contains("spacing") && !readNumbers(json, "spacing", grid.spacing)) {
    return {ErrorCode::kBadData, "\"spacing\" must be three numbers"};
  }
  if (json.contains("origin") && !readNumbers(json, "origin", grid.origin)) {
    return {ErrorCode::kBadData, "\"origin\" must be three numbers"};
  }
  if (json.contains("direction") && !readNumbers(json, "direction", grid.direction)) {
    return {ErrorCode::kBadData, "\"direction\" must be nine numbers, row by row"};
  }
  ISOREEL_TRY(checkGrid(grid));
  return grid;
}

Result<StoredVolumes> readLayout(const Json& json, const std::filesystem::path& folder) {
  StoredVolumes layout;
  ISOREEL_ASSIGN(layout.grid, readGrid(json));
  const auto type = json.contains("dtype") && json["dtype"].is_string()
                        ? scalarTypeNamed(json["dtype"].get<std::string>())
                        : std::nullopt;
  if (!type) {
    return {ErrorCode::kBadData,
            "\"dtype\" must be float32, float64, int8, int16, int32, int64 or uint8 to uint64"};
  }
  layout.type = *type;
  const Json endian = json.value("endian", Json("little"));
  if (endian != "little" && endian != "big") return {ErrorCode::kBadData, "\"endian\" must be little or big"};
  layout.order = endian == "big" ? std::endian::big : std::endian::little;
  const Json offset = json.value("offset", Json(0u));
  if (!offset.is_number_unsigned() || offset.get<std::uint64_t>() > (std::uint64_t{1} << 60)) {
    return {ErrorCode::kBadData, "\"offset\" must be a whole number of bytes, 0 or above"};
  }
  const Json levelSet = json.value("levelset", Json(false));
  if (!levelSet.is_boolean()) return {ErrorCode::kBadData, "\"levelset\" must be true or false"};
  layout.levelSet = levelSet.get<bool>();
  const Json files = json.value("files", Json());
  if (!files.is_array() || files.empty())
    return {ErrorCode::kBadData, "\"files\" must list one file at least"};
  for (const Json& file : files) {
    if (!file.is_string()) return {ErrorCode::kBadData, "\"files\" must list file names"};
    layout.parts.push_back({(folder / file.get<std::string>()).string(), offset.get<std::uint64_t>()});
  }
  layout.volumes = layout.parts.size();
  return layout;
}

SequenceResult openOne(const std::string& path) {
  ISOREEL_ASSIGN(const std::uint64_t size, regularFileSize(path));
  if (size > kMaxJsonBytes)
    return {ErrorCode::kLimit, fmt::format("{}: JSON above {} bytes", path, kMaxJsonBytes)};
  Json json;
  try {
    std::ifstream file(path, std::ios::binary);
    json = Json::parse(file);
  } catch (const Json::parse_error& error) {
    return {ErrorCode::kBadData, fmt::format("{}: not valid JSON: {}", path, error.what())};
  }
  ISOREEL_ASSIGN(StoredVolumes layout, readLayout(json, std::filesystem::path(path).parent_path()).at(path));
  layout.header = path;
  return openStored(std::move(layout));
}

}  // namespace

SequenceResult openRawJson(const std::vector<std::string>& files, const VolumeOptions&) {
  return openEach(files, openOne);
}

}  // namespace isoreel::io
