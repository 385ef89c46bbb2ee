// SPDX-License-Identifier: BSD-3-Clause
// OpenVDB: the box that holds the active voxels of all files becomes the grid, so that a surface which moves
// through a sequence stays inside. Voxels outside a file's active ones have what its tree says there: tiles
// or background.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Dense.h>

#include <algorithm>
#include <cmath>

#include "src/files.h"
#include "src/sequence.h"
#include "src/vdb_layout.h"

namespace isoreel::io {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;

// A few bytes of active tiles can span any box, so a sequence may be this large whatever its files' sizes (1
// GiB of floats), and beyond that by this many samples to a byte: a narrow band takes 1/100 of its box or
// more, at about a byte a voxel.
constexpr std::uint64_t kFreeSamples = std::uint64_t{1} << 28;
constexpr std::uint64_t kSamplesPerByte = 4096;

struct VdbFile {
  std::string path;
  std::uint64_t bytes = 0;
  CoordBBox active;  // empty when no voxel is
  bool levelSet = false;
  Grid placement;  // of voxel (0, 0, 0); nodes unused
};

bool isScalar(const openvdb::GridBase& grid) {
  return grid.isType<openvdb::FloatGrid>() || grid.isType<openvdb::DoubleGrid>();
}

bool isLevelSet(const openvdb::GridBase& grid) { return grid.getGridClass() == openvdb::GRID_LEVEL_SET; }

std::string describe(const CoordBBox& box) {
  if (box.empty()) return "nothing";
  return fmt::format("({}, {}, {}) to ({}, {}, {})", box.min().x(), box.min().y(), box.min().z(),
                     box.max().x(), box.max().y(), box.max().z());
}

// An open file, without delayed loading: that maps the file, and damage would surface as a crash later.
class OpenFile {
 public:
  explicit OpenFile(const std::string& path) : file_(path) { file_.open(false); }
  ~OpenFile() { file_.close(); }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  openvdb::io::File& operator*() { return file_; }
  openvdb::io::File* operator->() { return &file_; }

 private:
  openvdb::io::File file_;
};

// The name of the grid to read: `wanted`, or the only scalar one, or the only level set. Reads metadata only.
Result<std::string> chooseGrid(openvdb::io::File& file, const std::string& wanted) {
  std::vector<std::string> list, scalars, levelSets;
  for (auto name = file.beginName(); name != file.endName(); ++name) {
    std::string type = "of an unknown type";
    bool scalar = false;
    try {
      const auto grid = file.readGridMetadata(*name);
      type = fmt::format("{}, {}", grid->valueType(),
                         openvdb::GridBase::gridClassToString(grid->getGridClass()));
      scalar = isScalar(*grid);
      if (scalar) scalars.push_back(*name);
      if (scalar && isLevelSet(*grid)) levelSets.push_back(*name);
    } catch (const openvdb::KeyError&) {  // of a type that this OpenVDB does not know: no reason to refuse
                                          // the others
    }
    std::string shown = *name;
    std::replace_if(
        shown.begin(), shown.end(), [](char c) { return c < ' ' && c >= 0; }, '?');
    list.push_back(fmt::format("{} ({})", shown, type));
    if (*name != wanted || wanted.empty()) continue;
    if (!scalar) return {ErrorCode::kUnsupported, fmt::format("grid {} is not a float grid", list.back())};
    return wanted;
  }
  const std::string has = list.empty() ? "it has none" : fmt::format("it has {}", fmt::join(list, ", "));
  if (!wanted.empty()) return {ErrorCode::kNotFound, fmt::format("no grid \"{}\"; {}", wanted, has)};
  if (scalars.size() == 1) return scalars.front();
  if (levelSets.size() == 1) return levelSets.front();
  if (scalars.empty()) return {ErrorCode::kNotFound, fmt::format("no float grid; {}", has)};
  return {ErrorCode::kInvalidArgument, fmt::format("choose a grid by name; {}", has)};
}

// Where voxel (0, 0, 0) lies and how the axes run. OpenVDB's maps take row vectors; Jacobian columns are the
// same for all.
Result<Grid> placementOf(const openvdb::math::Transform& transform) {
  if (!transform.isLinear())
    return {ErrorCode::kUnsupported,
            fmt::format("transform {}: only linear ones can be read", transform.mapType())};
  Grid grid;
  const openvdb::Vec3d origin = transform.indexToWorld(openvdb::Vec3d(0, 0, 0));
  for (int axis = 0; axis < 3; ++axis) {
    openvdb::Vec3d unit(0, 0, 0);
    unit[axis] = 1;
    const openvdb::Vec3d column = transform.baseMap()->applyJacobian(unit);
    setAxis(grid, static_cast<std::size_t>(axis), {column[0], column[1], column[2]});
    grid.origin[static_cast<std::size_t>(axis)] = origin[axis];
  }
  ISOREEL_TRY(checkGrid(grid));
  return grid;
}

// The box as the writer noted it, so that no tree need be loaded, or else as the tree has it.
CoordBBox activeBox(openvdb::io::File& file, const std::string& name, const openvdb::GridBase& metadata) {
  const auto min =
      metadata.getMetadata<openvdb::TypedMetadata<openvdb::Vec3i>>(openvdb::GridBase::META_FILE_BBOX_MIN);
  const auto max =
      metadata.getMetadata<openvdb::TypedMetadata<openvdb::Vec3i>>(openvdb::GridBase::META_FILE_BBOX_MAX);
  if (min && max) return {Coord(min->value()), Coord(max->value())};
  return file.readGrid(name)->evalActiveVoxelBoundingBox();
}

Result<VdbFile> inspect(const std::string& path, std::string& gridName) {
  ISOREEL_ASSIGN(const std::uint64_t bytes, regularFileSize(path));
  ISOREEL_TRY(checkVdbLayout(path, bytes));
  OpenFile file(path);
  ISOREEL_ASSIGN(gridName, chooseGrid(*file, gridName).at(path));
  const auto metadata = file->readGridMetadata(gridName);
  VdbFile result{path, bytes, {}, isLevelSet(*metadata), {}};
  ISOREEL_ASSIGN(result.placement, placementOf(metadata->transform()).at(path));
  result.active = activeBox(*file, gridName, *metadata);  // only now: this may load the tree
  return result;
}

// OpenVDB's classes throw nothing we could not name better here.
Result<VdbFile> inspectCaught(const std::string& path, std::string& gridName) {
  try {
    return inspect(path, gridName);
  } catch (const std::exception& error) {
    return {ErrorCode::kBadData, fmt::format("{}: {}", path, error.what())};
  }
}

class VdbSequence : public VolumeSequence {
 public:
  VdbSequence(std::vector<VdbFile> files, std::string gridName, const CoordBBox& box, const Grid& grid)
      : files_(std::move(files)), gridName_(std::move(gridName)), box_(box), grid_(grid) {}
  std::size_t size() const override { return files_.size(); }
  const Grid& grid() const override { return grid_; }
  bool levelSet() const override {
    return std::all_of(files_.begin(), files_.end(), [](const VdbFile& file) { return file.levelSet; });
  }
  std::string name(std::size_t i) const override { return files_[i].path; }

  Result<Volume> read(std::size_t i) override {
    const std::string& path = files_[i].path;
    ISOREEL_TRY(checkVdbLayout(path, files_[i].bytes));  // again, since files change
    OpenFile file(path);
    const openvdb::GridBase::Ptr grid = file->readGrid(gridName_);
    const CoordBBox active = grid->evalActiveVoxelBoundingBox();
    if (!active.empty() && !box_.isInside(active)) {
      return {ErrorCode::kBadData,
              fmt::format("{}: active voxels of grid {} span {}, but its metadata says {}", path, gridName_,
                          describe(active), describe(files_[i].active))};
    }
    std::vector<float> values(grid_.nodeCount());
    openvdb::tools::Dense<float, openvdb::tools::LayoutXYZ> dense(box_, values.data());
    if (const auto floats = openvdb::GridBase::grid<openvdb::FloatGrid>(grid)) {
      openvdb::tools::copyToDense(floats->tree(), dense, /*serial=*/true);
    } else if (const auto doubles = openvdb::GridBase::grid<openvdb::DoubleGrid>(grid)) {
      openvdb::tools::copyToDense(doubles->tree(), dense, /*serial=*/true);
    } else {
      return {ErrorCode::kBadData,
              fmt::format("{}: grid {} is {} now, not a float grid", path, gridName_, grid->valueType())};
    }
    return Volume::own(grid_, std::move(values));
  }

 private:
  std::vector<VdbFile> files_;
  std::string gridName_;
  CoordBBox box_;
  Grid grid_;
};

// The grid of `box`, if a volume may be that large.
Result<Grid> gridOf(const CoordBBox& box, const std::vector<VdbFile>& files) {
  Grid grid = files.front().placement;
  std::uint64_t samples = 1, bytes = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    const std::int64_t nodes = box.empty() ? 0 : std::int64_t{box.max()[a]} - box.min()[a] + 1;
    if (nodes < kMinNodes || nodes > kMaxNodes) {
      return {nodes < kMinNodes ? ErrorCode::kBadData : ErrorCode::kLimit,
              fmt::format("{}{}: active voxels span {}; a volume has {} to {} nodes a side",
                          files.front().path, files.size() > 1 ? " to " + files.back().path : "",
                          describe(box), kMinNodes, kMaxNodes)};
    }
    grid.nodes[a] = static_cast<std::uint32_t>(nodes);
    samples *= static_cast<std::uint64_t>(nodes);
  }
  for (const VdbFile& file : files) bytes = std::max(bytes, file.bytes);
  if (samples > std::max(kFreeSamples, kSamplesPerByte * bytes)) {
    return {ErrorCode::kLimit,
            fmt::format("{}: active voxels span {}, too much for files of {} bytes at most",
                        files.front().path, describe(box), bytes)};
  }
  grid.origin = grid.world(Vec3d{double(box.min().x()), double(box.min().y()), double(box.min().z())});
  return grid;
}

}  // namespace

SequenceResult openOpenVdb(const std::vector<std::string>& paths, const VolumeOptions& options) {
  openvdb::initialize();
  std::string gridName = options.array;
  std::vector<VdbFile> files;
  CoordBBox box;
  for (const std::string& path : paths) {
    // The first file chooses, the others must have a grid of that name.
    ISOREEL_ASSIGN(files.emplace_back(), inspectCaught(path, gridName));
    if (!files.back().active.empty()) box.expand(files.back().active);
  }
  ISOREEL_ASSIGN(const Grid grid, gridOf(box, files));
  for (const VdbFile& file : files) {
    // Over the whole box, where a small difference of spacing shows.
    Grid same = grid, other = file.placement;
    other.nodes = same.nodes;
    other.origin = other.world(Vec3d{double(box.min().x()), double(box.min().y()), double(box.min().z())});
    ISOREEL_TRY(checkSameGrid(same, files.front().path, other, file.path));
  }
  return std::unique_ptr<VolumeSequence>(
      std::make_unique<VdbSequence>(std::move(files), gridName, box, grid));
}

}  // namespace isoreel::io
