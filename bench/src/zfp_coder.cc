// SPDX-License-Identifier: BSD-3-Clause
#include <zfp.h>

#include "coder.h"

namespace isoreel::bench {
namespace {

class ZfpCoder : public Coder {
 public:
  ZfpCoder(double tolerance, double scale) : tolerance_(tolerance), scale_(scale) {}

  Label label() const override { return {"zfp", "accuracy", tolerance_}; }
  void prepare(const Frame& frame) override {
    new_volume_ = frame.volume_number != frame_.volume_number || frame_.volume.samples.empty();
    frame_ = frame;
    coded_ = Bytes();
    surface_ = {};
  }
  Status encode() override {
    return code(const_cast<float*>(frame_.volume.samples.data()), true);  // zfp only reads them
  }
  Status decode() override {
    std::vector<float> samples(frame_.volume.samples.size());
    ISOREEL_TRY(code(samples.data(), false));
    const Volume volume = Volume::own(frame_.volume.grid, std::move(samples));
    ISOREEL_ASSIGN(surface_, extractSurface(volume, frame_.isovalue, frame_.inside));
    return {};
  }
  /// A volume is stored once, however many isovalues are looked at.
  std::size_t bytes() const override { return new_volume_ ? coded_.size() : 0; }
  inspect::Mesh mesh() const override { return inspect::meshOf(surface_); }

 private:
  Status code(float* samples, bool encode) {
    const auto& nodes = frame_.volume.grid.nodes;
    zfp_field* field = zfp_field_3d(samples, zfp_type_float, nodes[0], nodes[1], nodes[2]);
    zfp_stream* stream = zfp_stream_open(nullptr);
    zfp_stream_set_accuracy(stream, tolerance_ * scale_);
    if (encode) coded_.resize(zfp_stream_maximum_size(stream, field));
    bitstream* bits = stream_open(coded_.data(), coded_.size());
    zfp_stream_set_bit_stream(stream, bits);
    zfp_stream_rewind(stream);
    const std::size_t size = encode ? zfp_compress(stream, field) : zfp_decompress(stream, field);
    if (encode) coded_.resize(size);
    stream_close(bits);
    zfp_stream_close(stream);
    zfp_field_free(field);
    if (size == 0)
      return {ErrorCode::kBadData, encode ? "zfp: compressing failed" : "zfp: decompressing failed"};
    return {};
  }

  double tolerance_, scale_;
  Frame frame_;
  bool new_volume_ = false;
  Bytes coded_;
  Surface surface_;
};

}  // namespace

std::unique_ptr<Coder> zfpCoder(double tolerance, double scale) {
  return std::make_unique<ZfpCoder>(tolerance, scale);
}

}  // namespace isoreel::bench
