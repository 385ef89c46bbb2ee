// SPDX-License-Identifier: BSD-3-Clause
// VTK's XML poly data (VTK file formats, "XML file formats"): a header of text, then arrays in zlib blocks.
// And the collection that gives ParaView a series of them with its times.
#include <fmt/format.h>
#include <zlib.h>

#include <bit>
#include <limits>
#include <pugixml.hpp>
#include <sstream>

#include "src/atomic_file.h"
#include "src/mesh.h"

namespace isoreel::io {
namespace {

static_assert(std::endian::native == std::endian::little, "arrays are written as they lie in memory");

constexpr std::size_t kBlockBytes = std::size_t{1} << 20;  // before compression

/// The appended data: each array as numbers of blocks, bytes of a block, bytes of the last if it is shorter,
/// then compressed bytes of each block, and the blocks.
class Appended {
 public:
  /// Gives the array's offset.
  template <class Value>
  std::size_t add(const std::vector<Value>& values) {
    const std::size_t offset = data_.size();
    const auto* bytes = reinterpret_cast<const Bytef*>(values.data());
    const std::size_t size = values.size() * sizeof(Value);
    std::vector<std::uint64_t> header{(size + kBlockBytes - 1) / kBlockBytes, kBlockBytes,
                                      size % kBlockBytes};
    std::string blocks;
    std::vector<Bytef> block(compressBound(kBlockBytes));
    for (std::size_t start = 0; start < size; start += kBlockBytes) {
      uLongf packed = block.size();
      const uLong raw = std::min(kBlockBytes, size - start);
      // Fails for too small a buffer, which compressBound rules out, or for want of memory.
      if (compress2(block.data(), &packed, bytes + start, raw, Z_BEST_SPEED) != Z_OK) throw std::bad_alloc();
      header.push_back(packed);
      blocks.append(reinterpret_cast<const char*>(block.data()), packed);
    }
    data_.append(reinterpret_cast<const char*>(header.data()), header.size() * sizeof header[0]);
    data_ += blocks;
    return offset;
  }
  const std::string& data() const { return data_; }

 private:
  std::string data_;
};

std::string arrayTag(const char* type, const char* name, int components, std::size_t offset) {
  return fmt::format(
      "<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" offset=\"{}\"/>\n",
      type, name, components, offset);
}

}  // namespace

Result<std::string> vtpOf(const Mesh& mesh, const MeshOptions& options) {
  if (mesh.triangles.size() > std::numeric_limits<std::int32_t>::max() / 3)
    return {ErrorCode::kLimit, "more triangles than 32-bit numbers in a VTP file can count"};
  Appended arrays;
  std::string text = fmt::format(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\">\n<PolyData>\n");
  if (options.seconds) {
    text += fmt::format(
        "<FieldData>\n<DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" "
        "format=\"ascii\">{}</DataArray>\n</FieldData>\n",
        *options.seconds);
  }
  text += fmt::format(
      "<Piece NumberOfPoints=\"{}\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" "
      "NumberOfPolys=\"{}\">\n<Points>\n{}</Points>\n",
      mesh.positions.size(), mesh.triangles.size(),
      arrayTag("Float32", "Points", 3, arrays.add(mesh.positions)));
  if (options.normals) {
    text += fmt::format("<PointData Normals=\"Normals\">\n{}</PointData>\n",
                        arrayTag("Float32", "Normals", 3, arrays.add(mesh.normals)));
  }
  std::vector<std::uint32_t> ends(mesh.triangles.size());
  for (std::size_t i = 0; i < ends.size(); ++i) ends[i] = static_cast<std::uint32_t>(3 * (i + 1));
  text += "<Polys>\n";
  text += arrayTag("Int32", "connectivity", 1, arrays.add(mesh.triangles));
  text += arrayTag("Int32", "offsets", 1, arrays.add(ends));
  text += "</Polys>\n</Piece>\n</PolyData>\n";
  text += "<AppendedData encoding=\"raw\">\n_";
  text += arrays.data();
  return text + "\n</AppendedData>\n</VTKFile>\n";
}

Status writeSeries(const std::vector<SeriesFrame>& frames, const std::filesystem::path& index) {
  try {
    pugi::xml_document document;
    pugi::xml_node file = document.append_child("VTKFile");
    file.append_attribute("type") = "Collection";
    file.append_attribute("version") = "1.0";
    pugi::xml_node collection = file.append_child("Collection");
    for (const SeriesFrame& frame : frames) {
      pugi::xml_node entry = collection.append_child("DataSet");
      entry.append_attribute("timestep") = fmt::format("{}", frame.seconds).c_str();
      entry.append_attribute("file") =
          frame.file.lexically_proximate(index.parent_path()).generic_string().c_str();
    }
    std::ostringstream text;
    document.save(text, "  ");
    return writeWhole(index, text.str());
  } catch (const std::exception& error) {
    return {ErrorCode::kIo, fmt::format("{}: {}", index.string(), error.what())};
  }
}

}  // namespace isoreel::io
