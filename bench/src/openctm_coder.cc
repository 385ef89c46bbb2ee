// SPDX-License-Identifier: BSD-3-Clause
#include <openctm.h>

#include <cstring>

#include "coder.h"

namespace isoreel::bench {
namespace {

constexpr CTMuint kLzmaLevel = 1;

struct Context {
  explicit Context(CTMenum mode) : handle(ctmNewContext(mode)) {}
  Context(const Context&) = delete;
  ~Context() { ctmFreeContext(handle); }
  Status status() const {
    const CTMenum error = ctmGetError(handle);
    if (error == CTM_NONE) return {};
    return {ErrorCode::kBadData, std::string("OpenCTM: ") + ctmErrorString(error)};
  }
  CTMcontext handle;
};

class OpenctmCoder : public Coder {
 public:
  explicit OpenctmCoder(double precision) : precision_(precision) {}

  Label label() const override { return {"openctm", "MG2", precision_}; }
  void prepare(const Frame& frame) override {
    input_ = frame.extracted;
    decoded_ = {};
    coded_ = Bytes();
  }
  Status encode() override {
    Context context(CTM_EXPORT);
    ctmDefineMesh(context.handle, input_.points[0].data(), static_cast<CTMuint>(input_.points.size()),
                  input_.triangles[0].data(), static_cast<CTMuint>(input_.triangles.size()), nullptr);
    ctmCompressionMethod(context.handle, CTM_METHOD_MG2);
    ctmCompressionLevel(context.handle, kLzmaLevel);
    ctmVertexPrecision(context.handle, static_cast<CTMfloat>(precision_));
    coded_.clear();
    const auto write = [](const void* data, CTMuint size, void* to) -> CTMuint {
      const auto* bytes = static_cast<const std::uint8_t*>(data);
      static_cast<Bytes*>(to)->insert(static_cast<Bytes*>(to)->end(), bytes, bytes + size);
      return size;
    };
    ctmSaveCustom(context.handle, write, &coded_);
    return context.status();
  }
  Status decode() override {
    Context context(CTM_IMPORT);
    ByteSpan rest(coded_);
    const auto read = [](void* data, CTMuint size, void* from) -> CTMuint {
      auto& left = *static_cast<ByteSpan*>(from);
      const CTMuint count = static_cast<CTMuint>(std::min<std::size_t>(size, left.size()));
      std::memcpy(data, left.data(), count);
      left = left.subspan(count);
      return count;
    };
    ctmLoadCustom(context.handle, read, &rest);
    ISOREEL_TRY(context.status());
    decoded_.points.resize(ctmGetInteger(context.handle, CTM_VERTEX_COUNT));
    decoded_.triangles.resize(ctmGetInteger(context.handle, CTM_TRIANGLE_COUNT));
    std::memcpy(decoded_.points.data(), ctmGetFloatArray(context.handle, CTM_VERTICES),
                decoded_.points.size() * sizeof(decoded_.points[0]));
    std::memcpy(decoded_.triangles.data(), ctmGetIntegerArray(context.handle, CTM_INDICES),
                decoded_.triangles.size() * sizeof(Triangle));
    return {};
  }
  std::size_t bytes() const override { return coded_.size(); }
  inspect::Mesh mesh() const override { return decoded_; }

 private:
  double precision_;
  inspect::Mesh input_, decoded_;
  Bytes coded_;
};

}  // namespace

std::unique_ptr<Coder> openctmCoder(double precision) { return std::make_unique<OpenctmCoder>(precision); }

}  // namespace isoreel::bench
