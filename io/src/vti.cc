// SPDX-License-Identifier: BSD-3-Clause
// VTK's XML image data (.vti): one piece of point data, as text, base64 or raw bytes, in its place or
// appended.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <isoreel/io/scalar.h>

#include <algorithm>
#include <charconv>
#include <pugixml.hpp>

#include "src/files.h"
#include "src/mapped_file.h"
#include "src/sequence.h"
#include "src/vtk_data.h"

namespace isoreel::io {
namespace {

std::string inQuotes(std::string_view text) {
  std::string shown(text.substr(0, 60));
  std::replace_if(
      shown.begin(), shown.end(), [](char c) { return c < ' ' && c >= 0; }, '?');
  return '"' + shown + '"';
}

template <class Number, std::size_t n>
Status readNumbers(const pugi::xml_node& node, const char* name, std::array<Number, n>& out) {
  const std::string_view text = node.attribute(name).value();
  const char* at = text.data();
  const char* const end = at + text.size();
  const auto skipSpace = [&] {
    while (at != end && (*at == ' ' || *at == '\t' || *at == '\n' || *at == '\r')) ++at;
  };
  bool whole = true;
  for (Number& value : out) {
    skipSpace();
    const auto [stop, error] = std::from_chars(at, end, value);
    whole = whole && error == std::errc();
    at = stop;
  }
  skipSpace();
  if (whole && at == end) return {};
  return {ErrorCode::kBadData, fmt::format("{}={} must be {} numbers", name, inQuotes(text), n)};
}

std::optional<ScalarType> scalarTypeOf(std::string_view name) {
  std::string lower(name);
  for (char& c : lower) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return scalarTypeNamed(lower);
}

// A file's XML, and its bytes behind the "_" of AppendedData.
class VtiFile {
 public:
  static Result<VtiFile> open(const std::string& path) {
    VtiFile file;
    ISOREEL_ASSIGN(const std::uint64_t size, regularFileSize(path));
    if (size == 0) return {ErrorCode::kTruncated, "the file is empty"};
    ISOREEL_ASSIGN(file.map_, MappedFile::open(path, size));
    const ByteSpan bytes = file.map_->bytes();
    std::string_view xml(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    // Appended bytes are no XML: it is cut behind their tag, and closed as a file without them would be.
    std::string cut;
    if (const std::size_t tag = xml.find("<AppendedData"); tag != std::string_view::npos) {
      const std::size_t close = xml.find('>', tag);
      const std::size_t mark = xml.find_first_not_of(" \t\r\n", std::min(close, xml.size() - 1) + 1);
      if (close == std::string_view::npos || mark == std::string_view::npos || xml[mark] != '_')
        return {ErrorCode::kTruncated, "AppendedData without the _ that its bytes follow"};
      file.appended_ = bytes.subspan(mark + 1);
      cut = std::string(xml.substr(0, close + 1)) + "</AppendedData></VTKFile>";
      xml = cut;
    }
    file.document_ = std::make_unique<pugi::xml_document>();
    const auto parsed = file.document_->load_buffer(xml.data(), xml.size());
    if (!parsed) {
      return {ErrorCode::kBadData,
              fmt::format("not whole XML: {} at byte {}", parsed.description(), parsed.offset)};
    }
    ISOREEL_TRY(file.readCoding());
    return file;
  }

  pugi::xml_node image() const { return root().child("ImageData"); }

  // The `count` values of `array`.
  Result<std::vector<float>> read(const pugi::xml_node& array, std::size_t count) const {
    ISOREEL_ASSIGN(const ScalarType type, typeOf(array));
    std::vector<float> values;
    if (isText(array)) {
      const std::string_view text = array.text().get();
      if (text.size() / 2 + 1 < count) {  // a digit and a space each
        return {ErrorCode::kTruncated,
                fmt::format("{} bytes of text cannot hold {} numbers", text.size(), count)};
      }
      values.resize(count);
      ISOREEL_TRY(readVtkText(text, values));
      return values;
    }
    ISOREEL_ASSIGN(const auto bytes, readBinary(array, count * scalarBytes(type)));
    values.resize(count);
    convertScalars(type, coding_.order, bytes.data(), values);
    return values;
  }

  // The time that VTK's writers leave in the field data, if they do; a double, where a float would show.
  std::optional<double> time() const {
    const pugi::xml_node array = image().child("FieldData").find_child_by_attribute("Name", "TimeValue");
    if (!array) return std::nullopt;
    if (isText(array)) return array.text().as_double();
    const Result<ScalarType> type = typeOf(array);
    if (!type.ok() || *type != ScalarType::kFloat64) return std::nullopt;
    const auto bytes = readBinary(array, sizeof(double));
    if (!bytes.ok()) return std::nullopt;
    std::array<std::uint8_t, sizeof(double)> raw{};
    std::copy(bytes->begin(), bytes->end(), raw.begin());
    if (coding_.order != std::endian::native) std::reverse(raw.begin(), raw.end());
    return std::bit_cast<double>(raw);
  }

 private:
  pugi::xml_node root() const { return document_->child("VTKFile"); }

  static Result<ScalarType> typeOf(const pugi::xml_node& array) {
    const std::string_view name = array.attribute("type").value();
    if (const auto type = scalarTypeOf(name)) return *type;
    return {ErrorCode::kUnsupported, fmt::format("type {} is not a scalar of 8 to 64 bits", inQuotes(name))};
  }

  static bool isText(const pugi::xml_node& array) {
    return std::string_view(array.attribute("format").as_string("ascii")) == "ascii";
  }

  Result<std::vector<std::uint8_t>> readBinary(const pugi::xml_node& array, std::uint64_t bytes) const {
    const std::string_view format = array.attribute("format").value();
    if (format == "binary") {
      const std::string_view text = array.text().get();
      return readVtkBinary({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}, true, coding_,
                           bytes);
    }
    if (format != "appended") {
      return {ErrorCode::kBadData,
              fmt::format("format {} is not ascii, binary or appended", inQuotes(format))};
    }
    const std::uint64_t offset = array.attribute("offset").as_ullong(~0ull);
    if (offset >= appended_.size())
      return {ErrorCode::kTruncated, fmt::format("its offset {} lies behind the end of the file", offset)};
    const std::string_view encoding = root().child("AppendedData").attribute("encoding").value();
    if (encoding != "base64" && encoding != "raw")
      return {ErrorCode::kBadData, fmt::format("AppendedData is {}, not raw or base64", inQuotes(encoding))};
    return readVtkBinary(appended_.subspan(offset), encoding == "base64", coding_, bytes);
  }

  Status readCoding() {
    const std::string_view type = root().attribute("type").value(),
                           order = root().attribute("byte_order").value(),
                           header = root().attribute("header_type").as_string("UInt32"),
                           compressor = root().attribute("compressor").value();
    if (type != "ImageData")
      return {ErrorCode::kUnsupported, fmt::format("holds {}, not ImageData", inQuotes(type))};
    if (order != "LittleEndian" && order != "BigEndian")
      return {ErrorCode::kBadData,
              fmt::format("byte_order {} is neither LittleEndian nor BigEndian", inQuotes(order))};
    if (header != "UInt32" && header != "UInt64")
      return {ErrorCode::kBadData,
              fmt::format("header_type {} is neither UInt32 nor UInt64", inQuotes(header))};
    if (!compressor.empty() && compressor != "vtkZLibDataCompressor") {
      return {ErrorCode::kUnsupported,
              fmt::format("compressor {}: only vtkZLibDataCompressor can be read", inQuotes(compressor))};
    }
    coding_ = {order == "BigEndian" ? std::endian::big : std::endian::little, header == "UInt64",
               !compressor.empty()};
    return {};
  }

  std::shared_ptr<const MappedFile> map_;
  std::unique_ptr<pugi::xml_document> document_;
  ByteSpan appended_;
  VtkCoding coding_;
};

constexpr std::int64_t kFar = std::int64_t{1} << 40;  // no extent reaches so far, and differences stay exact

Result<Grid> gridOf(const pugi::xml_node& image) {
  std::array<std::int64_t, 6> whole{}, extent{};
  ISOREEL_TRY(readNumbers(image, "WholeExtent", whole));
  const pugi::xml_node piece = image.child("Piece");
  if (!piece || piece.next_sibling("Piece"))
    return {ErrorCode::kUnsupported, "has not exactly one Piece: save it as one"};
  ISOREEL_TRY(readNumbers(piece, "Extent", extent));
  Grid grid;
  if (image.attribute("Origin")) ISOREEL_TRY(readNumbers(image, "Origin", grid.origin));
  if (image.attribute("Spacing")) ISOREEL_TRY(readNumbers(image, "Spacing", grid.spacing));
  if (image.attribute("Direction")) ISOREEL_TRY(readNumbers(image, "Direction", grid.direction));
  Vec3d first{};
  for (std::size_t a = 0; a < 3; ++a) {
    if (extent[2 * a] < whole[2 * a] || extent[2 * a + 1] > whole[2 * a + 1] || extent[2 * a] < -kFar ||
        extent[2 * a + 1] > kFar) {
      return {ErrorCode::kBadData, "the Piece's Extent lies outside of WholeExtent"};
    }
    ISOREEL_TRY(setNodes(grid, a, extent[2 * a + 1] - extent[2 * a] + 1));
    first[a] = static_cast<double>(extent[2 * a]);
  }
  grid.origin = grid.world(first);  // Origin is that of node (0, 0, 0), wherever the extent begins
  ISOREEL_TRY(checkGrid(grid));
  return grid;
}

// The point data array to read: `wanted`, or the only scalar one.
Result<pugi::xml_node> chooseArray(const pugi::xml_node& image, const std::string& wanted) {
  const pugi::xml_node piece = image.child("Piece");
  std::vector<std::string> list;
  std::vector<pugi::xml_node> scalars;
  for (const pugi::xml_node& array : piece.child("PointData").children("DataArray")) {
    const std::string_view name = array.attribute("Name").value(), type = array.attribute("type").value();
    const std::string_view components = array.attribute("NumberOfComponents").as_string("1");
    const bool scalar = components == "1" && scalarTypeOf(type);
    list.push_back(fmt::format("{} ({}{})", inQuotes(name), type,
                               components == "1" ? "" : fmt::format(" x {}", components)));
    if (scalar) scalars.push_back(array);
    if (name != wanted || wanted.empty()) continue;
    if (!scalar) return {ErrorCode::kUnsupported, fmt::format("array {} is not scalar", list.back())};
    return array;
  }
  std::string has = list.empty() ? "its point data have none"
                                 : fmt::format("its point data have {}", fmt::join(list, ", "));
  std::vector<std::string> cells;
  for (const pugi::xml_node& array : piece.child("CellData").children("DataArray"))
    cells.push_back(inQuotes(array.attribute("Name").value()));
  if (!cells.empty())
    has += fmt::format("; cell data ({}) cannot be read: turn them into point data first",
                       fmt::join(cells, ", "));
  if (!wanted.empty()) return {ErrorCode::kNotFound, fmt::format("no array {}; {}", inQuotes(wanted), has)};
  if (scalars.size() == 1) return scalars.front();
  return {scalars.empty() ? ErrorCode::kNotFound : ErrorCode::kInvalidArgument,
          fmt::format("{}; {}", scalars.empty() ? "no scalar array" : "choose an array by name", has)};
}

struct VtiFrame {
  std::string path;
  std::optional<double> time;
};

class VtiSequence : public VolumeSequence {
 public:
  VtiSequence(std::vector<VtiFrame> frames, std::string array, const Grid& grid)
      : frames_(std::move(frames)), array_(std::move(array)), grid_(grid) {}
  std::size_t size() const override { return frames_.size(); }
  const Grid& grid() const override { return grid_; }
  bool levelSet() const override { return false; }  // VTI has no word for it
  std::optional<double> time(std::size_t i) const override { return frames_[i].time; }
  std::string name(std::size_t i) const override { return frames_[i].path; }

  Result<Volume> read(std::size_t i) override {
    const std::string& path = frames_[i].path;
    ISOREEL_ASSIGN(const VtiFile file, VtiFile::open(path).at(path));
    ISOREEL_ASSIGN(const Grid grid, gridOf(file.image()).at(path));
    if (grid.nodes != grid_.nodes)
      return {ErrorCode::kBadData, path + ": the file changed after it was opened"};
    ISOREEL_ASSIGN(const pugi::xml_node array, chooseArray(file.image(), array_).at(path));
    ISOREEL_ASSIGN(
        std::vector<float> values,
        file.read(array, grid.nodeCount()).at(fmt::format("{}: array {}", path, inQuotes(array_))));
    return Volume::own(grid_, std::move(values));
  }

 private:
  std::vector<VtiFrame> frames_;
  std::string array_;
  Grid grid_;
};

}  // namespace

SequenceResult openVti(const std::vector<std::string>& files, const VolumeOptions& options) {
  std::string arrayName = options.array;
  std::vector<VtiFrame> frames;
  std::optional<Grid> first;
  for (const std::string& path : files) {
    ISOREEL_ASSIGN(const VtiFile file, VtiFile::open(path).at(path));
    ISOREEL_ASSIGN(const Grid grid, gridOf(file.image()).at(path));
    if (!first) first = grid;
    ISOREEL_TRY(checkSameGrid(*first, files.front(), grid, path));
    // The first file chooses, the others must have an array of that name.
    ISOREEL_ASSIGN(const pugi::xml_node array, chooseArray(file.image(), arrayName).at(path));
    arrayName = array.attribute("Name").value();
    frames.push_back({path, file.time()});
  }
  return std::unique_ptr<VolumeSequence>(std::make_unique<VtiSequence>(std::move(frames), arrayName, *first));
}

}  // namespace isoreel::io
