// SPDX-License-Identifier: BSD-3-Clause
#include <meshoptimizer.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "coder.h"

namespace isoreel::bench {
namespace {

constexpr int kZstdLevel = 19;

/// The fourth value is padding: meshoptimizer takes vertices in units of four bytes.
using Quantised = std::array<std::uint16_t, 4>;

using Buffer = std::vector<unsigned char>;

Status zstdError(std::size_t code) {
  if (!ZSTD_isError(code)) return {};
  return {ErrorCode::kBadData, std::string("zstd: ") + ZSTD_getErrorName(code)};
}

Status compress(const Buffer& from, Buffer& to) {
  to.resize(ZSTD_compressBound(from.size()));
  const std::size_t size = ZSTD_compress(to.data(), to.size(), from.data(), from.size(), kZstdLevel);
  ISOREEL_TRY(zstdError(size));
  to.resize(size);
  return {};
}

Status decompress(const Buffer& from, Buffer& to) {
  to.resize(ZSTD_getFrameContentSize(from.data(), from.size()));
  return zstdError(ZSTD_decompress(to.data(), to.size(), from.data(), from.size()));
}

class MeshoptCoder : public Coder {
 public:
  explicit MeshoptCoder(int bits) : bits_(bits) {}

  Label label() const override { return {"meshoptimizer", "zstd 19", static_cast<double>(bits_)}; }
  void prepare(const Frame& frame) override {
    input_ = frame.extracted;
    decoded_ = {};
    quantised_ = std::vector<Quantised>();
    coded_indices_ = Buffer();
    coded_vertices_ = Buffer();
  }
  Status encode() override {
    quantise();
    std::vector<std::uint32_t> indices = indicesOf(input_), ordered(indices.size());
    meshopt_optimizeVertexCache(ordered.data(), indices.data(), indices.size(), quantised_.size());
    std::vector<Quantised> vertices(quantised_.size());
    vertices.resize(meshopt_optimizeVertexFetch(vertices.data(), ordered.data(), ordered.size(),
                                                quantised_.data(), quantised_.size(), sizeof(Quantised)));
    meshopt_encodeIndexVersion(1);
    Buffer coded(std::max(meshopt_encodeIndexBufferBound(ordered.size(), vertices.size()),
                          meshopt_encodeVertexBufferBound(vertices.size(), sizeof(Quantised))));
    Buffer part = coded;
    part.resize(meshopt_encodeIndexBuffer(part.data(), part.size(), ordered.data(), ordered.size()));
    ISOREEL_TRY(compress(part, coded_indices_));
    coded.resize(meshopt_encodeVertexBuffer(coded.data(), coded.size(), vertices.data(), vertices.size(),
                                            sizeof(Quantised)));
    vertex_count_ = vertices.size();
    return compress(coded, coded_vertices_);
  }
  Status decode() override {
    Buffer part;
    ISOREEL_TRY(decompress(coded_indices_, part));
    decoded_.triangles.resize(input_.triangles.size());
    if (meshopt_decodeIndexBuffer(decoded_.triangles.data(), 3 * decoded_.triangles.size(),
                                  sizeof(std::uint32_t), part.data(), part.size()) != 0)
      return {ErrorCode::kBadData, "meshoptimizer: the index buffer"};
    ISOREEL_TRY(decompress(coded_vertices_, part));
    std::vector<Quantised> vertices(vertex_count_);
    if (meshopt_decodeVertexBuffer(vertices.data(), vertices.size(), sizeof(Quantised), part.data(),
                                   part.size()) != 0)
      return {ErrorCode::kBadData, "meshoptimizer: the vertex buffer"};
    decoded_.points.resize(vertices.size());
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis)
        decoded_.points[i][axis] = low_[axis] + static_cast<float>(vertices[i][axis]) * step_;
    }
    return {};
  }
  /// With what a reader needs besides: two counts, and the box as four floats.
  std::size_t bytes() const override { return coded_indices_.size() + coded_vertices_.size() + 24; }
  inspect::Mesh mesh() const override { return decoded_; }

 private:
  static std::vector<std::uint32_t> indicesOf(const inspect::Mesh& mesh) {
    std::vector<std::uint32_t> result;
    result.reserve(3 * mesh.triangles.size());
    for (const Triangle& triangle : mesh.triangles)
      result.insert(result.end(), triangle.begin(), triangle.end());
    return result;
  }

  void quantise() {
    std::array<float, 3> high{};
    low_.fill(std::numeric_limits<float>::max());
    for (const auto& point : input_.points) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        low_[axis] = std::min(low_[axis], point[axis]);
        high[axis] = std::max(high[axis], point[axis]);
      }
    }
    const float extent = std::max({high[0] - low_[0], high[1] - low_[1], high[2] - low_[2], 1e-6f});
    step_ = extent / static_cast<float>((1 << bits_) - 1);
    quantised_.assign(input_.points.size(), {});
    for (std::size_t i = 0; i < quantised_.size(); ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis)
        quantised_[i][axis] =
            static_cast<std::uint16_t>(std::lround((input_.points[i][axis] - low_[axis]) / step_));
    }
  }

  int bits_;
  inspect::Mesh input_, decoded_;
  std::vector<Quantised> quantised_;
  std::array<float, 3> low_{};
  float step_ = 1;
  std::size_t vertex_count_ = 0;
  Buffer coded_indices_, coded_vertices_;
};

}  // namespace

std::unique_ptr<Coder> meshoptCoder(int bits) { return std::make_unique<MeshoptCoder>(bits); }

}  // namespace isoreel::bench
